//! The list of the labels: the way to them by keyboard.

use super::controller::InspectController;
use super::{Inspect, InspectEvent, overlay, words};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use crate::ui::icons::{CLOSE, Icon};
use crate::words::t;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Inspect {
    fn panel(ui: Ui) -> AnyView {
        view! { <LabelsPanel ui/> }.into_any()
    }

    fn overlay(ui: Ui) -> AnyView {
        view! { <overlay::InspectOverlay ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(InspectController::new(host))
    }
}

#[component]
fn LabelsPanel(ui: Ui) -> impl IntoView {
    let labels = ui.part(|s| s.features.inspect.labels.clone());
    view! {
        <Show when=move || !labels.with(Vec::is_empty)>
            <section class="panel" aria-labelledby="labels-title" data-testid="labels">
                <header class="panel-head">
                    <h2 id="labels-title">{t!("inspect.labels")}</h2>
                    <button
                        class="text-button" type="button" data-testid="labels-remove-all" title=t!("inspect.remove_all.title")
                        on:click=move |_| ui.send_feature(InspectEvent::RemoveAll)
                    >
                        {t!("common.remove_all")}
                    </button>
                </header>
                <ul class="entries">
                    <For each=move || labels.get() key=|label| (label.number, label.outdated) let:label>
                        <li class="entry" data-testid=format!("label-entry-{}", label.number)>
                            <span class="entry-number">{label.number}</span>
                            <span class="entry-text">
                                {move || ui.follow(|s| words::component(s, &label.point))}
                                <small>
                                    {format!(" {} mm", label.point.position.map(words::millimetres).join(", "))}
                                    {label.outdated.then_some(t!("common.of_earlier_model"))}
                                </small>
                            </span>
                            <button
                                class="tool" type="button" aria-label=t!("inspect.remove", number = label.number)
                                on:click=move |_| ui.send_feature(InspectEvent::Remove(label.number))
                            >
                                <Icon path=CLOSE/>
                            </button>
                        </li>
                    </For>
                </ul>
            </section>
        </Show>
    }
}
