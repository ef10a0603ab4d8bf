//! The panel of the mesh: points or mesh, and the progress of the meshing.

use super::controller::MeshController;
use super::{Mesh, MeshEvent, Meshing};
use crate::display::Representation;
use crate::features::view::{Controller, FeatureView, Host};
use crate::state::units;
use crate::ui::Ui;
use crate::ui::running::Running;
use crate::words::t;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Mesh {
    fn panel(ui: Ui) -> AnyView {
        view! { <MeshPanel ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(MeshController::new(host))
    }
}

#[component]
fn MeshPanel(ui: Ui) -> impl IntoView {
    let mesh = ui.part(|s| s.features.mesh.clone());
    let note = move || match mesh.with(|m| m.triangles) {
        0 => String::new(),
        triangles => t!("count.triangles", count = units::count(triangles)),
    };
    view! {
        <section
            class="panel" aria-labelledby="surface-title" data-testid="mesh"
            data-state=move || mesh.with(|m| match m.meshing {
                Meshing::None => "none",
                Meshing::Running { .. } => "running",
                Meshing::Ready => "ready",
            })
            data-triangles=move || mesh.with(|m| m.triangles.to_string())
            data-outdated=move || mesh.with(|m| m.outdated.to_string())
        >
            <header class="panel-head">
                <h2 id="surface-title">{t!("mesh.panel")}</h2>
                <span class="panel-note">{note}</span>
            </header>
            <fieldset class="switch-row">
                <legend class="visually-hidden">{t!("mesh.show_as.legend")}</legend>
                <span aria-hidden="true">{t!("mesh.show_as")}</span>
                <div class="segments">
                    <Choice ui representation=Representation::Points id="show-points" name=t!("common.points")/>
                    <Choice ui representation=Representation::Mesh id="show-mesh" name=t!("common.mesh")/>
                </div>
            </fieldset>
            <MeshingRow ui/>
        </section>
    }
}

/// One of the ways to draw the model; the mesh is made if it is not there.
#[component]
fn Choice(ui: Ui, representation: Representation, id: &'static str, name: &'static str) -> impl IntoView {
    let shown = ui.part(|s| s.display.representation);
    let has_model = ui.part(|s| s.has_model());
    let choose = move |_| show_as(ui, representation);
    view! {
        <label class="segment">
            <input
                type="radio" name="shape" value=id data-testid=id
                prop:checked=move || shown.get() == representation
                prop:disabled=move || representation == Representation::Mesh && !has_model.get()
                on:change=choose
            />
            <span>{name}</span>
        </label>
    }
}

/// Shows the model as points or as a mesh, which is made where there is none of the model as it is.
pub(crate) fn show_as(ui: Ui, representation: Representation) {
    ui.send_feature(MeshEvent::Show(representation));
    if representation == Representation::Mesh && ui.read(|s| s.features.mesh.is_wanted()) {
        ui.send_feature(MeshEvent::Requested);
    }
}

/// Progress with its cancel button, or the way to an up-to-date mesh.
#[component]
fn MeshingRow(ui: Ui) -> impl IntoView {
    let running = ui.part(|s| match s.features.mesh.meshing {
        Meshing::Running { done, total } => Some((done, total.max(1))),
        _ => None,
    });
    let name = Memo::new(|_| t!("mesh.meshing"));
    let on_cancel = UnsyncCallback::new(move |()| ui.send_feature(MeshEvent::CancelRequested));
    let outdated = ui.part(|s| s.features.mesh.outdated && !s.features.mesh.is_running());
    view! {
        <Running name done=running meter="mesh-progress" cancel="mesh-cancel" on_cancel/>
        <Show when=move || outdated.get()>
            <div class="switch-row">
                <span>{t!("mesh.outdated")} <small>{t!("mesh.outdated.since")}</small></span>
                <button
                    class="text-button" type="button" data-testid="mesh-update"
                    on:click=move |_| ui.send_feature(MeshEvent::Requested)
                >
                    {t!("mesh.update")}
                </button>
            </div>
        </Show>
    }
}
