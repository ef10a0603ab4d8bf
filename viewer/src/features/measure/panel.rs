//! The panel of the measurements: what to measure, and the list.

use super::controller::MeasureController;
use super::{Kind, Measure, MeasureEvent, Measurement, csv, overlay};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::icons::{CLOSE, Icon};
use crate::ui::{Command, Ui};
use leptos::prelude::*;
use semascan_model::LengthUnit;
use std::rc::Rc;

impl FeatureView for Measure {
    fn panel(ui: Ui) -> AnyView {
        view! { <MeasurePanel ui/> }.into_any()
    }

    fn overlay(ui: Ui) -> AnyView {
        view! { <overlay::MeasureOverlay ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(MeasureController::new(host))
    }
}

/// The units that lengths are shown in.
const UNITS: [LengthUnit; 2] = [LengthUnit::Millimetres, LengthUnit::Inches];

#[component]
fn MeasurePanel(ui: Ui) -> impl IntoView {
    let kind = ui.part(|s| s.features.measure.kind);
    let has_model = ui.part(|s| s.has_model());
    let has_any = ui.part(|s| !s.features.measure.list.is_empty());
    let prompt = ui.part(|s| s.features.measure.prompt());
    let choice = move |option: Kind| {
        let is_chosen = move || kind.get() == Some(option);
        let title = match option {
            Kind::Distance => "Distance of two points (M)",
            Kind::Angle => "Angle of three points (G)",
        };
        view! {
            <button
                class="button" type="button" title=title data-testid=format!("measure-{}", option.key())
                aria-pressed=move || is_chosen().to_string() prop:disabled=move || !has_model.get()
                on:click=move |_| ui.send_feature(MeasureEvent::Choose((!is_chosen()).then_some(option)))
            >
                {option.label()}
            </button>
        }
    };
    view! {
        <section
            class="panel" aria-labelledby="measure-title" data-testid="measure"
            data-kind=move || kind.get().map_or("none", Kind::key)
        >
            <header class="panel-head"><h2 id="measure-title">"Measure"</h2> <UnitChoice ui/></header>
            <div class="buttons">{Kind::ALL.into_iter().map(choice).collect_view()}</div>
            <p class="empty measure-prompt" role="status" data-testid="measure-prompt">{move || prompt.get()}</p>
            <Show when=move || has_any.get()><List ui/></Show>
        </section>
    }
}

#[component]
fn UnitChoice(ui: Ui) -> impl IntoView {
    let unit = ui.part(|s| s.features.measure.unit);
    let choice = move |option: LengthUnit| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="measure-unit" value=option.name()
                    data-testid=format!("measure-unit-{}", option.name())
                    prop:checked=move || unit.get() == option
                    on:change=move |_| ui.send_feature(MeasureEvent::Unit(option))
                />
                <span>{option.name()}</span>
            </label>
        }
    };
    view! {
        <fieldset class="segments">
            <legend class="visually-hidden">"Unit of lengths"</legend>
            {UNITS.into_iter().map(choice).collect_view()}
        </fieldset>
    }
}

/// The measurements, and what can be done with all of them.
#[component]
fn List(ui: Ui) -> impl IntoView {
    let list = ui.part(|s| s.features.measure.list.clone());
    let copy = move |_| {
        let text = ui.read(|s| csv(&s.features.measure.list, s.features.measure.unit));
        ui.ask(Command::Copy { text, file: "measurements.csv" });
    };
    view! {
        <ul class="entries" aria-label="Measurements">
            <For each=move || list.get() key=|m| (m.number, m.outdated) let:measurement>
                <Entry ui measurement/>
            </For>
        </ul>
        <p class="empty">
            "Expanded uncertainty, k = 2, of the voxel grid: each point within half a voxel along each axis. Errors that all "
            "points share (camera poses, scale) are not in it."
        </p>
        <div class="switch-row">
            <button class="text-button" type="button" data-testid="measure-copy" on:click=copy>"Copy as CSV"</button>
            <button
                class="text-button" type="button" data-testid="measure-remove-all"
                on:click=move |_| ui.send_feature(MeasureEvent::RemoveAll)
            >
                "Remove all"
            </button>
        </div>
    }
}

#[component]
fn Entry(ui: Ui, measurement: Measurement) -> impl IntoView {
    let unit = ui.part(|s| s.features.measure.unit);
    let (number, kind, outdated) = (measurement.number, measurement.kind, measurement.outdated);
    let value_mm = measurement.estimate().filter(|_| kind == Kind::Distance).map(|e| format!("{:.4}", e.value * 1e3));
    let degrees =
        measurement.estimate().filter(|_| kind == Kind::Angle).map(|e| format!("{:.4}", e.value.to_degrees()));
    let uncertainty = measurement.estimate().map(|e| match kind {
        Kind::Distance => format!("{:.4}", e.expanded() * 1e3),
        Kind::Angle => format!("{:.4}", e.expanded().to_degrees()),
    });
    let (figure, axes) = (measurement.clone(), measurement);
    view! {
        <li
            class="entry" data-testid=format!("measurement-{number}") data-kind=kind.key() data-mm=value_mm
            data-degrees=degrees data-uncertainty=uncertainty
        >
            <span class="entry-number">{number}</span>
            <span class="entry-text">
                <span class="visually-hidden">{kind.label()} " "</span>
                {move || figure.value_and_uncertainty(unit.get())}
                <small>
                    {move || axes.axes(unit.get()).map(|[x, y, z]| format!("x {x}, y {y}, z {z}"))}
                    {(kind == Kind::Angle).then_some("angle")}
                    {outdated.then_some(", of an earlier model")}
                </small>
            </span>
            <button
                class="tool" type="button" aria-label=format!("Remove measurement {number}")
                on:click=move |_| ui.send_feature(MeasureEvent::Remove(number))
            >
                <Icon path=CLOSE/>
            </button>
        </li>
    }
}
