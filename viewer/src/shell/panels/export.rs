//! Export of what is visible of the model.

use crate::scene::export::{MeshFormat, PointFormat};
use crate::state::connection::Connection;
use crate::state::export_choice::{Detail, ExportChoice, Solids, UNITS, UP_AXES};
use crate::state::legend::HiddenPoints;
use crate::state::{Event, units};
use crate::ui::icons::{DOWNLOAD, Icon};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use semascan_formats::FileFrame;
use semascan_model::LengthUnit;
use semascan_protocol::{FILE_ENDING, Phase};

/// Why points are hidden, and how many for each reason, with the switch that shows them.
fn reasons(hidden: HiddenPoints) -> String {
    let reasons = [
        (hidden.components, t!("export.hidden.components")),
        (hidden.stray, t!("export.hidden.stray")),
        (hidden.background, t!("export.hidden.background")),
    ];
    let said = reasons.into_iter().filter(|(n, _)| *n > 0).map(|(n, why)| format!(" {} {why}", units::count(n)));
    said.collect::<Vec<_>>().join(",")
}

/// The inspection as one file, which this page opens without an agent.
#[component]
fn WholeInspection(ui: Ui) -> impl IntoView {
    let address = ui.part(|s| {
        let keeps = s.account.as_ref().is_some_and(|account| account.keeps);
        let is_over = matches!(s.progress.phase, Phase::Finished | Phase::Failed);
        let is_agents = !matches!(s.connection, Connection::File { .. });
        let id = &s.inspection.id;
        (keeps && is_over && is_agents && !id.is_empty())
            .then(|| format!("/api/v1/inspections/{id}/inspection.{FILE_ENDING}"))
    });
    let link = move |query: &'static str, id: &'static str, about: &'static str| {
        view! {
            <a
                class="button" data-testid=id download=""
                title=t!("export.inspection.title")
                href=move || address.get().map(|address| address + query)
            >
                <Icon path=DOWNLOAD/>
                <span>{t!("export.inspection")} <small>{about}</small></span>
            </a>
        }
    };
    view! {
        <Show when=move || address.get().is_some()>
            <div class="buttons">
                {link("?photographs=true", "export-inspection-full", t!("export.inspection.full"))}
                {link("", "export-inspection", t!("export.inspection.small"))}
            </div>
        </Show>
    }
}

/// How the files of meshes are written.
#[component]
fn MeshChoice(ui: Ui) -> impl IntoView {
    let choice = ui.part(|s| s.export);
    let select = move |id: &'static str,
                       name: &'static str,
                       options: Vec<(&'static str, &'static str)>,
                       chosen: fn(ExportChoice) -> &'static str,
                       with: fn(ExportChoice, &str) -> ExportChoice| {
        view! {
            <label class="switch-row">
                <span>{name}</span>
                <select
                    class="number" data-testid=id
                    on:change=move |e| ui.send(Event::ExportChoice(with(choice.get_untracked(), &event_target_value(&e))))
                >
                    {options.into_iter().map(|(key, label)| view! {
                        <option value=key prop:selected=move || chosen(choice.get()) == key>{label}</option>
                    }).collect_view()}
                </select>
            </label>
        }
    };
    let units = UNITS.into_iter().map(|unit| (unit.name(), units::unit_name(unit))).collect();
    let axes = UP_AXES.into_iter().map(|(_, name)| (name, name)).collect();
    let details = Detail::ALL.into_iter().map(|detail| (detail.key(), detail.label())).collect();
    let solids = Solids::ALL.into_iter().map(|solids| (solids.key(), solids.label())).collect();
    view! {
        <details class="export-choice" data-testid="export-choice">
            <summary>{move || files(choice.get())}</summary>
            {select("export-detail", t!("export.triangles"), details, |c| c.detail.key(), |c, key| ExportChoice {
                detail: Detail::ALL.into_iter().find(|detail| detail.key() == key).unwrap_or_default(),
                ..c
            })}
            {select("export-unit", t!("export.unit"), units, |c| c.frame.unit.name(), |c, key| ExportChoice {
                frame: FileFrame { unit: LengthUnit::parse(key).unwrap_or(c.frame.unit), ..c.frame },
                ..c
            })}
            {select("export-up", t!("export.up"), axes, up_name, |c, key| ExportChoice {
                frame: FileFrame {
                    up: UP_AXES.into_iter().find(|(_, name)| *name == key).map_or(c.frame.up, |(up, _)| up),
                    ..c.frame
                },
                ..c
            })}
            {select("export-solids", t!("export.stl"), solids, |c| c.solids.key(), |c, key| ExportChoice {
                solids: Solids::ALL.into_iter().find(|solids| solids.key() == key).unwrap_or_default(),
                ..c
            })}
        </details>
    }
}

fn files(choice: ExportChoice) -> String {
    let unit = units::unit_name(choice.frame.unit);
    t!("export.files", detail = choice.detail.label(), unit, axis = up_name(choice))
}

fn up_name(choice: ExportChoice) -> &'static str {
    UP_AXES.into_iter().find(|(up, _)| *up == choice.frame.up).map_or("", |(_, name)| name)
}

/// One button a format.
#[component]
pub(super) fn ExportPanel(ui: Ui) -> impl IntoView {
    let points = ui.part(|s| s.legend.visible_points());
    let held = ui.part(|s| s.legend.held_points());
    let surface = ui.part(|s| s.legend.surface_points());
    let hidden = ui.part(|s| s.legend.hidden_points(s.display.hidden_flags()));
    let what = move || match (points.get(), held.get()) {
        (_, 0) => t!("export.none").to_owned(),
        (0, held) => {
            t!("export.all_hidden", held = units::count(held), reasons = reasons(hidden.get()))
        }
        (points, held) if points == held => {
            t!("export.all", held = units::count(held))
        }
        (points, held) => {
            let (points, held) = (units::count(points), units::count(held));
            t!("export.shown", points, held, reasons = reasons(hidden.get()))
        }
    };
    let mesh_left_out = move || match points.get().saturating_sub(surface.get()) {
        0 => String::new(),
        n => t!("export.mesh_without", count = units::count(n)),
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
    let is_cut = ui.part(|s| s.display.cut.is_on());
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
                <h2 id="export-title">{t!("export.panel")}</h2>
                <span class="panel-note">{move || t!("count.points", count = units::count(points.get()))}</span>
            </header>
            <div class="buttons">
                {button(PointFormat::Ply, "export-ply", "PLY", t!("export.cloud"))}
                {button(PointFormat::Glb, "export-glb", "GLB", t!("export.scene"))}
            </div>
            <Show when=move || { triangles.get() > 0 }>
                <div class="buttons">
                    {mesh_button(MeshFormat::Ply, "export-mesh-ply", "PLY", t!("export.mesh"))}
                    {mesh_button(MeshFormat::Glb, "export-mesh-glb", "GLB", t!("export.mesh"))}
                    {mesh_button(MeshFormat::Obj, "export-mesh-obj", "OBJ", t!("export.materials"))}
                    {mesh_button(MeshFormat::Stl, "export-mesh-stl", "STL", t!("export.shape"))}
                </div>
                <MeshChoice ui/>
            </Show>
            <WholeInspection ui/>
            <p
                class="empty" data-testid="export-note"
                data-points=move || points.get().to_string() data-held=move || held.get().to_string()
            >
                {what}
                {move || if triangles.get() > 0 { mesh_left_out() } else { String::new() }}
                {move || is_cut.get().then_some(t!("export.cut"))}
            </p>
        </section>
    }
}
