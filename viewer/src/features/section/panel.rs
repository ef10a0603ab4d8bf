//! The panel of the section: plane, figures, readings, drawings; and the box.

use super::controller::SectionController;
use super::limits_panel::LimitsRows;
use super::plane_panel::PlaneRows;
use super::{Reading, Section, SectionEvent, overlay, words};
use crate::features::view::{Controller, FeatureView, Host};
use crate::scene::section_export::SectionFormat;
use crate::ui::icons::{CLOSE, DOWNLOAD, Icon};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Section {
    fn panel(ui: Ui) -> AnyView {
        view! { <SectionPanel ui/> }.into_any()
    }

    fn overlay(ui: Ui) -> AnyView {
        view! { <overlay::SectionOverlay ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(SectionController::new(host))
    }
}

#[component]
fn SectionPanel(ui: Ui) -> impl IntoView {
    let is_on = ui.part(|s| s.features.section.is_on);
    let is_active = ui.part(|s| s.features.section.is_active());
    let has_model = ui.part(|s| s.has_model());
    let shown = ui.part(|s| s.features.section.shown.as_ref().map(|shown| (shown.closed, shown.open)));
    view! {
        <section
            class="panel" aria-labelledby="section-title" data-testid="section"
            data-state=move || match (is_on.get(), shown.get()) {
                (false, _) => "off",
                (true, None) => "waiting",
                (true, Some(_)) => "cut",
            }
            data-closed=move || shown.get().map(|(closed, _)| closed.to_string())
            data-open=move || shown.get().map(|(_, open)| open.to_string())
        >
            <header class="panel-head">
                <h2 id="section-title">{t!("section.panel")}</h2>
                <Show when=move || is_active.get()>
                    <button
                        class="text-button" type="button" data-testid="section-reset"
                        on:click=move |_| ui.send_feature(SectionEvent::Reset)
                    >
                        {t!("section.reset")}
                    </button>
                </Show>
            </header>
            <label class="switch-row">
                <span>{t!("section.plane")} <small>{t!("section.plane.what")}</small></span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="section-plane"
                    prop:checked=move || is_on.get() prop:disabled=move || !has_model.get() && !is_on.get()
                    on:change=move |e| ui.send_feature(SectionEvent::Show(event_target_checked(&e)))
                />
            </label>
            <Show when=move || is_on.get()>
                <PlaneRows ui/>
                <Figures ui/>
                <Readings ui/>
            </Show>
            <LimitsRows ui/>
        </section>
    }
}

/// What was cut, in words and figures, and its drawings.
#[component]
fn Figures(ui: Ui) -> impl IntoView {
    let summary = ui.part(|s| words::summary(&s.features.section, &s.features.mesh, !s.legend.all_visible()));
    let figures = ui.part(|s| {
        let unit = s.features.measure.unit;
        let of = |shown: &std::sync::Arc<super::Shown>| (shown.length, shown.area, unit);
        s.features.section.shown.as_ref().filter(|shown| !shown.section.outlines.is_empty()).map(of)
    });
    let save = move |format: SectionFormat, id: &'static str, name: &'static str, about: &'static str| {
        view! {
            <button
                class="button" type="button" data-testid=id title=about
                on:click=move |_| ui.ask(Command::ExportSection(format))
            >
                <Icon path=DOWNLOAD/>
                <span>{name} <small>{about}</small></span>
            </button>
        }
    };
    view! {
        <p class="empty section-summary" role="status" data-testid="section-summary">{move || summary.get()}</p>
        <Show when=move || figures.get().is_some()>
            {move || figures.get().map(|(length, area, unit)| view! {
                <dl
                    class="figures section-figures" data-testid="section-figures"
                    data-length-mm=format!("{:.4}", length * 1e3) data-area-mm2=format!("{:.4}", area * 1e6)
                >
                    <div><dt>{t!("section.length")}</dt><dd>{words::length(length, unit)}</dd></div>
                    <div><dt>{t!("section.area")}</dt><dd>{words::area(area, unit)}</dd></div>
                </dl>
            })}
            <div class="buttons section-files">
                {save(SectionFormat::Svg, "section-svg", "SVG", t!("section.svg"))}
                {save(SectionFormat::Dxf, "section-dxf", "DXF", t!("section.dxf"))}
            </div>
        </Show>
    }
}

/// Thicknesses and distances that are read in the section.
#[component]
fn Readings(ui: Ui) -> impl IntoView {
    let reads = ui.part(|s| s.features.section.is_reading);
    let can_read =
        ui.part(|s| s.features.section.shown.as_ref().is_some_and(|shown| !shown.section.outlines.is_empty()));
    let prompt = ui.part(|s| words::prompt(&s.features.section));
    let list = ui.part(|s| s.features.section.readings.clone());
    view! {
        <div class="switch-row">
            <button
                class="button" type="button" data-testid="section-read" aria-pressed=move || reads.get().to_string()
                prop:disabled=move || !can_read.get()
                on:click=move |_| ui.send_feature(SectionEvent::Read(!reads.get()))
            >
                {t!("section.read")}
            </button>
            <Show when=move || { list.with(Vec::len) > 1 }>
                <button
                    class="text-button" type="button" data-testid="section-remove-all"
                    on:click=move |_| ui.send_feature(SectionEvent::RemoveAll)
                >
                    {t!("common.remove_all")}
                </button>
            </Show>
        </div>
        <p class="empty measure-prompt" role="status" data-testid="section-prompt">{move || prompt.get()}</p>
        <Show when=move || !list.with(Vec::is_empty)>
            <ul class="entries" aria-label=t!("section.readings")>
                <For each=move || list.get() key=|reading| reading.number let:reading>
                    <Entry ui reading/>
                </For>
            </ul>
        </Show>
    }
}

#[component]
fn Entry(ui: Ui, reading: Reading) -> impl IntoView {
    let unit = ui.part(|s| s.features.measure.unit);
    let between = ui.part(move |s| {
        let name = |label: u16| s.legend.rows.get(usize::from(label)).map(|row| row.class.name.clone());
        let [from, to] = reading.ends.map(|end| name(end.label).filter(|_| end.label > 0));
        let [from, to] = [from, to].map(|name| name.unwrap_or_else(|| t!("common.unlabelled").into()));
        if from == to { from } else { format!("{from} – {to}") }
    });
    let estimate = reading.estimate();
    let number = reading.number;
    view! {
        <li
            class="entry" data-testid=format!("section-reading-{number}")
            data-mm=format!("{:.4}", estimate.value * 1e3) data-kind=reading.kind.key()
        >
            <span class="entry-number">{number}</span>
            <span class="entry-text">
                {move || words::reading(&reading, unit.get())}
                <small>{reading.kind.label()} ", " {move || between.get()}</small>
            </span>
            <button
                class="tool" type="button" aria-label=t!("section.remove", number)
                on:click=move |_| ui.send_feature(SectionEvent::Remove(number))
            >
                <Icon path=CLOSE/>
            </button>
        </li>
    }
}
