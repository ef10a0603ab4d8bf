//! What an inspection found, for people, on stderr.

use super::findings_report;
use crate::stderr::Stderr;
use semascan_model::record::{
    DomainRecord, InspectionRecord, LabelSource, NetworksRecord, PhotometricRecord, PlanPurpose, PlanRecord,
    PlannedView, RegistrationRecord, TruthRecord, ViewRecord,
};
use semascan_perception::segment::network::UncertaintyFigures;
use std::io::{self, Write};
use std::path::Path;

/// Prints a summary of `record`, which was written to `folder`.
pub(crate) fn print(record: &InspectionRecord, folder: &Path) -> io::Result<()> {
    let mut out = Stderr::default();
    let used = record.views.iter().filter(|v| v.accepted).count();
    let (views, share) = (record.views.len(), 100.0 * used as f64 / record.views.len().max(1) as f64);
    let voxel = record.voxel.map_or_else(|| "none".into(), |v| format!("{:.3} mm", v * 1e3));
    writeln!(
        out,
        "{}: {used} of {views} views used ({share:.0} %, {} left out), {} points, voxel {voxel}",
        record.part,
        views - used,
        record.points
    )?;
    let surface: u64 = record.components.iter().map(|c| c.points).sum();
    if surface < record.points {
        let rest = record.points - surface;
        writeln!(
            out,
            "  {surface} points make up the surface; {rest} stray, uncertain or background ones are in cloud.ply only"
        )?;
    }
    if let Some(plan) = &record.plan {
        print_plan(&mut out, plan)?;
    }
    print_poses(&mut out, &record.views)?;
    if let Some(photometric) = &record.photometric {
        print_photometric(&mut out, photometric)?;
    }
    if let Some(run) = record.run.filter(|run| run.region.left_out() > 0) {
        writeln!(out, "  region of interest: {}", run.region)?;
    }
    if record.run.is_some_and(|run| run.surfaces_thinned == Some(false)) {
        writeln!(out, "  stopped before noisy surfaces were made thin: they are as thick as the noise of the depth")?;
    }
    if record.labels == LabelSource::None {
        writeln!(out, "  labels: none were used")?;
    }
    for setting in &record.settings {
        writeln!(out, "  {} = {}", setting.name, setting.value)?;
    }
    if let Some(segmentation) = &record.networks {
        print_networks(&mut out, segmentation, &record.views)?;
    }
    writeln!(out, "{:<28} {:>9} {:>12} {:>11}", "component", "points", "area mm2", "confidence")?;
    for c in record.components.iter().chain(&record.defects) {
        let area = c.area.map_or_else(|| "-".into(), |area| format!("{:.1}", area * 1e6));
        writeln!(out, "{:<28} {:>9} {area:>12} {:>11.3}", c.name, c.points, c.confidence)?;
    }
    if let Some(findings) = &record.findings {
        findings_report::print_findings(&mut out, findings)?;
    }
    if let Some(verdict) = &record.verdict {
        findings_report::print_verdict(&mut out, verdict)?;
    }
    if let Some(truth) = &record.truth {
        print_truth(&mut out, truth, record.labels != LabelSource::None)?;
    }
    writeln!(out, "written to {}", folder.display())
}

/// The views that were planned, and why no more were.
fn print_plan(out: &mut impl Write, plan: &PlanRecord) -> io::Result<()> {
    let targeted = plan.views.iter().filter(|view| matches!(view.purpose, PlanPurpose::Targeted { .. })).count();
    let stopped = plan.stopped.map_or_else(|| "cut off".to_owned(), |why| why.to_string());
    writeln!(
        out,
        "  views planned by {}: {} of the whole surface, {targeted} close looks; ended: {stopped}",
        plan.strategy.name(),
        plan.views.len() - targeted
    )?;
    if let Some(coverage) = &plan.coverage {
        let share =
            |area: f64| 100.0 * area / (coverage.measured + coverage.frontier + coverage.unreachable).max(1e-12);
        writeln!(
            out,
            "  surface measured {:.1} %, expected within reach {:.1} %, out of reach {:.1} % in {} larger pieces",
            share(coverage.measured),
            share(coverage.frontier),
            share(coverage.unreachable),
            coverage.unreachable_regions.len()
        )?;
    }
    Ok(())
}

/// A planned view, in one line.
pub(crate) fn of_planned(view: &PlannedView) -> String {
    let purpose = match &view.purpose {
        PlanPurpose::Overall => "of the whole surface".to_owned(),
        PlanPurpose::Targeted { regions } => format!("of {}", regions.join(", ")),
    };
    let gain = view.expected.map_or_else(String::new, |gain| {
        let [frontier, quality, labels] = [gain.frontier, gain.quality, gain.labels].map(|area| 1e6 * area);
        format!(": {frontier:.0} mm2 unknown, {quality:.0} mm2 better, {labels:.0} mm2 of labels")
    });
    let angle = view.table_angle.to_degrees();
    format!("view {}, {purpose}, is planned with the table at {angle:.0} degrees{gain}", view.view)
}

/// What became of a view, in one line.
pub(crate) fn of_view(view: &ViewRecord) -> String {
    let times: Vec<String> =
        view.timings.iter().map(|t| format!("{} {:.0} ms", t.stage.name(), 1e3 * t.seconds)).collect();
    let pose = match &view.registration {
        None => "without a pose",
        Some(RegistrationRecord::Icp { .. }) => "aligned with the model",
        Some(RegistrationRecord::KeptPrior { .. }) => "at the robot's pose, which the alignment did not improve",
        Some(RegistrationRecord::Kinematic) => "at the robot's pose",
        Some(RegistrationRecord::Relocalized { .. }) => "found in the model",
        Some(RegistrationRecord::CameraIsFrame) => "the frame of the model",
    };
    format!("view {}: {} points more, {pose}; {}", view.index, view.points_added, times.join(", "))
}

/// How the views got their poses.
fn print_poses(out: &mut impl Write, views: &[ViewRecord]) -> io::Result<()> {
    let mut counts = [
        ("aligned with the model", 0),
        ("at the robot's pose, which the alignment confirms or cannot improve", 0),
        ("at the robot's pose", 0),
        ("found in the model", 0),
        ("the frame of the model", 0),
    ];
    for registration in views.iter().filter(|v| v.accepted).filter_map(|v| v.registration.as_ref()) {
        let which = match registration {
            RegistrationRecord::Icp { .. } => 0,
            RegistrationRecord::KeptPrior { .. } => 1,
            RegistrationRecord::Kinematic => 2,
            RegistrationRecord::Relocalized { .. } => 3,
            RegistrationRecord::CameraIsFrame => 4,
        };
        counts[which].1 += 1;
    }
    let said: Vec<String> = counts.iter().filter(|(_, n)| *n > 0).map(|(what, n)| format!("{n} {what}")).collect();
    if said.is_empty() { Ok(()) } else { writeln!(out, "  poses: {}", said.join(", ")) }
}

/// How well the poses agree with the pictures.
fn print_photometric(out: &mut impl Write, figure: &PhotometricRecord) -> io::Result<()> {
    let support =
        format!("{} matches in {} of {} overlapping pairs of views", figure.matches, figure.pairs, figure.compared);
    let still = match figure.still {
        0 => String::new(),
        n => format!(", {n} of {} corners stand still with the camera", figure.searched),
    };
    match figure.error {
        Some(error) => {
            let prior = figure.prior_error.map_or_else(String::new, |e| format!(" (kinematic poses {e:.2} px)"));
            writeln!(out, "  pictures: the poses agree with them to {error:.2} px{prior}; {support}{still}")
        }
        None => {
            let why = figure.unknown.as_deref().unwrap_or("too few matches");
            writeln!(out, "  pictures: not known how well the poses agree with them: {why}; {support}{still}")
        }
    }
}

/// What labelled the views, how its uncertainty was computed and used, and how large it was.
fn print_networks(out: &mut impl Write, record: &NetworksRecord, views: &[ViewRecord]) -> io::Result<()> {
    let network = &record.network;
    let models = network.models.iter().map(|m| format!("{} {} ({} nets)", m.name, m.version, m.networks.len()));
    let models = models.collect::<Vec<_>>().join(", ");
    let engine = &network.engine;
    writeln!(out, "labels by {models} in {} {} on {}", engine.name, engine.version, engine.provider.name())?;
    let augmentations = network.augmentations.iter().map(|a| format!("{a:?}").to_lowercase()).collect::<Vec<_>>();
    writeln!(
        out,
        "  augmentations {} (seed {}), sigma = {} over M - {}, threshold {} (defects {}), k = {}, uncertain: {}",
        augmentations.join(" "),
        network.seed,
        format!("{:?}", network.statistic).to_lowercase(),
        network.ddof,
        network.threshold,
        network.defect_threshold,
        network.coverage,
        format!("{:?}", record.uncertain).to_lowercase(),
    )?;
    let said = || views.iter().filter_map(|v| v.networks.as_ref());
    let judged: Vec<_> = said().filter_map(|s| s.domain).collect();
    let outside: Vec<_> = judged.iter().filter(|domain| domain.outside).collect();
    let uncalibrated: Vec<&str> = network.models.iter().filter(|m| !m.calibrated).map(|m| m.name.as_str()).collect();
    if !uncalibrated.is_empty() {
        writeln!(
            out,
            "  domain: {} not calibrated: nothing says which views their labels can be believed for",
            uncalibrated.join(", ")
        )?;
    }
    if judged.is_empty() && said().next().is_some() {
        writeln!(out, "  domain: not known whether the views are like those that the networks were trained for")?;
    } else if let Some(worst) = outside.iter().max_by(|a, b| a.score.total_cmp(&b.score)) {
        writeln!(
            out,
            "  domain: {} of {} views are unlike those that the networks were trained for (score up to {:.1}, {:.1} is the \
             most; disagreement up to {}): their labels do not count",
            outside.len(),
            judged.len(),
            worst.score,
            worst.threshold,
            disagreement(outside.iter().map(|domain| **domain)),
        )?;
    } else if !judged.is_empty() {
        writeln!(out, "  domain: all {} views are like those that the networks were trained for", judged.len())?;
    }
    let tasks = [
        ("components", said().map(|s| s.components).collect::<Vec<_>>()),
        ("defects", said().filter_map(|s| s.defects).collect()),
    ];
    for (task, figures) in tasks.iter().filter(|(_, figures)| !figures.is_empty()) {
        let pixels: u64 = figures.iter().map(|f| f.foreground).sum();
        let uncertain: u64 = figures.iter().map(|f| f.uncertain).sum();
        // Means over the pixels of all views.
        let mean = |of: fn(&UncertaintyFigures) -> f64| {
            figures.iter().map(|f| of(f) * f.foreground as f64).sum::<f64>() / pixels.max(1) as f64
        };
        writeln!(
            out,
            "  {task}: sigma {:.4} (data {:.4}, model {:.4}), U {:.4}, 95 % of p in {:.3} .. {:.3}, uncertain {:.2} %",
            mean(|f| f.sigma),
            mean(|f| f.data),
            mean(|f| f.model),
            mean(|f| f.expanded),
            mean(|f| f.quantile_low),
            mean(|f| f.quantile_high),
            100.0 * uncertain as f64 / pixels.max(1) as f64,
        )?;
    }
    Ok(())
}

/// The largest disagreement of networks on views, and what would be the most.
fn disagreement(domains: impl Iterator<Item = DomainRecord>) -> String {
    let known = domains.filter_map(|d| Some((d.disagreement?, d.disagreement_threshold?)));
    known
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(|| "not known".into(), |(d, most)| format!("{d:.2}, {most:.2} is the most"))
}

fn print_truth(out: &mut impl Write, truth: &TruthRecord, labelled: bool) -> io::Result<()> {
    if labelled {
        print_labels(out, truth)?;
    }
    let millimetres = |m: Option<f64>| m.map_or_else(|| "-".into(), |m| format!("{:.3} mm", m * 1e3));
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
            let (rotation, translation) =
                (spread(poses.iter().map(|p| p.rotation)), spread(poses.iter().map(|p| p.translation)));
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
        let (hd95, mean) = (millimetres(ideal.hd95), millimetres(ideal.mean_error));
        if labelled {
            let accuracy = ideal.label_accuracy * 100.0;
            let loss = accuracy - truth.label_accuracy * 100.0;
            writeln!(
                out,
                "with the true poses: accuracy {accuracy:.2} %, HD95 {hd95}, ME {mean}; the poses cost {loss:.2} points of \
                 accuracy"
            )?;
        } else {
            writeln!(out, "with the true poses: HD95 {hd95}, ME {mean}")?;
        }
    }
    Ok(())
}

/// How true the labels are, class by class and all together.
fn print_labels(out: &mut impl Write, truth: &TruthRecord) -> io::Result<()> {
    for (what, classes) in [("components", &truth.components), ("defects", &truth.defects)] {
        if classes.is_empty() {
            continue;
        }
        let title = format!("{what} against truth");
        writeln!(out, "{title:<28} {:>9} {:>12} {:>14} {:>7}", "points", "accuracy %", "completeness %", "IoU")?;
        for c in classes {
            let (accuracy, completeness) = (c.accuracy * 100.0, c.completeness * 100.0);
            writeln!(out, "{:<28} {:>9} {accuracy:>12.2} {completeness:>14.2} {:>7.3}", c.name, c.points, c.iou)?;
        }
    }
    let (accuracy, completeness) = (truth.label_accuracy * 100.0, truth.label_completeness * 100.0);
    writeln!(out, "label accuracy {accuracy:.2} %, completeness {completeness:.2} %")
}

/// Median and largest.
fn spread(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let median = values.get(values.len() / 2).copied().unwrap_or(0.0);
    (median, values.last().copied().unwrap_or(0.0))
}
