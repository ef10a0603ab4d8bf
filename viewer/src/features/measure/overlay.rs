//! The picked points and the figures of the measurements, at their places in the 3D view.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::kept;
use crate::ui::{Ui, anchor_place};
use leptos::prelude::*;

/// Points and figures; the lines between them are drawn by the renderer.
#[component]
pub(super) fn MeasureOverlay(ui: Ui) -> impl IntoView {
    let points = ui.part(|s| {
        let measure = &s.features.measure;
        let all = measure.list.iter().flat_map(|m| &m.taken).chain(&measure.taken);
        all.filter(|t| t.of.is_none()).map(|t| t.place).collect::<Vec<_>>()
    });
    let figures = ui.part(|s| {
        let measure = &s.features.measure;
        let of = measure.list.iter().filter_map(|m| Some((m.number, m.place()?, m.value(measure.unit), m.outdated)));
        of.collect::<Vec<_>>()
    });
    let kept = ui.part(|s| {
        let measure = &s.features.measure;
        let of = measure.of_others().map(|kept| {
            let place = kept.measurement.place.map(|c| c as f32);
            (kept.review, place, kept::value(&kept.measurement, measure.unit), kept.is_of_earlier_model)
        });
        of.collect::<Vec<_>>()
    });
    view! {
        <div class="anchors">
            {move || points.get().into_iter().map(|point| view! {
                <div class="dot anchored" data-place=anchor_place(point)></div>
            }).collect_view()}
            {move || figures.get().into_iter().map(|(number, place, value, outdated)| view! {
                <div
                    class="figure-label is-raised anchored" class:is-outdated=outdated
                    data-testid=format!("measure-label-{number}") data-place=anchor_place(place)
                >
                    {value}
                </div>
            }).collect_view()}
            {move || kept.get().into_iter().map(|(review, place, value, outdated)| view! {
                <div
                    class="figure-label is-raised anchored" class:is-outdated=outdated
                    data-testid=format!("kept-label-{review}") data-place=anchor_place(place)
                >
                    {value}
                </div>
            }).collect_view()}
        </div>
    }
}
