//! The card of the picked point, and the labels at their points. What is `anchored` is put to its place in the table frame
//! by `shell/anchors.rs` with every frame.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{InspectEvent, PickedPoint, words};
use crate::display::css_color;
use crate::state::AppState;
use crate::ui::icons::{CLOSE, Icon, PIN};
use crate::ui::{Ui, anchor_place};
use crate::words::t;
use leptos::prelude::*;

/// Everything that the tool lays over the 3D view.
#[component]
pub(super) fn InspectOverlay(ui: Ui) -> impl IntoView {
    let spoken = ui.part(|s| {
        let inspect = &s.features.inspect;
        match &inspect.picked {
            Some(point) => words::sentence(s, point),
            None if inspect.missed => t!("inspect.missed").to_owned(),
            None => String::new(),
        }
    });
    view! {
        <div class="crosshair" aria-hidden="true"></div>
        <div class="anchors" data-testid="anchors">
            <Labels ui/>
            <Marker ui/>
        </div>
        <Card ui/>
        <p class="visually-hidden" role="status" data-testid="inspect-status">{move || spoken.get()}</p>
    }
}

/// The labels.
#[component]
fn Labels(ui: Ui) -> impl IntoView {
    let labels = ui.part(|s| {
        let is_shown = |point: &PickedPoint| s.legend.visible(point.component) && s.display.cut.keeps(point.position);
        let shown = s.features.inspect.labels.iter().filter(|label| is_shown(&label.point));
        shown.copied().collect::<Vec<_>>()
    });
    view! {
        <For each=move || labels.get() key=|label| (label.number, label.outdated) let:label>
            <div
                class="pin anchored" class:is-outdated=label.outdated data-testid=format!("label-{}", label.number)
                data-place=anchor_place(label.point.position) data-anchor=format!("label-{}", label.number)
            >
                <div class="pin-text is-raised">
                    <span class="entry-number">{label.number}</span>
                    <span class="pin-name">{move || ui.follow(|s| words::component(s, &label.point))}</span>
                    <small>{move || ui.follow(|s| note(s, &label.point))}</small>
                </div>
            </div>
        </For>
    }
}

/// The defect, or else the confidence.
fn note(state: &AppState, point: &PickedPoint) -> String {
    words::defect(state, point).unwrap_or_else(|| words::confidence(point))
}

/// A ring at the point of the card, and a ring with a name where the mouse rests.
#[component]
fn Marker(ui: Ui) -> impl IntoView {
    let picked = ui.part(|s| s.features.inspect.picked);
    let hovered = ui.part(|s| {
        s.features.inspect.hovered.map(|point| (point.position, words::component(s, &point), note(s, &point)))
    });
    view! {
        {move || picked.get().map(|point| view! {
            <div class="ring anchored" data-testid="picked-ring" data-place=anchor_place(point.position)></div>
        })}
        {move || hovered.get().map(|(position, name, note)| view! {
            <div class="ring is-soft anchored" data-testid="hover" data-place=anchor_place(position)>
                <div class="pin-text is-raised"><span class="pin-name">{name}</span> <small>{note}</small></div>
            </div>
        })}
    }
}

/// The card.
#[component]
fn Card(ui: Ui) -> impl IntoView {
    let picked = ui.part(|s| s.features.inspect.picked);
    move || picked.get().map(|point| view! { <CardOf ui point/> })
}

#[component]
fn CardOf(ui: Ui, point: PickedPoint) -> impl IntoView {
    let name = ui.part(move |s| words::component(s, &point));
    let color = ui.part(move |s| {
        s.legend.rows.get(usize::from(point.component)).map(|row| css_color(row.class.color)).unwrap_or_default()
    });
    let defect = ui.part(move |s| words::defect_or_none(s, &point));
    let can_pin = ui.part(|s| s.features.inspect.can_pin());
    let outdated = ui.part(|s| s.features.inspect.outdated);
    let [x, y, z] = point.position;
    let instance = match point.instance {
        0 => t!("inspect.no_instance").to_owned(),
        number => number.to_string(),
    };
    let surface = if point.on_mesh { "mesh" } else { "points" };
    let row = |name: &'static str, value: AnyView| view! { <div><dt>{name}</dt><dd>{value}</dd></div> };
    view! {
        <section
            class="card is-raised" aria-label=t!("inspect.card") data-testid="inspect-card" data-component=point.component
            data-x-mm=format!("{:.4}", f64::from(x) * 1e3) data-y-mm=format!("{:.4}", f64::from(y) * 1e3)
            data-z-mm=format!("{:.4}", f64::from(z) * 1e3) data-surface=surface
        >
            <header class="card-head">
                <span class="scale-dot" style:background-color=move || color.get()></span>
                <h2 title=move || name.get()>{move || name.get()}</h2>
                <button
                    class="tool" type="button" data-testid="inspect-pin" aria-label=t!("inspect.pin") title=t!("inspect.pin.title")
                    prop:disabled=move || !can_pin.get() on:click=move |_| ui.send_feature(InspectEvent::Pin)
                >
                    <Icon path=PIN/>
                </button>
                <button
                    class="tool" type="button" data-testid="inspect-close" aria-label=t!("common.close") title=t!("common.close_esc")
                    on:click=move |_| ui.send_feature(InspectEvent::Close)
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            <dl class="card-figures">
                {row(t!("common.confidence"), words::confidence(&point).into_any())}
                {row(t!("common.sigma"), words::sigma(&point).into_any())}
                {row(t!("common.defect"), (move || defect.get()).into_any())}
                {row(t!("inspect.views"), point.views.to_string().into_any())}
                {row(t!("inspect.instance"), instance.into_any())}
                {point.deviation.map(|metres| row(t!("common.deviation"), words::deviation(metres).into_any()))}
            </dl>
            <dl class="card-place" aria-label=t!("inspect.place")>
                {["x", "y", "z"].into_iter().zip(point.position).map(|(axis, metres)| view! {
                    <div><dt>{axis}</dt><dd>{words::millimetres(metres)}</dd></div>
                }).collect_view()}
                <div class="card-unit"><dt class="visually-hidden">{t!("inspect.unit")}</dt><dd>{t!("inspect.frame")}</dd></div>
            </dl>
            {point.mark().map(|mark| view! { <p class="card-note">{t!("inspect.mark", mark)}</p> })}
            <Show when=move || outdated.get()>
                <p class="card-note">{t!("inspect.outdated")}</p>
            </Show>
        </section>
    }
}
