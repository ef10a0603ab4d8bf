//! `semascan evaluate RESULT truth.json`: the poses of an inspection against the true ones of a simulated recording.

use super::Failure;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use semascan_evaluation::{POSE_TRUTH_CONVENTION, PoseFile, PoseTruth};
use semascan_inspection::record::pose_record;
use serde_json::json;
use std::io::Write;
use std::path::Path;

/// Judges the poses of `inspection`, a folder or a file of poses, by those in `truth`, and prints their errors.
pub(super) fn judge(inspection: &Path, truth: &Path, json: bool) -> Result<(), Failure> {
    let truth = PoseTruth::read(truth)?;
    let poses = PoseFile::read(inspection)?;
    let judged = truth.judge(&poses)?;

    let degrees: Vec<f64> = judged.views.iter().map(|(_, e)| e.rotation.to_degrees()).collect();
    let millimetres: Vec<f64> = judged.views.iter().map(|(_, e)| e.translation * 1e3).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let mut out = Stderr::default();
    writeln!(out, "poses of {} against {}", poses.path.display(), truth.path.display())?;
    writeln!(out, "{:>6} {:>12} {:>12}", "view", "degrees", "mm")?;
    for ((view, _), (degrees, mm)) in judged.views.iter().zip(degrees.iter().zip(&millimetres)) {
        writeln!(out, "{view:>6} {degrees:>12.4} {mm:>12.4}")?;
    }
    writeln!(out, "{:>6} {:>12.4} {:>12.4}", "mean", mean(&degrees), mean(&millimetres))?;
    writeln!(out, "{:>6} {:>12.4} {:>12.4}", "most", largest(&degrees), largest(&millimetres))?;
    if !judged.without_pose.is_empty() {
        let views: Vec<String> = judged.without_pose.iter().map(u32::to_string).collect();
        writeln!(out, "{} views have no pose and are not judged: {}", views.len(), views.join(", "))?;
    }
    writeln!(out, "  {POSE_TRUTH_CONVENTION}")?;
    if json {
        let views = judged
            .views
            .iter()
            .map(|(view, error)| json!({ "view": view, "rotation": error.rotation, "translation": error.translation }));
        let report = json!({
            "poses": poses.path, "truth": truth.path, "convention": POSE_TRUTH_CONVENTION,
            "truth_from_model": pose_record(&judged.truth_from_model),
            "views": views.collect::<Vec<_>>(), "without_pose": judged.without_pose,
        });
        print_json(&report)?;
    }
    Ok(())
}
