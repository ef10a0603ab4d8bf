//! The box: between which two numbers of each axis the model is shown.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{SectionEvent, words};
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;

const AXES: [&str; 3] = ["x", "y", "z"];
/// Stable names of the ends for tests.
const ENDS: [&str; 2] = ["from", "to"];
/// Steps of a slider.
const STEPS: f64 = 400.0;

/// The switch, and the ends of the box.
#[component]
pub(super) fn LimitsRows(ui: Ui) -> impl IntoView {
    let is_on = ui.part(|s| s.features.section.limits.is_some());
    let can_be = ui.part(|s| s.features.section.extent.is_some());
    view! {
        <label class="switch-row">
            <span>{t!("section.box")} <small>{t!("section.box.what")}</small></span>
            <input
                class="switch" type="checkbox" role="switch" data-testid="section-box"
                prop:checked=move || is_on.get() prop:disabled=move || !can_be.get()
                on:change=move |e| ui.send_feature(SectionEvent::ShowLimits(event_target_checked(&e)))
            />
        </label>
        <Show when=move || is_on.get()>
            <div class="section-box" role="group" aria-label=t!("section.box")>
                {(0..3).flat_map(|axis| (0..2).map(move |end| (axis, end))).map(|(axis, end)| view! {
                    <EndRow ui axis end/>
                }).collect_view()}
            </div>
        </Show>
    }
}

/// One end along an axis: a slider and a number.
#[component]
fn EndRow(ui: Ui, axis: usize, end: usize) -> impl IntoView {
    let at = ui.part(move |s| s.features.section.limits.map_or(0.0, |corners| corners[end][axis]));
    let range =
        ui.part(move |s| s.features.section.extent.map_or([0.0; 2], |corners| corners.map(|corner| corner[axis])));
    let unit = ui.part(|s| s.features.measure.unit);
    let one = move || unit.get().in_metres();
    let send = move |event: web_sys::Event| {
        let value: f64 = event_target_value(&event).parse().unwrap_or(f64::NAN);
        let at = value * unit.get_untracked().in_metres();
        ui.send_feature(SectionEvent::Limit { axis, end, at });
    };
    let name = format!("{} {}", AXES[axis], [t!("section.from"), t!("section.to")][end]);
    view! {
        <span class="section-end" aria-hidden="true">{name.clone()}</span>
        <input
            type="range" class="slider" data-testid=format!("section-{}-{}-slider", AXES[axis], ENDS[end])
            aria-label=t!("section.box.end", name) aria-valuetext=move || words::length(at.get(), unit.get())
            prop:min=move || (range.get()[0] / one()).to_string() prop:max=move || (range.get()[1] / one()).to_string()
            prop:step=move || ((range.get()[1] - range.get()[0]) / one() / STEPS).max(1e-6).to_string()
            prop:value=move || range.with(|_| (at.get() / one()).to_string()) on:input=send
        />
        <input
            class="number" type="number" step="any" aria-label=t!("section.box.end", name)
            data-testid=format!("section-{}-{}", AXES[axis], ENDS[end])
            prop:value=move || words::number(at.get(), unit.get()) on:change=send
        />
    }
}
