//! Where the plane lies: what it lies across, its offset, its side.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{Direction, SectionEvent};
use crate::state::units;
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;

/// Steps of the slider: as fine as a pixel of it.
const STEPS: f64 = 400.0;

/// The rows of the plane.
#[component]
pub(super) fn PlaneRows(ui: Ui) -> impl IntoView {
    view! {
        <DirectionRow ui/>
        <OffsetRow ui/>
    }
}

/// What the plane lies across.
#[component]
fn DirectionRow(ui: Ui) -> impl IntoView {
    let direction = ui.part(|s| s.features.section.direction.key());
    let picked = ui.part(|s| s.features.inspect.picked.filter(|point| point.normal != [0.0; 3]));
    let axis = move |option: Direction| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="section-axis" value=option.key() data-testid=format!("section-{}", option.key())
                    aria-label=t!("section.across.axis", axis = option.key())
                    prop:checked=move || direction.get() == option.key()
                    on:change=move |_| ui.send_feature(SectionEvent::Turn(option))
                />
                <span aria-hidden="true">{option.key().to_uppercase()}</span>
            </label>
        }
    };
    let at_point = move |_| {
        if let Some(point) = picked.get() {
            let [normal, through] = [point.normal, point.position].map(|v| v.map(f64::from));
            ui.send_feature(SectionEvent::Turn(Direction::Surface { normal, through }));
        }
    };
    let why_not = move || picked.get().is_none().then_some(t!("section.pick_first"));
    view! {
        <fieldset class="switch-row">
            <legend class="visually-hidden">{t!("section.across.legend")}</legend>
            <span aria-hidden="true">{t!("section.across")}</span>
            <div class="segments">{Direction::AXES.into_iter().map(axis).collect_view()}</div>
        </fieldset>
        <div class="buttons section-ways">
            <button
                class="button" type="button" data-testid="section-camera"
                aria-pressed=move || (direction.get() == "camera").to_string()
                on:click=move |_| ui.send_feature(SectionEvent::FaceCamera)
            >
                {t!("section.camera")}
            </button>
            <button
                class="button" type="button" data-testid="section-surface" title=why_not
                aria-pressed=move || (direction.get() == "surface").to_string()
                prop:disabled=move || picked.get().is_none() on:click=at_point
            >
                {t!("section.surface")}
            </button>
        </div>
    }
}

/// How far along, and which side is cut away.
#[component]
fn OffsetRow(ui: Ui) -> impl IntoView {
    let offset = ui.part(|s| s.features.section.offset);
    let unit = ui.part(|s| s.features.measure.unit);
    let range = ui.part(|s| s.features.section.range().unwrap_or([0.0, 0.0]));
    let one = move || unit.get().in_metres();
    let send = move |value: String| {
        let value: f64 = value.parse().unwrap_or(f64::NAN);
        ui.send_feature(SectionEvent::Offset(value * unit.get_untracked().in_metres()));
    };
    // Read with the range: where that changes a browser puts the slider elsewhere.
    let slid = move || range.with(|_| (offset.get() / one()).to_string());
    let slide = move |event: web_sys::Event| send(event_target_value(&event));
    let write = move |event: web_sys::Event| send(event_target_value(&event));
    let text = move || super::words::number(offset.get(), unit.get());
    view! {
        <div class="section-offset">
            <input
                type="range" class="slider" data-testid="section-slider" aria-label=t!("section.offset")
                aria-valuetext=move || super::words::length(offset.get(), unit.get())
                prop:min=move || (range.get()[0] / one()).to_string() prop:max=move || (range.get()[1] / one()).to_string()
                prop:step=move || ((range.get()[1] - range.get()[0]) / one() / STEPS).max(1e-6).to_string()
                prop:value=slid on:input=slide
            />
            <label class="section-number">
                <span class="visually-hidden">{t!("section.offset")}</span>
                <input
                    class="number" type="number" step="any" data-testid="section-offset" prop:value=text on:change=write
                />
                <span>{move || units::unit_name(unit.get())}</span>
            </label>
            <button
                class="button" type="button" data-testid="section-flip" title=t!("section.flip.title")
                on:click=move |_| ui.send_feature(SectionEvent::Flip)
            >
                {t!("section.flip")}
            </button>
        </div>
    }
}
