//! The figures of the readings, and of what the pointer is at, at their places in the 3D view.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{Aim, words};
use crate::ui::{Ui, anchor_place};
use leptos::prelude::*;

/// Ends and figures; the lines between them are drawn by the renderer.
#[component]
pub(super) fn SectionOverlay(ui: Ui) -> impl IntoView {
    let dots = ui.part(|s| {
        let section = &s.features.section;
        let aimed = match section.aim {
            Some(Aim::Outline(end)) => Some(end),
            _ => None,
        };
        let ends = section.readings.iter().flat_map(|reading| reading.ends).chain(section.first).chain(aimed);
        ends.map(|end| end.place.map(|c| c as f32)).collect::<Vec<_>>()
    });
    let figures = ui.part(|s| {
        let section = &s.features.section;
        let readings = section.readings.iter().copied().chain(section.aimed());
        readings
            .map(|r| (r.number, r.middle(), words::length(r.estimate().value, s.features.measure.unit)))
            .collect::<Vec<_>>()
    });
    let spoken = ui.part(|s| {
        let reading = s.features.section.readings.last();
        reading
            .map(|r| format!("{} {}", r.kind.label(), words::reading(r, s.features.measure.unit)))
            .unwrap_or_default()
    });
    view! {
        <div class="anchors">
            {move || dots.get().into_iter().map(|place| view! {
                <div class="dot anchored" data-place=anchor_place(place)></div>
            }).collect_view()}
            {move || figures.get().into_iter().map(|(number, place, value)| view! {
                <div
                    class="figure-label is-raised anchored" class:is-soft=number == 0
                    data-testid=format!("section-label-{number}") data-place=anchor_place(place)
                >
                    {value}
                </div>
            }).collect_view()}
        </div>
        <p class="visually-hidden" role="status" data-testid="section-status">{move || spoken.get()}</p>
    }
}
