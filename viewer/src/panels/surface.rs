//! The surface: points or mesh, the meshing, and the comparison with a reference.

use super::{Command, Ui};
use crate::app::surface::{Meshing, Reference, SurfaceEvent};
use crate::app::{Event, units};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

/// Files that a reference is read from.
const ACCEPT: &str = ".ply,.obj,.stl,.glb";

/// The panel.
#[component]
pub(super) fn SurfacePanel(ui: Ui) -> impl IntoView {
    let surface = ui.part(|s| s.surface.clone());
    let has_model = ui.part(|s| s.has_model());
    let tell = move |event| ui.send.run(Event::Surface(event));
    let state = move || {
        surface.with(|s| match s.meshing {
            Meshing::None => "none",
            Meshing::Running { .. } => "running",
            Meshing::Ready => "ready",
        })
    };
    let note = move || {
        surface.with(|s| match s.meshing {
            _ if s.triangles > 0 => format!("{} triangles", units::count(s.triangles)),
            _ => String::new(),
        })
    };
    let choose = move |mesh: bool| {
        tell(SurfaceEvent::Show(mesh));
        if mesh && surface.with_untracked(|s| s.wants_mesh()) {
            ui.ask.run(Command::Mesh);
        }
    };
    let choice = move |mesh: bool, id: &'static str, name: &'static str| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="shape" value=id data-testid=id
                    prop:checked=move || surface.with(|s| s.shown) == mesh prop:disabled=move || mesh && !has_model.get()
                    on:change=move |_| choose(mesh)
                />
                <span>{name}</span>
            </label>
        }
    };
    view! {
        <section
            class="panel" aria-labelledby="surface-title" data-testid="mesh" data-state=state
            data-triangles=move || surface.with(|s| s.triangles.to_string())
            data-outdated=move || surface.with(|s| s.outdated.to_string())
        >
            <header class="panel-head">
                <h2 id="surface-title">"Surface"</h2>
                <span class="panel-note">{note}</span>
            </header>
            <fieldset class="switch-row">
                <legend class="visually-hidden">"Show the model as"</legend>
                <span aria-hidden="true">"Show as"</span>
                <div class="segments">
                    {choice(false, "show-points", "Points")}
                    {choice(true, "show-mesh", "Mesh")}
                </div>
            </fieldset>
            <MeshingRow ui/>
            <ReferenceRow ui/>
        </section>
    }
}

/// Progress with its cancel button, or the way to an up-to-date mesh.
#[component]
fn MeshingRow(ui: Ui) -> impl IntoView {
    let running = ui.part(|s| match s.surface.meshing {
        Meshing::Running { done, total } => Some((done, total.max(1))),
        _ => None,
    });
    let outdated = ui.part(|s| s.surface.outdated && !s.surface.is_running());
    let share = move || running.get().map_or(0, |(done, total)| done * 100 / total);
    view! {
        <Show when=move || running.get().is_some()>
            <div class="switch-row">
                <progress
                    class="meter" data-testid="mesh-progress" aria-label="Meshing" max="100"
                    prop:value=share
                ></progress>
                <button
                    class="text-button" type="button" data-testid="mesh-cancel"
                    on:click=move |_| ui.ask.run(Command::CancelMesh)
                >
                    "Cancel"
                </button>
            </div>
        </Show>
        <Show when=move || outdated.get()>
            <div class="switch-row">
                <span>"The model has changed" <small>"since this mesh was made"</small></span>
                <button
                    class="text-button" type="button" data-testid="mesh-update"
                    on:click=move |_| ui.ask.run(Command::Mesh)
                >
                    "Update"
                </button>
            </div>
        </Show>
    }
}

/// What the mesh is compared with, and how far it deviates.
#[component]
fn ReferenceRow(ui: Ui) -> impl IntoView {
    let reference = ui.part(|s| s.surface.reference.clone());
    let reading = ui.part(|s| s.surface.reading.clone());
    let deviation = ui.part(|s| s.surface.deviation);
    let tolerance = ui.part(|s| s.surface.tolerance);
    let has_model = ui.part(|s| s.has_model());
    let take = move |event: web_sys::Event| {
        let Some(input) = event.target().and_then(|t| t.dyn_into::<HtmlInputElement>().ok()) else { return };
        if let Some(file) = input.files().and_then(|files| files.get(0)) {
            ui.ask.run(Command::Compare(file));
        }
        // The same file may be chosen again.
        input.set_value("");
    };
    let set_tolerance = move |event: web_sys::Event| {
        let millimetres: f64 = event_target_value(&event).parse().unwrap_or(f64::NAN);
        ui.send.run(Event::Surface(SurfaceEvent::Tolerance(millimetres * 1e-3)));
    };
    let about = |r: &Reference| {
        let what = if r.triangles > 0 { (r.triangles, "triangles") } else { (r.points, "points") };
        let unit = if r.millimetres { ", in millimetres" } else { "" };
        format!("{} {}{unit}", units::count(what.0.into()), what.1)
    };
    let figure = move |of: fn(&crate::surface::Deviation) -> f32| {
        move || deviation.get().map_or_else(|| "–".to_owned(), |d| format!("{:.3} mm", f64::from(of(&d)) * 1e3))
    };
    let signed = move |of: fn(&crate::surface::Deviation) -> f32| {
        // Minus is a sign, not a hyphen.
        let text = move |d| format!("{:+.3} mm", f64::from(of(&d)) * 1e3).replace('-', "\u{2212}");
        move || deviation.get().map_or_else(|| "–".to_owned(), text)
    };
    let data = move |of: fn(&crate::surface::Deviation) -> f32| {
        move || deviation.get().map(|d| format!("{:.4}", f64::from(of(&d)) * 1e3))
    };
    view! {
        <div class="switch-row">
            <span>
                {move || match (reading.get(), reference.get()) {
                    (Some(name), _) => view! { {format!("Reading {name}")} <small>""</small> }.into_any(),
                    (None, Some(r)) => {
                        let text = about(&r);
                        view! { <span data-testid="reference">{r.name}</span> <small>{text}</small> }.into_any()
                    }
                    (None, None) => view! { "Compare" <small>"with a mesh or cloud in the table frame"</small> }.into_any(),
                }}
            </span>
            <span class="row-actions">
                <Show when=move || reference.get().is_some()>
                    <button
                        class="text-button" type="button" data-testid="reference-forget"
                        on:click=move |_| ui.ask.run(Command::Forget)
                    >
                        "Remove"
                    </button>
                </Show>
                <label class="text-button file-button" class:is-disabled=move || !has_model.get()>
                    <input
                        class="visually-hidden" type="file" accept=ACCEPT data-testid="reference-file"
                        prop:disabled=move || !has_model.get() on:change=take
                    />
                    {move || if reference.get().is_some() { "Change" } else { "Load" }}
                </label>
            </span>
        </div>
        <Show when=move || reference.get().is_some()>
            <label class="switch-row">
                <span>"Tolerance" <small>"plus and minus, millimetres"</small></span>
                <input
                    class="number" type="number" min="0.001" max="100" step="0.05" data-testid="tolerance"
                    prop:value=move || format!("{}", (tolerance.get() * 1e6).round() / 1e3) on:change=set_tolerance
                />
            </label>
            <dl
                class="figures is-signed" data-testid="deviation" data-mean-mm=data(|d| d.mean) data-rms-mm=data(|d| d.rms)
                data-p95-mm=data(|d| d.p95)
            >
                <div><dt>"Mean"</dt><dd>{signed(|d| d.mean)}</dd></div>
                <div><dt>"RMS"</dt><dd>{figure(|d| d.rms)}</dd></div>
                <div><dt>"95 %"</dt><dd>{figure(|d| d.p95)}</dd></div>
                <div><dt>"Least"</dt><dd>{signed(|d| d.range[0])}</dd></div>
                <div><dt>"Most"</dt><dd>{signed(|d| d.range[1])}</dd></div>
            </dl>
        </Show>
    }
}
