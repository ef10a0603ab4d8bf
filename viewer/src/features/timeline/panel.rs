//! The panel of the timeline: a slider over the stops, and buttons that step and play.

use super::controller::TimelineController;
use super::{Timeline, TimelineEvent};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::{Command, Ui};
use crate::words::{decimal, t};
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Timeline {
    fn panel(ui: Ui) -> AnyView {
        view! { <TimelinePanel ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(TimelineController::new(host))
    }
}

/// There where something is played, or can be had to be played.
#[component]
fn TimelinePanel(ui: Ui) -> impl IntoView {
    let is_open = ui.part(|s| s.features.timeline.is_open());
    // What can be reviewed is closed, and can be made again.
    let is_kept = ui.part(|s| {
        let reviewed = &s.features.review.case.inspection;
        !s.connection.is_file() && !reviewed.is_empty() && *reviewed == s.inspection.id
    });
    view! {
        <Show when=move || is_open.get() || is_kept.get()>
            <section
                class="panel" aria-labelledby="timeline-title" data-testid="timeline"
                data-at=move || ui.follow(|s| s.features.timeline.at)
                data-stops=move || ui.follow(|s| s.features.timeline.stops.len())
            >
                <header class="panel-head">
                    <h2 id="timeline-title">{t!("timeline.panel")}</h2>
                    <span class="panel-note">{move || ui.follow(|s| time_of(&s.features.timeline))}</span>
                </header>
                <Show when=move || is_open.get() fallback=move || view! { <Offer ui/> }>
                    <Controls ui/>
                </Show>
            </section>
        </Show>
    }
}

/// When what is shown was there, after the beginning.
fn time_of(timeline: &Timeline) -> String {
    timeline
        .stops
        .get(timeline.at)
        .map_or_else(String::new, |stop| format!("{} s", decimal(stop.time.as_secs_f64(), 1)))
}

/// The way to the timeline of an inspection that the agent keeps.
#[component]
fn Offer(ui: Ui) -> impl IntoView {
    let is_loading = ui.part(|s| s.features.timeline.is_loading);
    view! {
        <button
            class="button" type="button" data-testid="timeline-load" prop:disabled=move || is_loading.get()
            title=t!("timeline.load.title")
            on:click=move |_| ui.send_feature(TimelineEvent::Requested)
        >
            {move || if is_loading.get() { t!("timeline.loading") } else { t!("timeline.load") }}
        </button>
    }
}

#[component]
fn Controls(ui: Ui) -> impl IntoView {
    let timeline = ui.part(|s| s.features.timeline.clone());
    let is_agents = ui.part(|s| s.connection.is_recorded());
    let slide = move |event: web_sys::Event| {
        if let Ok(place) = event_target_value(&event).parse() {
            ui.send_feature(TimelineEvent::To(place));
        }
    };
    let play = move |_| {
        let is_playing = timeline.with_untracked(|t| t.is_playing);
        ui.send_feature(TimelineEvent::Play(!is_playing));
    };
    let step = move |by: i32, id: &'static str, name: &'static str, title: &'static str| {
        view! {
            <button
                class="button" type="button" data-testid=id title=title
                on:click=move |_| ui.send_feature(TimelineEvent::Step(by))
            >
                {name}
            </button>
        }
    };
    view! {
        <p class="timeline-place" data-testid="timeline-place">{move || timeline.with(Timeline::place)}</p>
        // The range is read with the place: where it changes a browser puts the slider elsewhere.
        <input
            type="range" class="slider timeline-slider" data-testid="timeline-slider" aria-label=t!("common.views") min="0" step="1"
            aria-valuetext=move || timeline.with(Timeline::place)
            prop:max=move || timeline.with(|t| t.last().to_string())
            prop:value=move || timeline.with(|t| (t.last(), t.at).1.to_string())
            on:input=slide
        />
        <div class="buttons timeline-buttons">
            {step(-1, "timeline-back", t!("timeline.back"), t!("timeline.back.title"))}
            <button class="button" type="button" data-testid="timeline-play" on:click=play>
                {move || if timeline.with(|t| t.is_playing) { t!("timeline.pause") } else { t!("timeline.play") }}
            </button>
            {step(1, "timeline-on", t!("timeline.on"), t!("timeline.on.title"))}
        </div>
        <Show when=move || is_agents.get()>
            <button
                class="text-button" type="button" data-testid="timeline-close" on:click=move |_| ui.ask(Command::Reload)
            >
                {t!("timeline.close")}
            </button>
        </Show>
    }
}
