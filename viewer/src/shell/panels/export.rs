//! Export of what is visible of the model.

use crate::scene::export::{MeshFormat, PointFormat};
use crate::state::units;
use crate::ui::icons::{DOWNLOAD, Icon};
use crate::ui::{Command, Ui};
use leptos::prelude::*;

/// One button a format.
#[component]
pub(super) fn ExportPanel(ui: Ui) -> impl IntoView {
    let points = ui.part(|s| s.legend.visible_points());
    let held = ui.part(|s| s.legend.held_points());
    let surface = ui.part(|s| s.legend.surface_points());
    let shown = ui.part(|s| {
        let present = || s.legend.rows.iter().filter(|r| r.count.held > 0);
        (present().filter(|r| r.visible).count(), present().count())
    });
    let what = move || match (points.get(), shown.get()) {
        (0, (_, 0)) => "There are no points yet.".to_owned(),
        (0, _) => "All that is there is hidden.".to_owned(),
        (_, (n, all)) if n == all => "All that is visible, with class names.".to_owned(),
        (_, (n, all)) => format!("Visible components only: {n} of {all}."),
    };
    let left_out = move || match held.get().saturating_sub(points.get()) {
        0 => String::new(),
        n => {
            format!(" {} of the model's {} points are hidden and left out.", units::count(n), units::count(held.get()))
        }
    };
    let mesh_left_out = move || match points.get().saturating_sub(surface.get()) {
        0 => String::new(),
        n => format!(" Meshes are without {} of the points shown: stray ones and background.", units::count(n)),
    };
    let button = move |format: PointFormat, id: &'static str, name: &'static str, about: &'static str| {
        view! {
            <button
                class="button" type="button" data-testid=id prop:disabled=move || points.get() == 0
                title=about on:click=move |_| ui.ask(Command::ExportPoints(format))
            >
                <Icon path=DOWNLOAD/>
                <span>{name} <small>{about}</small></span>
            </button>
        }
    };
    let triangles = ui.part(|s| s.features.mesh.triangles);
    let mesh_button = move |format: MeshFormat, id: &'static str, name: &'static str, about: &'static str| {
        view! {
            <button
                class="button" type="button" data-testid=id title=about
                on:click=move |_| ui.ask(Command::ExportMesh(format))
            >
                <Icon path=DOWNLOAD/>
                <span>{name} <small>{about}</small></span>
            </button>
        }
    };
    view! {
        <section class="panel" aria-labelledby="export-title">
            <header class="panel-head">
                <h2 id="export-title">"Export"</h2>
                <span class="panel-note">{move || format!("{} points", units::count(points.get()))}</span>
            </header>
            <div class="buttons">
                {button(PointFormat::Ply, "export-ply", "PLY", "point cloud")}
                {button(PointFormat::Glb, "export-glb", "GLB", "scene")}
            </div>
            <Show when=move || { triangles.get() > 0 }>
                <div class="buttons">
                    {mesh_button(MeshFormat::Ply, "export-mesh-ply", "PLY", "mesh")}
                    {mesh_button(MeshFormat::Glb, "export-mesh-glb", "GLB", "mesh")}
                    {mesh_button(MeshFormat::Obj, "export-mesh-obj", "OBJ", "with materials, mm")}
                    {mesh_button(MeshFormat::Stl, "export-mesh-stl", "STL", "by component, mm")}
                </div>
            </Show>
            <p
                class="empty" data-testid="export-note"
                data-points=move || points.get().to_string() data-held=move || held.get().to_string()
            >
                {move || what() + &left_out()}
                {move || if triangles.get() > 0 { mesh_left_out() } else { String::new() }}
            </p>
        </section>
    }
}
