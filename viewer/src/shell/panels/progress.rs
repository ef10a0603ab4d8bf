//! Where the inspection stands: phase, views, figures, and how long each stage takes.

use crate::state::progress::Standing;
use crate::state::timings::{STAGES, StageTime, stage_key, stage_label};
use crate::state::{AppState, units};
use crate::ui::Ui;
use crate::ui::icons::{DONE, Icon, UNLINKED, WARNING};
use crate::words::t;
use leptos::prelude::*;
use semascan_protocol::{Phase, Stage};

/// The inspection at a glance.
#[component]
pub(super) fn ProgressPanel(ui: Ui) -> impl IntoView {
    let progress = ui.part(|s| s.progress.clone());
    let voxel = ui.part(|s| s.inspection.voxel);
    let views = move || progress.with(|p| p.views_done.to_string());
    let of = move || {
        progress.with(|p| match p.views_expected {
            0 if p.views_done == 1 => t!("progress.view").to_owned(),
            0 => t!("progress.views").to_owned(),
            all => t!("progress.of_views", all),
        })
    };
    view! {
        <section
            class="panel" aria-labelledby="progress-title" data-testid="progress"
            data-phase=move || ui.follow(|s| s.standing().key())
            data-done=move || progress.with(|p| p.views_done)
            data-expected=move || progress.with(|p| p.views_expected)
            data-rejected=move || progress.with(|p| p.views_rejected)
        >
            <header class="panel-head">
                <h2 id="progress-title">{t!("progress.panel")}</h2>
                <PhaseChip ui/>
            </header>
            <p class="headline"><span class="headline-figure">{views}</span> {of}</p>
            <ProgressBar ui/>
            <Show when=move || progress.with(|p| p.phase != Phase::Running && !p.message.is_empty())>
                <p class="callout callout-error"><Icon path=WARNING/> <span>{move || progress.with(|p| units::sentence(&p.message))}</span></p>
            </Show>
            <dl class="figures">
                <div title=t!("progress.points")>
                    <dt>{t!("common.points")}</dt><dd>{move || progress.with(|p| units::count(p.points))}</dd>
                </div>
                <div>
                    <dt>{t!("progress.voxel")}</dt>
                    <dd>{move || if voxel.get() > 0.0 { units::length(voxel.get()) } else { "–".into() }}</dd>
                </div>
                <div class:is-warning=move || progress.with(|p| p.views_rejected > 0)>
                    <dt>{t!("progress.rejected")}</dt><dd>{move || progress.with(|p| p.views_rejected)}</dd>
                </div>
            </dl>
            // Who sets a cell up looks here, who reviews a part does not.
            <details class="fold">
                <summary class="subhead">{t!("progress.times")} <span class="subhead-note">{t!("progress.times.what")}</span></summary>
                <ol class="stages">
                    {STAGES.into_iter().map(|stage| view! { <StageBar ui stage/> }).collect_view()}
                </ol>
            </details>
        </section>
    }
}

/// The phase as a label.
#[component]
fn PhaseChip(ui: Ui) -> impl IntoView {
    let standing = ui.part(AppState::standing);
    let is = move |phase: Phase| standing.get() == Standing::Known(phase);
    view! {
        <Show when=move || !is(Phase::Unspecified)>
            <span
                class="chip" data-testid="phase" data-phase=move || standing.get().key()
                title=move || {
                    (standing.get() == Standing::Unknown)
                        .then_some(t!("progress.interrupted"))
                }
            >
                <Show when=move || is(Phase::Finished)><Icon path=DONE/></Show>
                <Show when=move || is(Phase::Failed)><Icon path=WARNING/></Show>
                <Show when=move || standing.get() == Standing::Unknown><Icon path=UNLINKED/></Show>
                {move || standing.get().label()}
            </span>
        </Show>
    }
}

/// The share of the views that is done; moving to and fro where the number is not known and the inspection runs.
#[component]
fn ProgressBar(ui: Ui) -> impl IntoView {
    let state = ui.part(|s| (s.progress.fraction(), s.standing()));
    // A finished inspection is complete, however many views it was expected to take.
    let shown = move || match state.get() {
        (_, Standing::Known(Phase::Finished)) => Some(1.0),
        (fraction, _) => fraction,
    };
    let is_moving = move || matches!(state.get(), (None, Standing::Known(Phase::Running)));
    view! {
        <div
            class="meter" role="progressbar" aria-label=t!("progress.captured") aria-valuemin="0" aria-valuemax="100"
            aria-valuenow=move || shown().map(|f| format!("{:.0}", f * 100.0))
            data-phase=move || state.get().1.key()
            class:is-unknown=is_moving
        >
            <span class="meter-fill" style:width=move || format!("{:.2}%", shown().unwrap_or(0.0) * 100.0)></span>
        </div>
    }
}

/// The latest and the mean duration of a stage, as a bar on the common scale.
#[component]
fn StageBar(ui: Ui, stage: Stage) -> impl IntoView {
    let time = ui.part(move |s| (s.timings.of(stage), s.timings.scale_us()));
    let share = move |of: fn(&StageTime) -> Option<u64>| {
        let (time, scale) = time.get();
        of(&time).map(|us| us as f64 / scale.max(1) as f64 * 100.0)
    };
    let text = move |of: fn(&StageTime) -> Option<u64>| of(&time.get().0).map_or_else(|| "–".into(), units::duration);
    view! {
        <li
            class="stage-row" data-testid=format!("stage-{}", stage_key(stage))
            data-last-us=move || time.get().0.last_us
            data-mean-us=move || time.get().0.mean_us
            class:is-active=move || time.get().0.active.is_some()
            class:is-failed=move || time.get().0.failed.gt(&0)
        >
            <span class="stage-name">{stage_label(stage)}</span>
            <span class="stage-track" aria-hidden="true">
                <span class="stage-fill" style:width=move || format!("{:.2}%", share(|t| t.last_us).unwrap_or(0.0))></span>
                <span
                    class="stage-mean" class:is-known=move || share(|t| t.mean_us).is_some()
                    style:left=move || format!("{:.2}%", share(|t| t.mean_us).unwrap_or(0.0))
                ></span>
            </span>
            <span class="stage-time">{move || text(|t| t.last_us)}</span>
            <span class="stage-time is-mean">{move || text(|t| t.mean_us)}</span>
        </li>
    }
}
