//! What an inspection found, for people, on stderr.

use semascan_agent::store::{InspectionRecord, TruthRecord};
use std::io::{self, Write};
use std::path::Path;

/// Prints a summary of `record`, which was written to `folder`.
pub(crate) fn print(record: &InspectionRecord, folder: &Path) -> io::Result<()> {
    let mut out = io::stderr().lock();
    let rejected = record.views.iter().filter(|v| !v.accepted).count();
    let voxel = record.voxel.map_or_else(|| "none".into(), |v| format!("{:.3} mm", v * 1e3));
    writeln!(
        out,
        "{}: {} views ({rejected} left out), {} points, voxel {voxel}",
        record.part,
        record.views.len(),
        record.points
    )?;
    for (key, value) in &record.settings {
        writeln!(out, "  {key} = {value}")?;
    }
    writeln!(out, "{:<28} {:>9} {:>12} {:>11}", "component", "points", "area mm2", "confidence")?;
    for c in record.components.iter().chain(&record.defects) {
        writeln!(out, "{:<28} {:>9} {:>12.1} {:>11.3}", c.name, c.points, c.area * 1e6, c.confidence)?;
    }
    if let Some(truth) = &record.truth {
        print_truth(&mut out, truth)?;
    }
    writeln!(out, "written to {}", folder.display())
}

fn print_truth(out: &mut impl Write, truth: &TruthRecord) -> io::Result<()> {
    writeln!(
        out,
        "{:<28} {:>9} {:>12} {:>13} {:>7}",
        "against truth", "points", "accuracy %", "completeness %", "IoU"
    )?;
    for c in truth.components.iter().chain(&truth.defects) {
        let (accuracy, completeness) = (c.accuracy * 100.0, c.completeness * 100.0);
        writeln!(out, "{:<28} {:>9} {accuracy:>12.2} {completeness:>14.2} {:>7.3}", c.name, c.points, c.iou)?;
    }
    let millimetres = |m: Option<f64>| m.map_or_else(|| "-".into(), |m| format!("{:.3} mm", m * 1e3));
    let (accuracy, completeness) = (truth.label_accuracy * 100.0, truth.label_completeness * 100.0);
    writeln!(out, "label accuracy {accuracy:.2} %, completeness {completeness:.2} %")?;
    writeln!(out, "HD95 {}, ME {} (model to truth)", millimetres(truth.hd95), millimetres(truth.mean_error))?;
    if let Some(aligned) = &truth.aligned {
        writeln!(
            out,
            "after one rigid alignment of the poses: HD95 {}, ME {}",
            millimetres(aligned.hd95),
            millimetres(aligned.mean_error)
        )?;
    }
    let errors = [("as they are", Some(&truth.poses)), ("aligned", truth.aligned.as_ref().map(|a| &a.poses))];
    let kinematic = truth.aligned.as_ref().map(|a| &a.prior_poses);
    for (name, poses) in errors.into_iter().chain([("kinematic, aligned", kinematic)]) {
        if let Some(poses) = poses.filter(|p| !p.is_empty()) {
            let (rotation, translation) = (spread(poses.iter().map(|p| p.1)), spread(poses.iter().map(|p| p.2)));
            writeln!(
                out,
                "poses, {name:<18}: median {:.4} deg {:.4} mm, worst {:.4} deg {:.4} mm",
                rotation.0.to_degrees(),
                translation.0 * 1e3,
                rotation.1.to_degrees(),
                translation.1 * 1e3
            )?;
        }
    }
    if let Some(ideal) = &truth.at_true_poses {
        let loss = (ideal.label_accuracy - truth.label_accuracy) * 100.0;
        writeln!(
            out,
            "with the true poses: accuracy {:.2} %, HD95 {}, ME {}; the poses cost {loss:.2} points of accuracy",
            ideal.label_accuracy * 100.0,
            millimetres(ideal.hd95),
            millimetres(ideal.mean_error),
        )?;
    }
    Ok(())
}

/// Median and largest.
fn spread(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let median = values.get(values.len() / 2).copied().unwrap_or(0.0);
    (median, values.last().copied().unwrap_or(0.0))
}
