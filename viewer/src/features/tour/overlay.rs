//! The card of a step.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::controller::TourController;
use super::{STEPS, Tour, TourEvent};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Tour {
    fn overlay(ui: Ui) -> AnyView {
        view! { <TourCard ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(TourController::new(host))
    }
}

#[component]
fn TourCard(ui: Ui) -> impl IntoView {
    let tour = ui.part(|s| s.features.tour);
    let is_first = move || tour.get().step == Some(0);
    let is_last = move || tour.get().step == Some(STEPS.len() - 1);
    let place = move || {
        let (step, count) = (tour.get().step.map_or(0, |step| step + 1), STEPS.len());
        t!("tour.place", step, count)
    };
    let on_key = move |event: web_sys::KeyboardEvent| {
        if event.key() == "Escape" {
            event.stop_propagation();
            ui.send_feature(TourEvent::End);
        }
    };
    view! {
        <Show when=move || tour.get().step.is_some()>
            <section
                class="tour is-raised" role="dialog" aria-labelledby="tour-title" aria-describedby="tour-text" data-testid="tour"
                data-step=move || tour.get().shown().map(|step| step.key) on:keydown=on_key
            >
                <p class="tour-place">{place}</p>
                <h2 id="tour-title">{move || tour.get().shown().map(|step| step.title())}</h2>
                <p id="tour-text">{move || tour.get().shown().map(|step| step.text())}</p>
                <div class="row-actions">
                    <button
                        class="text-button" type="button" data-testid="tour-end"
                        on:click=move |_| ui.send_feature(TourEvent::End)
                    >
                        {t!("tour.end")}
                    </button>
                    <button
                        class="button" type="button" data-testid="tour-back" prop:disabled=is_first
                        on:click=move |_| ui.send_feature(TourEvent::Step(-1))
                    >
                        {t!("tour.back")}
                    </button>
                    <button
                        class="button is-primary" type="button" data-testid="tour-next"
                        on:click=move |_| ui.send_feature(TourEvent::Step(1))
                    >
                        {move || if is_last() { t!("tour.done") } else { t!("tour.next") }}
                    </button>
                </div>
            </section>
        </Show>
    }
}
