//! How long each stage takes, from the agent's stage events and view reports.
//!
//! The two lanes overlap: a duration comes with the stage event while the view is under way and again with the view's
//! report (and after a reconnection with the report alone). Durations are therefore kept by view and stage, so that
//! each counts once.

use crate::words::t;
use semascan_protocol::{Stage, StageEvent, StageState, ViewReport};
use std::collections::BTreeMap;

/// The stages in the order a view passes through them.
pub const STAGES: [Stage; 6] =
    [Stage::Acquire, Stage::Segment, Stage::Register, Stage::Fuse, Stage::Publish, Stage::Refine];

/// Name of a stage for people.
pub fn stage_label(stage: Stage) -> &'static str {
    match stage {
        Stage::Unspecified => t!("stage.other"),
        Stage::Acquire => t!("stage.acquire"),
        Stage::Segment => t!("stage.segment"),
        Stage::Register => t!("stage.register"),
        Stage::Fuse => t!("stage.fuse"),
        Stage::Publish => t!("stage.publish"),
        Stage::Refine => t!("stage.refine"),
    }
}

/// Stable name of a stage for styles and tests.
pub fn stage_key(stage: Stage) -> &'static str {
    match stage {
        Stage::Unspecified => "other",
        Stage::Acquire => "acquire",
        Stage::Segment => "segment",
        Stage::Register => "register",
        Stage::Fuse => "fuse",
        Stage::Publish => "publish",
        Stage::Refine => "refine",
    }
}

/// What is known of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTime {
    /// Duration at the latest view, in microseconds.
    pub last_us: Option<u64>,
    /// Mean duration over the views, in microseconds.
    pub mean_us: Option<u64>,
    /// The view that the stage works on right now.
    pub active: Option<u32>,
    /// Number of views at which it failed.
    pub failed: u32,
}

/// Durations by view and stage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Timings {
    durations: BTreeMap<u32, [Option<u64>; STAGES.len()]>,
    active: [Option<u32>; STAGES.len()],
    failed: [u32; STAGES.len()],
}

impl Timings {
    /// Views whose durations are kept, the latest ones; the means are over these.
    const MAX_VIEWS: usize = 1000;

    /// Takes a stage event.
    pub(super) fn stage(&mut self, event: &StageEvent) {
        let Some(stage) = position(event.stage()) else {
            return;
        };
        match event.state() {
            StageState::Unspecified => {}
            StageState::Started => self.active[stage] = Some(event.view),
            StageState::Finished => {
                self.end(stage, event.view);
                self.record(event.view, stage, event.duration_us);
            }
            StageState::Failed => {
                self.end(stage, event.view);
                self.failed[stage] = self.failed[stage].saturating_add(1);
            }
        }
    }

    /// Takes the durations of a view's report.
    pub(super) fn report(&mut self, report: &ViewReport) {
        for timing in &report.timings {
            if let Some(stage) = position(timing.stage()) {
                self.end(stage, report.index);
                self.record(report.index, stage, timing.duration_us);
            }
        }
    }

    /// Nothing runs any more.
    pub(super) fn idle(&mut self) {
        self.active = Default::default();
    }

    /// What is known of a stage.
    pub fn of(&self, stage: Stage) -> StageTime {
        let Some(i) = position(stage) else {
            return StageTime::default();
        };
        let known = || self.durations.values().filter_map(move |d| d[i]);
        let count = known().count() as u128;
        let sum: u128 = known().map(u128::from).sum();
        StageTime {
            last_us: known().next_back(),
            mean_us: (count > 0).then(|| (sum / count.max(1)) as u64),
            active: self.active[i],
            failed: self.failed[i],
        }
    }

    /// The longest last or mean duration of any stage in microseconds: the common scale of the bars.
    pub fn scale_us(&self) -> u64 {
        STAGES.into_iter().map(|s| self.of(s)).flat_map(|t| [t.last_us, t.mean_us]).flatten().max().unwrap_or(0)
    }

    /// Durations of one view in the order of [`STAGES`], in microseconds.
    pub fn of_view(&self, view: u32) -> [Option<u64>; STAGES.len()] {
        self.durations.get(&view).copied().unwrap_or_default()
    }

    fn record(&mut self, view: u32, stage: usize, duration_us: u64) {
        self.durations.entry(view).or_default()[stage] = Some(duration_us);
        while self.durations.len() > Self::MAX_VIEWS {
            self.durations.pop_first();
        }
    }

    fn end(&mut self, stage: usize, view: u32) {
        if self.active[stage] == Some(view) {
            self.active[stage] = None;
        }
    }
}

fn position(stage: Stage) -> Option<usize> {
    STAGES.into_iter().position(|s| s == stage)
}
