//! What happens in an inspection, as messages of the control lane.

use super::thumbnail::{contribution_overlay, overlay, sigma_overlay, thumbnail};
use semascan_inspection::event::{EventKind, ProcessedView, StageStatus};
use semascan_model::record::{PoseRecord, Stage, ViewNetworksRecord, ViewRecord};
use semascan_model::{InspectionId, Taxonomy};
use semascan_perception::view::Intrinsics;
use semascan_protocol::{self as wire, Inspection, Pose, StageEvent, StageTiming, ViewReport};

/// What is inspected; the default where `kind` is not [`EventKind::Started`].
pub(super) fn inspection(id: InspectionId, kind: &EventKind) -> Inspection {
    let EventKind::Started { part, source, taxonomy, views_expected, turntable } = kind else {
        return Inspection::default();
    };
    let mut inspection = Inspection {
        id: id.to_string(),
        epoch: 1,
        part: part.clone(),
        source: source.clone(),
        views_expected: views_expected.unwrap_or(0),
        turntable: turntable.map(|t| wire::Turntable { radius: t.radius, height: t.height }),
        ..Inspection::default()
    };
    inspection.set_taxonomy(taxonomy);
    inspection
}

/// The stage as the wire has it.
pub(super) fn wire_stage(stage: Stage) -> wire::Stage {
    match stage {
        Stage::Acquire => wire::Stage::Acquire,
        Stage::Segment => wire::Stage::Segment,
        Stage::Register => wire::Stage::Register,
        Stage::Fuse => wire::Stage::Fuse,
        Stage::Refine => wire::Stage::Refine,
    }
}

fn micros(seconds: f64) -> u64 {
    // A cast saturates.
    (seconds * 1e6).round() as u64
}

/// A stage that began, ended or failed.
pub(super) fn stage_event(view: u32, stage: wire::Stage, status: &StageStatus) -> StageEvent {
    let mut event = StageEvent { view, ..StageEvent::default() };
    event.set_stage(stage);
    match status {
        StageStatus::Started => event.set_state(wire::StageState::Started),
        StageStatus::Finished { seconds } => {
            event.set_state(wire::StageState::Finished);
            event.duration_us = micros(*seconds);
        }
        StageStatus::Failed { reason } => {
            event.set_state(wire::StageState::Failed);
            event.message.clone_from(reason);
        }
    }
    event
}

/// Time of a stage of a view.
pub(super) fn stage_timing(stage: wire::Stage, seconds: f64) -> StageTiming {
    StageTiming { stage: stage.into(), duration_us: micros(seconds) }
}

/// What became of a view, with small pictures of it.
pub(super) fn view_report(record: &ViewRecord, processed: Option<&ProcessedView>, taxonomy: &Taxonomy) -> ViewReport {
    let view = processed.map(|p| &p.view);
    let labels = processed.and_then(|p| Some((&p.view, p.segmentation.as_ref()?)));
    ViewReport {
        index: record.index,
        accepted: record.accepted,
        reason: record.reason.clone().unwrap_or_default(),
        table_from_camera: record.pose.as_ref().map(pose),
        intrinsics: view.map(|v| intrinsics(&v.intrinsics)),
        thumbnail_jpeg: view.map(|v| thumbnail(&v.rgb)).unwrap_or_default(),
        sigma_png: labels.map(|(v, s)| sigma_overlay(v, s)).unwrap_or_default(),
        contribution_png: labels.map(|(v, s)| contribution_overlay(v, s)).unwrap_or_default(),
        overlay_png: labels.map(|(v, s)| overlay(v, s, taxonomy)).unwrap_or_default(),
        timings: record.timings.iter().map(|t| stage_timing(wire_stage(t.stage), t.seconds)).collect(),
        points_added: record.points_added,
        sharpness: record.sharpness.map(|s| s as f32),
        pictures_dropped: false,
        domain: domain(record.networks.as_ref()).into(),
    }
}

fn domain(networks: Option<&ViewNetworksRecord>) -> wire::Domain {
    match networks.map(|networks| networks.domain) {
        None => wire::Domain::NoNetwork,
        Some(None) => wire::Domain::Unknown,
        Some(Some(domain)) if domain.outside => wire::Domain::Outside,
        Some(Some(_)) => wire::Domain::Inside,
    }
}

fn pose(p: &PoseRecord) -> Pose {
    let (q, [tx, ty, tz]) = (p.rotation, p.translation);
    Pose { qx: q.x, qy: q.y, qz: q.z, qw: q.w, tx, ty, tz }
}

fn intrinsics(k: &Intrinsics) -> wire::Intrinsics {
    wire::Intrinsics { width: k.width, height: k.height, fx: k.fx, fy: k.fy, cx: k.cx, cy: k.cy }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::record::{DomainRecord, UncertaintyFigures};

    #[test]
    fn a_domain_that_nothing_judged_is_not_known() {
        let judged = |outside| DomainRecord {
            score: 1.0,
            threshold: 2.0,
            disagreement: None,
            disagreement_threshold: None,
            outside,
        };
        let of = |domain| {
            let components = UncertaintyFigures::default();
            super::domain(Some(&ViewNetworksRecord { window: None, domain, components, defects: None }))
        };
        assert_eq!(super::domain(None), wire::Domain::NoNetwork);
        assert_eq!(of(None), wire::Domain::Unknown);
        assert_eq!([true, false].map(|o| of(Some(judged(o)))), [wire::Domain::Outside, wire::Domain::Inside]);
    }
}
