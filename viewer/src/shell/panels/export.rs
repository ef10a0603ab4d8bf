//! Export of the model: what, how and to which file; how far that is.

use crate::export::{Format, MeshFormat, PointFormat, estimate};
use crate::state::connection::Connection;
use crate::state::export_choice::{Content, Detail, ExportChoice, Solids, UNITS, UP_AXES};
use crate::state::legend::HiddenPoints;
use crate::state::{Event, units};
use crate::ui::icons::{DOWNLOAD, Icon};
use crate::ui::running::Running;
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

/// A choice of some named options.
fn select(
    ui: Ui,
    id: &'static str,
    name: &'static str,
    options: Vec<(&'static str, &'static str)>,
    chosen: fn(ExportChoice) -> &'static str,
    with: fn(ExportChoice, &str) -> ExportChoice,
) -> impl IntoView {
    let choice = ui.part(|s| s.export);
    view! {
        <label class="field-row">
            <span>{name}</span>
            <select
                data-testid=id
                on:change=move |e| ui.send(Event::ExportChoice(with(choice.get_untracked(), &event_target_value(&e))))
            >
                {options.into_iter().map(|(key, label)| view! {
                    <option value=key prop:selected=move || chosen(choice.get()) == key>{label}</option>
                }).collect_view()}
            </select>
        </label>
    }
}

/// What of the model the files hold.
#[component]
fn ContentChoice(ui: Ui) -> impl IntoView {
    let contents = Content::ALL.into_iter().map(|content| (content.key(), content.label())).collect();
    select(
        ui,
        "export-content",
        t!("export.content"),
        contents,
        |c| c.content.key(),
        |c, key| ExportChoice {
            content: Content::ALL.into_iter().find(|content| content.key() == key).unwrap_or_default(),
            ..c
        },
    )
}

/// How the files of meshes are written.
#[component]
fn MeshChoice(ui: Ui) -> impl IntoView {
    let choice = ui.part(|s| s.export);
    let units = UNITS.into_iter().map(|unit| (unit.name(), units::unit_name(unit))).collect();
    let axes = UP_AXES.into_iter().map(|(_, name)| (name, name)).collect();
    let details = Detail::ALL.into_iter().map(|detail| (detail.key(), detail.label())).collect();
    let solids = Solids::ALL.into_iter().map(|solids| (solids.key(), solids.label())).collect();
    view! {
        <details class="export-choice" data-testid="export-choice">
            <summary>{move || files(choice.get())}</summary>
            {select(ui, "export-detail", t!("export.triangles"), details, |c| c.detail.key(), |c, key| ExportChoice {
                detail: Detail::ALL.into_iter().find(|detail| detail.key() == key).unwrap_or_default(),
                ..c
            })}
            {select(ui, "export-unit", t!("export.unit"), units, |c| c.frame.unit.name(), |c, key| ExportChoice {
                frame: FileFrame { unit: LengthUnit::parse(key).unwrap_or(c.frame.unit), ..c.frame },
                ..c
            })}
            {select(ui, "export-up", t!("export.up"), axes, up_name, |c, key| ExportChoice {
                frame: FileFrame {
                    up: UP_AXES.into_iter().find(|(_, name)| *name == key).map_or(c.frame.up, |(up, _)| up),
                    ..c.frame
                },
                ..c
            })}
            {select(ui, "export-solids", t!("export.stl"), solids, |c| c.solids.key(), |c, key| ExportChoice {
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

/// The button of a format, with the size that the file will have.
#[component]
fn FormatButton(ui: Ui, format: Format, id: &'static str, name: &'static str, about: &'static str) -> impl IntoView {
    let is_off = ui.part(|s| {
        let none = match s.export.content {
            Content::All => s.legend.held_points() == 0,
            Content::Shown | Content::Kept => s.legend.visible_points() == 0,
        };
        none || s.exporting.is_some()
    });
    let size = ui.part(move |s| estimate(s, format).unwrap_or(0));
    let words = move || match size.get() {
        0 => about.to_owned(),
        bytes => t!("export.about", what = about, size = units::bytes(bytes)),
    };
    view! {
        <button
            class="button" type="button" data-testid=id title=about prop:disabled=move || is_off.get()
            data-bytes=move || size.get().to_string()
            on:click=move |_| ui.ask(Command::Export(format))
        >
            <Icon path=DOWNLOAD/>
            <span>{name} <small>{words}</small></span>
        </button>
    }
}

/// A button for each format, and what they write.
#[component]
pub(super) fn ExportPanel(ui: Ui) -> impl IntoView {
    let points = ui.part(|s| s.legend.visible_points());
    let held = ui.part(|s| s.legend.held_points());
    let surface = ui.part(|s| s.legend.surface_points());
    let hidden = ui.part(|s| s.legend.hidden_points(s.display.hidden_flags()));
    let content = ui.part(|s| s.export.content);
    let what = move || match (points.get(), held.get()) {
        (_, 0) => t!("export.none").to_owned(),
        (_, held) if content.get() == Content::All => t!("export.all", held = units::count(held)),
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
        _ if content.get() == Content::All => String::new(),
        0 => String::new(),
        n => t!("export.mesh_without", count = units::count(n)),
    };
    let is_cut = ui.part(|s| s.display.cut.is_on() && s.export.content != Content::Kept);
    let triangles = ui.part(|s| s.features.mesh.triangles);
    let points_as =
        move |format, id, name, about| view! { <FormatButton ui format=Format::Points(format) id name about/> };
    let mesh_as = move |format, id, name, about| view! { <FormatButton ui format=Format::Mesh(format) id name about/> };
    let step = ui.part(|s| s.exporting.unwrap_or_default().step.label());
    let done = ui.part(|s| s.exporting.map(|now| ((100.0 * now.share) as u32, 100)));
    let on_cancel = UnsyncCallback::new(move |()| ui.ask(Command::CancelExport));
    view! {
        <section class="panel" aria-labelledby="export-title">
            <header class="panel-head">
                <h2 id="export-title">{t!("export.panel")}</h2>
                <span class="panel-note">{move || t!("count.points", count = units::count(points.get()))}</span>
            </header>
            <ContentChoice ui/>
            <div class="buttons">
                {points_as(PointFormat::Ply, "export-ply", "PLY", t!("export.cloud"))}
                {points_as(PointFormat::Glb, "export-glb", "GLB", t!("export.scene"))}
            </div>
            <Show when=move || { triangles.get() > 0 }>
                <div class="buttons">
                    {mesh_as(MeshFormat::Ply, "export-mesh-ply", "PLY", t!("export.mesh"))}
                    {mesh_as(MeshFormat::Glb, "export-mesh-glb", "GLB", t!("export.mesh"))}
                    {mesh_as(MeshFormat::Obj, "export-mesh-obj", "OBJ", t!("export.materials"))}
                    {mesh_as(MeshFormat::Stl, "export-mesh-stl", "STL", t!("export.shape"))}
                </div>
                <MeshChoice ui/>
            </Show>
            <Running name=step done meter="export-progress" cancel="export-cancel" on_cancel/>
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
