//! The card that shows a photograph of the picked point, with the pixel marked.

use super::controller::{EvidenceController, full_size};
use super::{Evidence, EvidenceEvent, Sight, path_of};
use crate::camera::CameraInput;
use crate::features::view::{Controller, FeatureView, Host};
use crate::state::{Event, units};
use crate::ui::icons::{CAMERA, CLOSE, Icon, NEXT, PREVIOUS};
use crate::ui::object_url::ObjectUrl;
use crate::ui::{Command, Ui};
use crate::words::{decimal, t};
use leptos::prelude::*;
use std::rc::Rc;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

/// Pixels of the photograph that the magnified card is wide.
const MAGNIFIED_WIDTH: f32 = 120.0;

impl FeatureView for Evidence {
    fn overlay(ui: Ui) -> AnyView {
        view! { <EvidenceOverlay ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(EvidenceController::new(host))
    }
}

/// The card, or the way to it. A view that a person selected has the place before it.
#[component]
fn EvidenceOverlay(ui: Ui) -> impl IntoView {
    let is_there = ui.part(|s| s.features.evidence.point.is_some() && s.views.selected().is_none());
    let is_open = ui.part(|s| s.features.evidence.is_open);
    move || {
        is_there.get().then(|| match is_open.get() {
            true => view! { <Card ui/> }.into_any(),
            false => view! { <Offer ui/> }.into_any(),
        })
    }
}

/// How many photographs there are.
#[component]
fn Offer(ui: Ui) -> impl IntoView {
    let count = ui.part(|s| s.features.evidence.sights.len());
    view! {
        <button
            class="evidence-offer is-raised" type="button" data-testid="evidence-open" title=t!("evidence.show")
            prop:disabled=move || count.get() == 0 on:click=move |_| ui.send_feature(EvidenceEvent::Open(true))
        >
            <Icon path=CAMERA/>
            <span>
                {move || match count.get() {
                    0 => t!("evidence.none_shows").to_owned(),
                    count => t!("evidence.count", count),
                }}
            </span>
        </button>
    }
}

#[component]
fn Card(ui: Ui) -> impl IntoView {
    let place = ui.part(|s| (s.features.evidence.place, s.features.evidence.sights.len()));
    let shown = ui.part(|s| s.features.evidence.shown().copied());
    let step = move |by: i32| move |_| ui.send_feature(EvidenceEvent::Step(by));
    let on_key = move |event: web_sys::KeyboardEvent| {
        let by = match event.key().as_str() {
            "ArrowLeft" => -1,
            "ArrowRight" => 1,
            _ => return,
        };
        // Arrows move the mark of the slider.
        let of_slider =
            event.target().is_some_and(|t| t.dyn_ref::<HtmlInputElement>().is_some_and(|i| i.type_() == "range"));
        if !of_slider {
            event.prevent_default();
            ui.send_feature(EvidenceEvent::Step(by));
        }
    };
    view! {
        <section class="detail" data-testid="evidence" aria-label=t!("evidence.card") on:keydown=on_key>
            <header class="detail-head">
                <h2 aria-live="polite">
                    {move || match place.get() {
                        (_, 0) => t!("evidence.none").to_owned(),
                        (place, count) => t!("evidence.place", number = place + 1, all = count),
                    }}
                </h2>
                <button
                    class="tool" type="button" aria-label=t!("evidence.better") title=t!("evidence.better.title")
                    prop:disabled=move || place.get().1 < 2 on:click=step(-1)
                >
                    <Icon path=PREVIOUS/>
                </button>
                <button
                    class="tool" type="button" aria-label=t!("evidence.next") title=t!("evidence.next.title")
                    prop:disabled=move || place.get().1 < 2 on:click=step(1)
                >
                    <Icon path=NEXT/>
                </button>
                <button
                    class="tool" type="button" aria-label=t!("common.close") title=t!("evidence.close") data-testid="evidence-close"
                    on:click=move |_| ui.send_feature(EvidenceEvent::Open(false))
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            {move || match shown.get() {
                Some(sight) => view! { <Photograph ui sight/> <Use ui sight/> }.into_any(),
                None => view! {
                    <p class="evidence-none">{t!("evidence.unseen")}</p>
                }.into_any(),
            }}
        </section>
    }
}

/// The picture with the pixel marked, and how it was taken.
#[component]
fn Photograph(ui: Ui, sight: Sight) -> impl IntoView {
    let view = sight.view;
    let small = ui.read(|s| s.views.get(view).and_then(|v| ObjectUrl::new(&v.thumbnail_jpeg, "image/jpeg")));
    let small_address = small.as_ref().map(|url| url.address().to_owned());
    let kept = StoredValue::new_local(small);
    on_cleanup(move || kept.dispose());
    let loaded =
        ui.part(move |s| s.features.evidence.loaded.filter(|(loaded, _)| *loaded == view).map(|(_, full)| full));
    let missing = ui.part(move |s| s.features.evidence.missing == Some(view));
    let is_magnified = ui.part(|s| s.features.evidence.is_magnified);
    let full_address = ui.read(|s| full_size(s, view));
    let address = move || match loaded.get() {
        Some(true) => full_address.clone().or_else(|| small_address.clone()),
        _ => small_address.clone(),
    };
    // The middle of the pixel as a share of the picture.
    let size = sight.camera.size;
    let at = (sight.pixel + 0.5) / size;
    let scale = (size.x / MAGNIFIED_WIDTH).max(1.0);
    let shift = move || match is_magnified.get() {
        true => format!(
            "translate({:.3}%, {:.3}%) scale({scale})",
            50.0 - 100.0 * scale * at.x,
            50.0 - 100.0 * scale * at.y
        ),
        false => "none".to_owned(),
    };
    // Of the chosen finding, where this view is one of those that saw it.
    let outline = ui.part(move |s| {
        let region = s.features.review.chosen()?.1.region.as_ref()?;
        let is_seen = region.views.iter().any(|seen| seen.view == view);
        is_seen.then(|| path_of(&sight.camera, &region.outlines)).filter(|path| !path.is_empty())
    });
    let mark = move |k: usize| match is_magnified.get() {
        true => "50%".to_owned(),
        false => format!("{:.3}%", 100.0 * at[k]),
    };
    let degrees = sight.cosine.clamp(-1.0, 1.0).acos().to_degrees();
    let choice = move |magnified: bool, label: &'static str, key: &'static str| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="evidence-magnify" value=key data-testid=format!("evidence-{key}")
                    prop:checked=move || is_magnified.get() == magnified
                    on:change=move |_| ui.send_feature(EvidenceEvent::Magnify(magnified))
                />
                <span>{label}</span>
            </label>
        }
    };
    view! {
        <div
            class="detail-picture evidence-picture" data-testid="evidence-picture" data-view=view
            data-u=format!("{:.2}", sight.pixel.x) data-v=format!("{:.2}", sight.pixel.y)
            data-full=move || loaded.get().map(|full| full.to_string())
            style:aspect-ratio=format!("{} / {}", size.x, size.y)
        >
            {move || address().map(|src| view! {
                <img class="picture-photo" src=src alt=t!("evidence.alt", number = view + 1) draggable="false" style:transform=shift/>
            })}
            {move || outline.get().map(|path| view! {
                <svg
                    class="evidence-outline" data-testid="evidence-outline" aria-hidden="true" preserveAspectRatio="none"
                    viewBox=format!("0 0 {} {}", size.x, size.y) style:transform=shift
                >
                    <path class="is-halo" d=path.clone()></path>
                    <path d=path></path>
                </svg>
            })}
            <span class="evidence-mark" aria-hidden="true" style:left=move || mark(0) style:top=move || mark(1)></span>
        </div>
        <fieldset class="segments detail-overlays">
            <legend class="visually-hidden">{t!("evidence.how_much")}</legend>
            {choice(true, t!("evidence.near"), "near")}
            {choice(false, t!("evidence.whole"), "whole")}
        </fieldset>
        <dl class="detail-figures">
            <div><dt>{t!("common.view")}</dt><dd>{view + 1}</dd></div>
            <div><dt>{t!("evidence.off_normal")}</dt><dd>{format!("{degrees:.0}°")}</dd></div>
            <div><dt>{t!("evidence.distance")}</dt><dd>{units::length(sight.distance.into())}</dd></div>
            <div><dt>{t!("evidence.pixels")}</dt><dd>{decimal(sight.pixels_per_millimetre, 2)}</dd></div>
        </dl>
        {(sight.sharp < 1.0).then(|| view! {
            <p class="evidence-note" data-testid="evidence-blurred">{t!("evidence.blurred")}</p>
        })}
        <Show when=move || loaded.get() == Some(false)>
            <p class="evidence-note">{t!("evidence.small")}</p>
        </Show>
        <Show when=move || missing.get()>
            <p class="evidence-note">{t!("evidence.dropped")}</p>
        </Show>
    }
}

/// What can be done with it.
#[component]
fn Use(ui: Ui, sight: Sight) -> impl IntoView {
    let is_projected = ui.part(|s| s.features.evidence.is_projected);
    let strength = ui.part(|s| s.features.evidence.strength);
    let has_pixels = ui.part(move |s| s.features.evidence.missing != Some(sight.view));
    let look = move |_| {
        if let Some(point) = ui.read(|s| s.features.evidence.point) {
            ui.ask(Command::Camera(CameraInput::From { eye: sight.camera.eye(), target: point.position.into() }));
        }
    };
    view! {
        <div class="evidence-use">
            <button class="text-button" type="button" data-testid="evidence-look" on:click=look>{t!("evidence.look")}</button>
            <button
                class="text-button" type="button" data-testid="evidence-view" on:click=move |_| ui.send(Event::SelectView(Some(sight.view)))
            >
                {t!("evidence.open")}
            </button>
        </div>
        <label class="switch-row">
            <span>{t!("evidence.project")}</span>
            <input
                class="switch" type="checkbox" role="switch" data-testid="evidence-project"
                prop:checked=move || is_projected.get() prop:disabled=move || !has_pixels.get()
                on:change=move |event| ui.send_feature(EvidenceEvent::Project(event_target_checked(&event)))
            />
        </label>
        <Show when=move || is_projected.get()>
            <label class="switch-row">
                <span>{t!("evidence.strength")}</span>
                <input
                    type="range" min="0" max="1" step="0.05" data-testid="evidence-strength"
                    prop:value=move || strength.get().to_string()
                    on:input=move |event| {
                        if let Ok(strength) = event_target_value(&event).parse() {
                            ui.send_feature(EvidenceEvent::Strength(strength));
                        }
                    }
                />
            </label>
        </Show>
    }
}
