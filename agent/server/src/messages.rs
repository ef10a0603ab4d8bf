//! What happens in an inspection, as messages of the control lane.

use super::thumbnail::{contribution_overlay, overlay, sigma_overlay, thumbnail};
use nalgebra::Isometry3;
use semascan_inspection::pipeline::{Stage, StageStatus, ViewOutcome};
use semascan_model::Taxonomy;
use semascan_perception::view::Intrinsics;
use semascan_protocol as wire;
use semascan_protocol::{Pose, StageEvent, StageTiming, ViewReport};
use std::time::Duration;

fn wire_stage(stage: Stage) -> wire::Stage {
    match stage {
        Stage::Acquire => wire::Stage::Acquire,
        Stage::Segment => wire::Stage::Segment,
        Stage::Register => wire::Stage::Register,
        Stage::Fuse => wire::Stage::Fuse,
        Stage::Publish => wire::Stage::Publish,
        Stage::Refine => wire::Stage::Refine,
    }
}

fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}

/// A stage that began, ended or failed.
pub(super) fn stage_event(view: u32, stage: Stage, status: &StageStatus) -> StageEvent {
    let mut event = StageEvent { view, ..StageEvent::default() };
    event.set_stage(wire_stage(stage));
    match status {
        StageStatus::Started => event.set_state(wire::StageState::Started),
        StageStatus::Finished(duration) => {
            event.set_state(wire::StageState::Finished);
            event.duration_us = micros(*duration);
        }
        StageStatus::Failed(reason) => {
            event.set_state(wire::StageState::Failed);
            event.message = reason.clone();
        }
    }
    event
}

/// What became of a view.
pub(super) fn view_report(outcome: &ViewOutcome, taxonomy: &Taxonomy) -> ViewReport {
    let timing = |(stage, duration): &(Stage, Duration)| StageTiming {
        stage: wire_stage(*stage).into(),
        duration_us: micros(*duration),
    };
    let view = outcome.view.as_ref();
    let labels = view.zip(outcome.segmentation.as_ref());
    ViewReport {
        index: outcome.index,
        accepted: outcome.result.is_ok(),
        reason: outcome.result.as_ref().err().cloned().unwrap_or_default(),
        table_from_camera: outcome.registration.as_ref().map(|r| pose(&r.table_from_camera)),
        intrinsics: view.map(|v| intrinsics(&v.intrinsics)),
        thumbnail_jpeg: view.map(|v| thumbnail(&v.rgb)).unwrap_or_default(),
        sigma_png: labels.map(|(v, s)| sigma_overlay(v, s)).unwrap_or_default(),
        contribution_png: labels.map(|(v, s)| contribution_overlay(v, s)).unwrap_or_default(),
        overlay_png: labels.map(|(v, s)| overlay(v, s, taxonomy)).unwrap_or_default(),
        timings: outcome.timings.iter().map(timing).collect(),
        points_added: outcome.result.as_ref().map_or(0, |i| i.points_added),
    }
}

fn pose(p: &Isometry3<f64>) -> Pose {
    let (q, t) = (p.rotation.coords, p.translation.vector);
    Pose { qx: q.x, qy: q.y, qz: q.z, qw: q.w, tx: t.x, ty: t.y, tz: t.z }
}

fn intrinsics(k: &Intrinsics) -> wire::Intrinsics {
    wire::Intrinsics { width: k.width, height: k.height, fx: k.fx, fy: k.fy, cx: k.cx, cy: k.cy }
}
