//! The panel of the comparison: what the mesh is compared with, and how far it deviates.

use super::controller::DeviationController;
use super::{Deviation, DeviationEvent, overlay};
use crate::display::ColorMode;
use crate::features::view::{Controller, FeatureView, Host};
use crate::mesh_worker::placement::Mismatch;
use crate::mesh_worker::{DeviationFigures, ReferenceInfo};
use crate::state::notices::{Level, Topic};
use crate::state::units;
use crate::ui::Ui;
use crate::ui::icons::{Icon, WARNING};
use crate::words::{decimal, signed, t};
use leptos::prelude::*;
use semascan_model::LengthUnit;
use std::rc::Rc;
use wasm_bindgen::JsCast;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{File, HtmlInputElement};

/// Files that a reference is read from.
const ACCEPT: &str = ".ply,.obj,.stl,.glb,.pcd";

impl FeatureView for Deviation {
    fn panel(ui: Ui) -> AnyView {
        view! { <DeviationPanel ui/> }.into_any()
    }

    fn overlay(ui: Ui) -> AnyView {
        view! { <overlay::DeviationScale ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(DeviationController::new(host))
    }
}

#[component]
fn DeviationPanel(ui: Ui) -> impl IntoView {
    let reference = ui.part(|s| s.features.deviation.reference.clone());
    let reading = ui.part(|s| s.features.deviation.reading.clone());
    let has_model = ui.part(|s| s.has_model());
    let take_file = move |event: web_sys::Event| {
        let Some(input) = event.target().and_then(|t| t.dyn_into::<HtmlInputElement>().ok()) else { return };
        if let Some(file) = input.files().and_then(|files| files.get(0)) {
            read_file(ui, file);
        }
        // The same file may be chosen again.
        input.set_value("");
    };
    view! {
        <section class="panel" aria-labelledby="deviation-title">
            <header class="panel-head"><h2 id="deviation-title">{t!("common.deviation")}</h2></header>
            <div class="switch-row">
                <span>
                    {move || match (reading.get(), reference.get()) {
                        (Some(name), _) => view! { {t!("deviation.reading", name)} <small>""</small> }.into_any(),
                        (None, Some(reference)) => {
                            let about = description(&reference);
                            view! { <span data-testid="reference">{reference.name}</span> <small>{about}</small> }.into_any()
                        }
                        (None, None) => {
                            view! { {t!("deviation.compare")} <small>{t!("deviation.compare.with")}</small> }.into_any()
                        }
                    }}
                </span>
                <span class="row-actions">
                    <Show when=move || reference.get().is_some()>
                        <button
                            class="text-button" type="button" data-testid="reference-forget"
                            on:click=move |_| ui.send_feature(DeviationEvent::Removed)
                        >
                            {t!("deviation.remove")}
                        </button>
                    </Show>
                    <label class="text-button file-button" class:is-disabled=move || !has_model.get()>
                        <input
                            class="visually-hidden" type="file" accept=ACCEPT data-testid="reference-file"
                            prop:disabled=move || !has_model.get() on:change=take_file
                        />
                        {move || if reference.get().is_some() { t!("deviation.change") } else { t!("deviation.load") }}
                    </label>
                </span>
            </div>
            <Show when=move || reference.get().is_some()>
                <UnitChoice ui/>
                <Doubts ui/>
                <Figures ui/>
            </Show>
        </section>
    }
}

/// What unit the reference is in: as the file says or its size suggests, or as the person says.
#[component]
fn UnitChoice(ui: Ui) -> impl IntoView {
    let chosen = ui.part(|s| s.features.deviation.unit);
    let option = move |unit: LengthUnit| {
        view! { <option value=unit.name() prop:selected=move || chosen.get() == Some(unit)>{units::unit_name(unit)}</option> }
    };
    let choose = move |event: web_sys::Event| {
        ui.send_feature(DeviationEvent::Unit(LengthUnit::parse(&event_target_value(&event))));
    };
    view! {
        <label class="switch-row">
            <span>{t!("deviation.unit")} <small>{t!("deviation.unit.of")}</small></span>
            <select class="number" data-testid="reference-unit" on:change=choose>
                <option value="" prop:selected=move || chosen.get().is_none()>{t!("deviation.unit.automatic")}</option>
                {LengthUnit::ALL.into_iter().map(option).collect_view()}
            </select>
        </label>
    }
}

/// What the reader of the file had to say, and why the deviations may mean nothing.
#[component]
fn Doubts(ui: Ui) -> impl IntoView {
    let warnings = ui.part(|s| s.features.deviation.reference.as_ref().map(|r| r.warnings.clone()).unwrap_or_default());
    let mismatch = ui.part(|s| s.features.deviation.figures.and_then(|f| f.mismatch));
    let shown = ui.part(|s| s.display.color_mode == ColorMode::Deviation);
    let other_unit = move |mismatch: Mismatch| match mismatch {
        Mismatch::Unit { fits, .. } => Some(view! {
            <button
                class="button" type="button" data-testid="reference-unit-offer"
                on:click=move |_| ui.send_feature(DeviationEvent::Unit(Some(fits)))
            >
                {t!("deviation.take_for", unit = units::unit_name(fits))}
            </button>
        }),
        _ => None,
    };
    view! {
        {move || mismatch.get().map(|mismatch| view! {
            <div class="callout callout-warning" role="alert" data-testid="reference-mismatch">
                <Icon path=WARNING/>
                <div>
                    <p>
                        {mismatch.sentence()}
                        {(!shown.get()).then_some(t!("deviation.not_coloured"))}
                    </p>
                    {other_unit(mismatch)}
                </div>
            </div>
        })}
        {move || (!warnings.with(Vec::is_empty)).then(|| view! {
            <div class="callout callout-warning" data-testid="reference-warnings">
                <Icon path=WARNING/>
                <div>
                    {warnings.get().into_iter().take(MOST_WARNINGS).map(|w| view! { <p>{units::sentence(&w)}</p> }).collect_view()}
                    {move || {
                        let more = warnings.with(Vec::len).saturating_sub(MOST_WARNINGS);
                        (more > 0).then(|| view! { <p>{t!("deviation.more", count = more)}</p> })
                    }}
                </div>
            </div>
        })}
    }
}

/// Warnings of a reader that are shown; the others are counted.
const MOST_WARNINGS: usize = 4;

/// The tolerance, and the deviations in figures.
#[component]
fn Figures(ui: Ui) -> impl IntoView {
    let figures = ui.part(|s| s.features.deviation.figures);
    let tolerance = ui.part(|s| s.features.deviation.tolerance);
    let set_tolerance = move |event: web_sys::Event| {
        let millimetres: f64 = event_target_value(&event).parse().unwrap_or(f64::NAN);
        ui.send_feature(DeviationEvent::Tolerance(millimetres * 1e-3));
    };
    let data = move |of: fn(&DeviationFigures) -> f32| {
        move || figures.get().map(|f| format!("{:.4}", f64::from(of(&f)) * 1e3))
    };
    let size = move |of: fn(&DeviationFigures) -> f32| {
        move || figures.get().map_or_else(|| "–".to_owned(), |f| format!("{} mm", decimal(f64::from(of(&f)) * 1e3, 3)))
    };
    let signed = move |of: fn(&DeviationFigures) -> f32| {
        move || figures.get().map_or_else(|| "–".to_owned(), |f| format!("{} mm", signed(f64::from(of(&f)) * 1e3, 3)))
    };
    view! {
        <label class="switch-row">
            <span>{t!("deviation.tolerance")} <small>{t!("deviation.tolerance.unit")}</small></span>
            <input
                class="number" type="number" min="0.001" max="100" step="0.05" data-testid="tolerance"
                prop:value=move || format!("{}", (tolerance.get() * 1e6).round() / 1e3) on:change=set_tolerance
            />
        </label>
        <dl
            class="figures is-signed" data-testid="deviation" data-mean-mm=data(|f| f.mean) data-rms-mm=data(|f| f.rms)
            data-p95-mm=data(|f| f.p95)
        >
            <div><dt>{t!("deviation.mean")}</dt><dd>{signed(|f| f.mean)}</dd></div>
            <div><dt>{t!("deviation.rms")}</dt><dd>{size(|f| f.rms)}</dd></div>
            <div><dt>"95 %"</dt><dd>{size(|f| f.p95)}</dd></div>
            <div><dt>{t!("deviation.least")}</dt><dd>{signed(|f| f.range[0])}</dd></div>
            <div><dt>{t!("deviation.most")}</dt><dd>{signed(|f| f.range[1])}</dd></div>
        </dl>
    }
}

/// What a reference holds, and in which unit.
fn description(reference: &ReferenceInfo) -> String {
    let what = match reference.triangles {
        0 => t!("count.points", count = units::count(reference.points.into())),
        triangles => t!("count.triangles", count = units::count(triangles.into())),
    };
    let unit = units::unit_name(reference.unit);
    let unit = if reference.is_guess { t!("deviation.guessed", unit) } else { t!("deviation.in_unit", unit) };
    format!("{what}, {unit}")
}

/// Reads a file and compares with it from then on.
fn read_file(ui: Ui, file: File) {
    let name = file.name();
    ui.retract(Topic::Reference);
    ui.send_feature(DeviationEvent::Reading(name.clone()));
    spawn_local(async move {
        match JsFuture::from(file.array_buffer()).await {
            Ok(buffer) => {
                let bytes = js_sys::Uint8Array::new(&buffer).to_vec().into();
                ui.send_feature(DeviationEvent::FileRead { name, bytes });
            }
            Err(error) => {
                web_sys::console::error_1(&error);
                ui.notify(Level::Error, Topic::Reference, t!("deviation.unreadable", name));
                ui.send_feature(DeviationEvent::NoReference);
            }
        }
    });
}
