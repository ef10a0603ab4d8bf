//! The panel of the measurements: what to measure, and the list.

use super::controller::MeasureController;
use super::kept_panel::Kept;
use super::{KINDS, Kind, Measure, MeasureEvent, Measurement, Picking, csv, kept, overlay};
use crate::features::view::{Controller, FeatureView, Host};
use crate::state::units;
use crate::ui::icons::{CLOSE, Icon};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use semascan_model::LengthUnit;
use semascan_model::measurement::Dimension;
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

#[component]
fn MeasurePanel(ui: Ui) -> impl IntoView {
    let kind = ui.part(|s| s.features.measure.kind);
    let has_model = ui.part(|s| s.has_model());
    let has_any = ui.part(|s| !s.features.measure.list.is_empty());
    let prompt = ui.part(|s| s.features.measure.prompt(!s.features.mesh.is_wanted() && !s.features.mesh.is_running()));
    let choice = move |option: Kind| {
        let is_chosen = move || kind.get() == Some(option);
        view! {
            <button
                class="button" type="button" title=option.title() data-testid=format!("measure-{}", option.key())
                aria-pressed=move || is_chosen().to_string() prop:disabled=move || !has_model.get()
                on:click=move |_| ui.send_feature(MeasureEvent::Choose((!is_chosen()).then_some(option)))
            >
                {option.name()}
            </button>
        }
    };
    view! {
        <section
            class="panel" aria-labelledby="measure-title" data-testid="measure"
            data-kind=move || kind.get().map_or("none", Kind::key)
        >
            <header class="panel-head"><h2 id="measure-title">{t!("measure.panel")}</h2> <UnitChoice ui/></header>
            <div class="buttons measure-kinds">{KINDS.into_iter().map(choice).collect_view()}</div>
            <p class="empty measure-prompt" role="status" data-testid="measure-prompt">{move || prompt.get()}</p>
            <Show when=move || has_any.get()><List ui/></Show>
            <Kept ui/>
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
                <span>{units::unit_name(option)}</span>
            </label>
        }
    };
    view! {
        <fieldset class="segments">
            <legend class="visually-hidden">{t!("measure.unit")}</legend>
            {Measure::UNITS.into_iter().map(choice).collect_view()}
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
        <ul class="entries" aria-label=t!("measure.list")>
            <For each=move || list.get() key=|m| (m.number, m.outdated, m.kept) let:measurement>
                <Entry ui measurement/>
            </For>
        </ul>
        <details class="measure-how">
            <summary>{t!("measure.how")}</summary>
            <p>{t!("measure.how.points")}</p>
            <p>
                {t!("measure.how.elements")}
            </p>
            <p>{t!("measure.how.areas")}</p>
            <p>{t!("measure.how.scale")}</p>
        </details>
        <div class="switch-row">
            <button class="text-button" type="button" data-testid="measure-copy" on:click=copy>{t!("measure.copy")}</button>
            <button
                class="text-button" type="button" data-testid="measure-remove-all"
                on:click=move |_| ui.send_feature(MeasureEvent::RemoveAll)
            >
                {t!("common.remove_all")}
            </button>
        </div>
    }
}

#[component]
fn Entry(ui: Ui, measurement: Measurement) -> impl IntoView {
    let unit = ui.part(|s| s.features.measure.unit);
    let picking = ui.part(|s| s.features.measure.kind.is_some_and(Kind::takes_elements));
    let (number, kind, outdated) = (measurement.number, measurement.kind, measurement.outdated);
    let of = |dimension: Dimension, value: f64| {
        (measurement.dimension() == dimension).then(|| format!("{:.4}", value / dimension.one(LengthUnit::Millimetres)))
    };
    let estimate = measurement.estimate();
    let value_mm = estimate.and_then(|e| of(Dimension::Length, e.value));
    let degrees = estimate.and_then(|e| of(Dimension::Angle, e.value));
    let area = estimate.and_then(|e| of(Dimension::Area, e.value));
    let uncertainty = estimate.and_then(|e| of(measurement.dimension(), e.expanded()));
    let can_be_used = measurement.fit().is_some() && !outdated;
    let points = measurement.fit().map(|fit| fit.used.to_string());
    let name = (!kept::is_plain(kind)).then(|| kind.name());
    let is_kept = measurement.kept.is_some();
    let (figure, axes, note) = (measurement.clone(), measurement.clone(), measurement);
    view! {
        <li
            class="entry" data-testid=format!("measurement-{number}") data-kind=kind.key() data-mm=value_mm
            data-degrees=degrees data-mm2=area data-uncertainty=uncertainty data-points=points
            data-kept=is_kept.to_string()
        >
            <span class="entry-number">{number}</span>
            <span class="entry-text">
                <span class="visually-hidden">{kind.name()} " "</span>
                {move || figure.value_and_uncertainty(unit.get())}
                <small>
                    {move || axes.axes(unit.get()).map(|[x, y, z]| format!("x {x}, y {y}, z {z}"))}
                    {name}
                    {outdated.then_some(t!("common.of_earlier_model"))}
                    {is_kept.then_some(t!("measure.entry.kept"))}
                    {move || note.note(unit.get()).map(|note| format!("{}{note}", if name.is_some() { ": " } else { "" }))}
                </small>
            </span>
            <Show when=move || can_be_used && picking.get()>
                <button
                    class="text-button" type="button" data-testid=format!("measure-use-{number}")
                    aria-label=t!("measure.pick", element = kind.element_name(), number)
                    on:click=move |_| ui.send_feature(MeasureEvent::Use(number))
                >
                    {t!("measure.pick.short")}
                </button>
            </Show>
            <button
                class="tool" type="button" aria-label=t!("measure.remove", number)
                on:click=move |_| ui.send_feature(MeasureEvent::Remove(number))
            >
                <Icon path=CLOSE/>
            </button>
        </li>
    }
}
