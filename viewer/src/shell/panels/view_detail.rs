//! The selected view at large: its picture with labels, uncertainty or contributions over it, what became of it and
//! how long it took.

use super::picture::Picture;
use crate::state::timings::{STAGES, stage_label};
use crate::state::views::{ViewEntry, ViewOverlay};
use crate::state::{Event, units};
use crate::ui::Ui;
use crate::ui::icons::{CLOSE, Icon, NEXT, PREVIOUS, WARNING};
use crate::words::t;
use leptos::prelude::*;

/// A card over the viewport while a view is selected.
#[component]
pub(super) fn ViewDetail(ui: Ui) -> impl IntoView {
    let selected = ui.part(|s| s.views.selected().cloned());
    let overlay = RwSignal::new(ViewOverlay::default());
    view! {
        {move || selected.get().map(|view| view! { <Card ui view overlay/> })}
    }
}

#[component]
fn Card(ui: Ui, view: ViewEntry, overlay: RwSignal<ViewOverlay>) -> impl IntoView {
    let index = view.index;
    let times = ui.part(move |s| s.timings.of_view(index));
    let step = move |by: i32| move |_| ui.send(Event::StepView(by));
    let overlays: Vec<ViewOverlay> =
        ViewOverlay::ALL.into_iter().filter(|o| *o == ViewOverlay::None || view.overlay(*o).is_some()).collect();
    let choice = move |option: ViewOverlay| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="overlay" value=option.key() data-testid=format!("overlay-{}", option.key())
                    prop:checked=move || overlay.get() == option
                    on:change=move |_| overlay.set(option)
                />
                <span>{option.label()}</span>
            </label>
        }
    };
    let (accepted, reason, added) = (view.accepted, view.reason.clone(), view.points_added);
    view! {
        <section class="detail" data-testid="view-detail" aria-label=t!("views.number", number = index + 1)>
            <header class="detail-head">
                <h2>{t!("views.number", number = index + 1)}</h2>
                <button class="tool" type="button" aria-label=t!("command.previous_view") title=t!("views.previous") on:click=step(-1)>
                    <Icon path=PREVIOUS/>
                </button>
                <button class="tool" type="button" aria-label=t!("command.next_view") title=t!("views.next") on:click=step(1)>
                    <Icon path=NEXT/>
                </button>
                <button
                    class="tool" type="button" aria-label=t!("common.close") title=t!("common.close_esc")
                    on:click=move |_| ui.send(Event::SelectView(None))
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            <div class="detail-picture">
                {move || {
                    let alt = t!("views.alt", number = index + 1);
                    view! { <Picture view=view.clone() overlay=overlay.get() alt/> }
                }}
            </div>
            {(overlays.len() > 1).then(|| view! {
                <fieldset class="segments detail-overlays">
                    <legend class="visually-hidden">{t!("views.over")}</legend>
                    {overlays.into_iter().map(choice).collect_view()}
                </fieldset>
            })}
            {(!accepted).then(|| view! {
                <p class="callout callout-warning">
                    <Icon path=WARNING/> <span>{t!("views.rejected", reason = units::sentence(&reason))}</span>
                </p>
            })}
            <dl class="detail-figures">
                <div><dt>{t!("views.added")}</dt><dd>{units::count(added)}</dd></div>
                {STAGES.into_iter().enumerate().map(|(i, stage)| view! {
                    <div>
                        <dt>{stage_label(stage)}</dt>
                        <dd>{move || times.get()[i].map_or_else(|| "–".into(), units::duration)}</dd>
                    </div>
                }).collect_view()}
            </dl>
        </section>
    }
}
