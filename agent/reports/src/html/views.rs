//! The views: their poses and how these were found, how well they agree with the pictures, the time each stage took, and the
//! model against truth where the source knows it.

use super::or_dash;
use super::uncertainty::definitions;
use crate::described;
use crate::figure::{plain, significant};
use maud::{Markup, html};
use semascan_model::record::{
    ClassTruth, IcpRecord, InspectionRecord, LabelSource, PoseErrorRecord, PoseRecord, RegistrationRecord, Stage,
    TruthRecord, ViewRecord,
};

/// Views that are listed; the rest is in the record.
const MOST_VIEWS: usize = 400;
/// Views whose times are drawn.
const MOST_BARS: usize = 48;

pub(super) fn views(record: &InspectionRecord) -> Markup {
    html! {
        section #views {
            h2 { "Views and poses" }
            @if record.views.is_empty() {
                p { "No view came." }
            } @else {
                (poses(record))
                (agreement(record))
                (times(record))
            }
            @if let Some(truth) = &record.truth { (against_truth(record, truth)) }
        }
    }
}

fn poses(record: &InspectionRecord) -> Markup {
    html! {
        table.views {
            thead { tr {
                th { "View" } th { "Pose" } th.number { "x, y, z" br; "mm" } th.number { "Standard" br; "deviation" }
                th.number { "Moved from" br; "the prior" } th.number { "Overlap" } th.number { "New" br; "points" } th.number { "Time" br; "s" }
            } }
            tbody {
                @for view in record.views.iter().take(MOST_VIEWS) {
                    tr .rejected[!view.accepted] {
                        td { (view.index) }
                        @if view.accepted {
                            td { (described::registration(view.registration.as_ref())) }
                        } @else {
                            td { "left out: " (view.reason.as_deref().unwrap_or("no reason is recorded")) }
                        }
                        td.number { (or_dash(view.pose.as_ref().map(|p| p.translation.map(|c| plain(c * 1e3, 1)).join(", ")))) }
                        td.number { (or_dash(view.covariance.as_ref().and_then(deviations))) }
                        td.number { (or_dash(moved(view))) }
                        td.number { (or_dash(icp(view).map(|icp| format!("{:.0} %", 100.0 * icp.overlap)))) }
                        td.number { (view.points_added) }
                        td.number { (or_dash(seconds(view).map(|s| plain(s, 2)))) }
                    }
                }
            }
        }
        @if record.views.len() > MOST_VIEWS {
            p.note { "The first " (MOST_VIEWS) " of " (record.views.len()) " views; all are in inspection.json." }
        }
        p.note {
            "Poses are those of the camera in the table frame. Standard deviation: root of the largest variance of rotation and of "
            "translation in any axis of the camera."
            @if let Some(refinement) = &record.refinement {
                " All poses were refined together after the last view: " (refinement.edges) " pairs of views, fit "
                (plain(refinement.fit_before * 1e3, 3)) " mm before and " (plain(refinement.fit_after * 1e3, 3)) " mm after."
            }
        }
    }
}

fn icp(view: &ViewRecord) -> Option<&IcpRecord> {
    match view.registration.as_ref()? {
        RegistrationRecord::Icp { icp } => Some(icp),
        RegistrationRecord::Relocalized { icp, .. } => icp.as_ref(),
        _ => None,
    }
}

/// `0.05°, 0.12 mm` from a covariance.
fn deviations(covariance: &[[f64; 6]; 6]) -> Option<String> {
    let largest = |axes: std::ops::Range<usize>| axes.map(|k| covariance[k][k]).fold(f64::NAN, f64::max).sqrt();
    let (rotation, translation) = (largest(0..3), largest(3..6));
    let known = rotation.is_finite() && translation.is_finite();
    known.then(|| format!("{}°, {} mm", significant(rotation.to_degrees()), significant(translation * 1e3)))
}

/// How far the estimate lies from the prior: angle and distance of the camera.
fn moved(view: &ViewRecord) -> Option<String> {
    let (pose, prior) = (view.pose.as_ref()?, view.prior.as_ref()?);
    let (angle, distance) = between(pose, prior);
    Some(format!("{}°, {} mm", plain(angle.to_degrees(), 2), plain(distance * 1e3, 2)))
}

fn between(a: &PoseRecord, b: &PoseRecord) -> (f64, f64) {
    let (p, q) = (a.rotation, b.rotation);
    // The angle of the rotation between two unit quaternions, from the sine of its half: exact near zero.
    let cosine = (p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w).abs();
    let sine = [
        p.w * q.x - p.x * q.w - p.y * q.z + p.z * q.y,
        p.w * q.y + p.x * q.z - p.y * q.w - p.z * q.x,
        p.w * q.z - p.x * q.y + p.y * q.x - p.z * q.w,
    ];
    let sine = sine.iter().map(|s| s * s).sum::<f64>().sqrt();
    let distance = (0..3).map(|k| (a.translation[k] - b.translation[k]).powi(2)).sum::<f64>().sqrt();
    (2.0 * sine.atan2(cosine), distance)
}

fn seconds(view: &ViewRecord) -> Option<f64> {
    (!view.timings.is_empty()).then(|| view.timings.iter().map(|t| t.seconds).sum())
}

fn agreement(record: &InspectionRecord) -> Markup {
    let Some(photometric) = &record.photometric else { return html! {} };
    html! {
        h3 { "Poses against the pictures" }
        p {
            @match (photometric.error, &photometric.unknown) {
                (Some(error), _) => {
                    (plain(error, 2)) " pixels"
                    @if let Some(prior) = photometric.prior_error { " (with the kinematic poses " (plain(prior, 2)) ")" }
                    ", from " (photometric.matches) " matches in " (photometric.pairs) " pairs of views. "
                },
                (None, Some(why)) => { "Not known: " (why) ". " },
                (None, None) => "Not known. ",
            }
        }
        p.note { "How: " (photometric.convention) "." }
    }
}

const STAGES: [Stage; 4] = [Stage::Acquire, Stage::Segment, Stage::Register, Stage::Fuse];

fn times(record: &InspectionRecord) -> Markup {
    let timed: Vec<&ViewRecord> = record.views.iter().filter(|view| !view.timings.is_empty()).collect();
    let of = |view: &ViewRecord, stage: Stage| -> f64 {
        view.timings.iter().filter(|t| t.stage == stage).map(|t| t.seconds).sum()
    };
    let longest = timed.iter().filter_map(|view| seconds(view)).fold(0.0, f64::max);
    html! {
        @if !timed.is_empty() && longest > 0.0 {
            h3 { "Times" }
            div.columns {
                table {
                    thead { tr { th { "Stage" } th.number { "Mean" br; "s" } th.number { "Longest" br; "s" } th.number { "In all" br; "s" } } }
                    tbody {
                        @for stage in STAGES {
                            @let list: Vec<f64> = timed.iter().map(|view| of(view, stage)).collect();
                            @let sum: f64 = list.iter().sum();
                            tr {
                                td { span.swatch.(stage.name()) {} (stage.name()) }
                                td.number { (plain(sum / list.len() as f64, 3)) }
                                td.number { (plain(list.iter().copied().fold(0.0, f64::max), 3)) }
                                td.number { (plain(sum, 2)) }
                            }
                        }
                    }
                }
                @if timed.len() <= MOST_BARS {
                    svg.times viewBox=(format!("0 0 240 {}", 11 * timed.len() + 14)) role="img" aria-label="time of each view by stage" {
                        @for (row, view) in timed.iter().enumerate() {
                            text x="22" y=(11 * row + 9) { (view.index) }
                            @for (start, width, stage) in bars(view, longest, &of) {
                                rect.(stage.name()) x=(format!("{start:.2}")) y=(11 * row + 2) width=(format!("{width:.2}")) height="8" {}
                            }
                        }
                        path.axis d=(format!("M26 0V{}H236", 11 * timed.len() + 2)) {}
                        text.end x="236" y=(11 * timed.len() + 12) { (plain(longest, 2)) " s" }
                    }
                }
            }
            p.note { "Stages of different views run beside each other: their times do not add up to the whole." }
        }
    }
}

/// Start, width and stage of the bars of a view.
fn bars(view: &ViewRecord, longest: f64, of: &dyn Fn(&ViewRecord, Stage) -> f64) -> Vec<(f64, f64, Stage)> {
    let mut start = 26.0;
    let mut list = Vec::new();
    for stage in STAGES {
        let width = 210.0 * of(view, stage) / longest;
        list.push((start, width, stage));
        start += width;
    }
    list
}

fn against_truth(record: &InspectionRecord, truth: &TruthRecord) -> Markup {
    let millimetres = |m: Option<f64>| m.map_or_else(|| "–".into(), |m| format!("{} mm", plain(m * 1e3, 3)));
    html! {
        h3 { "Against truth" }
        p {
            "The source knows the true part. Model to truth: HD95 " (millimetres(truth.hd95)) ", mean error "
            (millimetres(truth.mean_error))
            @if let Some(aligned) = &truth.aligned {
                "; after one rigid alignment of the poses " (millimetres(aligned.hd95)) " and " (millimetres(aligned.mean_error))
            }
            ". "
            @if let Some(worst) = worst(truth.aligned.as_ref().map_or(&truth.poses, |aligned| &aligned.poses)) {
                "Poses" @if truth.aligned.is_some() { ", aligned" } ": at most " (worst) ". "
            }
            @if record.labels != LabelSource::None {
                "Labels: " (plain(100.0 * truth.label_accuracy, 2)) " % right, " (plain(100.0 * truth.label_completeness, 2))
                " % kept."
            }
        }
        @if record.labels != LabelSource::None {
            table {
                thead { tr {
                    th { "Class" } th.number { "Points" } th.number { "Accuracy" br; "%" } th.number { "Completeness" br; "%" } th.number { "IoU" }
                } }
                tbody {
                    @for class in &truth.components { (class_row(class, "component")) }
                    @for class in &truth.defects { (class_row(class, "defect")) }
                }
            }
        }
        (definitions(&truth.conventions))
    }
}

fn class_row(class: &ClassTruth, kind: &str) -> Markup {
    html! {
        tr {
            td { (class.name) @if class.class == 0 { " (" (kind) ")" } @else if kind == "defect" { " (defect)" } }
            td.number { (class.points) }
            td.number { (plain(100.0 * class.accuracy, 2)) }
            td.number { (plain(100.0 * class.completeness, 2)) }
            td.number { (plain(class.iou, 3)) }
        }
    }
}

fn worst(poses: &[PoseErrorRecord]) -> Option<String> {
    let most = |of: fn(&PoseErrorRecord) -> f64| poses.iter().map(of).reduce(f64::max);
    let (rotation, translation) = (most(|p| p.rotation)?, most(|p| p.translation)?);
    Some(format!("{}° and {} mm", plain(rotation.to_degrees(), 3), plain(translation * 1e3, 3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::record::QuaternionRecord;

    #[test]
    fn the_way_from_the_prior_is_an_angle_and_a_distance() {
        let pose = |angle: f64, x: f64| PoseRecord {
            rotation: QuaternionRecord { x: 0.0, y: 0.0, z: (angle / 2.0).sin(), w: (angle / 2.0).cos() },
            translation: [x, 0.0, 0.0],
        };
        let (angle, distance) = between(&pose(0.301, 0.5), &pose(0.3, 0.503));
        assert!((angle - 0.001).abs() < 1e-12 && (distance - 0.003).abs() < 1e-12, "{angle} {distance}");
        // q and -q are the same rotation.
        let mut negated = pose(0.3, 0.0);
        negated.rotation = QuaternionRecord { x: 0.0, y: 0.0, z: -negated.rotation.z, w: -negated.rotation.w };
        assert!(between(&pose(0.3, 0.0), &negated).0.abs() < 1e-9);
        let mut covariance = [[0.0; 6]; 6];
        covariance[1][1] = 1e-6;
        covariance[5][5] = 4e-8;
        assert_eq!(deviations(&covariance).as_deref(), Some("0.0573°, 0.200 mm"));
        covariance[5][5] = f64::NAN;
        covariance[4][4] = f64::NAN;
        covariance[3][3] = f64::NAN;
        assert_eq!(deviations(&covariance), None);
    }
}
