//! The component legend: colour, visibility, points, area and confidence by class.

use crate::display::css_color;
use crate::state::legend::{ClassFigures, Row};
use crate::state::{Event, units};
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;

/// The component classes as a table.
#[component]
pub(super) fn LegendPanel(ui: Ui) -> impl IntoView {
    let classes = ui.part(|s| s.legend.listed().map(|r| r.class.clone()).collect::<Vec<_>>());
    let all = ui.part(|s| s.legend.all_visible());
    view! {
        <section class="panel" aria-labelledby="legend-title">
            <header class="panel-head">
                <h2 id="legend-title">{t!("legend.panel")}</h2>
                <button
                    class="text-button" type="button" data-testid="legend-all" title=t!("legend.show_all.title")
                    prop:disabled=move || all.get() on:click=move |_| ui.send(Event::AllComponents)
                >
                    {t!("legend.show_all")}
                </button>
            </header>
            <Show
                when=move || classes.with(|c| c.len() > 1)
                fallback=|| view! { <p class="empty">{t!("legend.empty")}</p> }
            >
                <table class="legend">
                    <thead>
                        <tr>
                            <th scope="col">{t!("common.component")}</th>
                            <th scope="col" class="is-figure"><abbr title=t!("legend.points")>{t!("common.points")}</abbr></th>
                            <th scope="col" class="is-figure"><abbr title=t!("legend.area")>{t!("common.area")}</abbr></th>
                            <th scope="col" class="is-figure"><abbr title=t!("legend.confidence")>{t!("legend.confidence.short")}</abbr></th>
                        </tr>
                    </thead>
                    <tbody>
                        <For each=move || classes.get() key=|c| (c.id, c.name.clone(), c.color) let:class>
                            <LegendRow ui class=class.id/>
                        </For>
                    </tbody>
                </table>
            </Show>
        </section>
    }
}

/// One class.
#[component]
fn LegendRow(ui: Ui, class: u16) -> impl IntoView {
    let row = ui.part(move |s| s.legend.rows.get(usize::from(class)).cloned());
    let figures = ui.part(move |s| s.class_figures(class));
    let of = move |read: fn(&Row) -> String| row.with(|r| r.as_ref().map(read).unwrap_or_default());
    let name = move || of(display_name);
    let visible = move || row.with(|r| r.as_ref().is_some_and(|r| r.visible));
    let empty = move || figures.get().points == 0 && row.with(|r| r.as_ref().is_none_or(|r| r.count.shown == 0));
    view! {
        <tr
            class="legend-row" data-testid=format!("legend-row-{class}")
            data-class-name=move || of(|r| r.class.name.clone())
            data-points=move || figures.get().points.to_string()
            data-area-mm2=move || figures.get().area.map(|area| format!("{:.1}", area * 1e6))
            data-shown=move || of(|r| r.count.shown.to_string())
            data-confidence=move || format!("{:.3}", figures.get().confidence)
            class:is-hidden=move || !visible() class:is-empty=empty
        >
            <th scope="row">
                <label class="legend-name">
                    <input
                        class="swatch" type="checkbox" data-testid=format!("legend-visible-{class}")
                        style:--swatch=move || of(|r| css_color(r.class.color))
                        prop:checked=visible on:change=move |_| ui.send(Event::ToggleComponent(class))
                    />
                    <span title=name>{name}</span>
                </label>
                <button
                    class="text-button legend-only" type="button" data-testid=format!("legend-only-{class}")
                    aria-label=move || t!("legend.only_class", name = name())
                    on:click=move |_| ui.send(Event::OnlyComponent(class))
                >
                    {t!("legend.only")}
                </button>
            </th>
            <td class="is-figure">{move || units::count(figures.get().points)}</td>
            <td class="is-figure" title=move || figures.get().area.is_none().then_some(t!("legend.not_measured"))>
                {move || known(&figures.get(), |f| f.area.map_or_else(unknown, units::area))}
            </td>
            <td class="is-figure">
                {move || match figures.get() {
                    // A class that was judged has a share: files of others say a class and no share.
                    f if class == 0 || f.confidence == 0.0 => unknown(),
                    f => known(&f, |f| units::percent(f.confidence)),
                }}
            </td>
        </tr>
    }
}

/// Class 0 carries every point without evidence for a component.
fn display_name(row: &Row) -> String {
    if row.class.id == 0 { t!("common.unlabelled").into() } else { row.class.name.clone() }
}

/// A figure that has a meaning only where there are points.
fn known(figures: &ClassFigures, figure: impl FnOnce(&ClassFigures) -> String) -> String {
    if figures.points == 0 { unknown() } else { figure(figures) }
}

fn unknown() -> String {
    "–".into()
}
