//! `semascan evaluate A B`: metrics of a model against a reference, each with its convention. With `--photometric`: the poses
//! of inspection A against the pictures of source B. With a `truth.json` as B: against the true poses of a recording.

use super::spec_args::UnitArg;
use super::{Failure, numbers, photometric, pose_truth};
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use nalgebra::Isometry3;
use semascan_evaluation::{
    AlignedEvaluation, Evaluation, MeasuredGeometry, Range, Scale, evaluate, evaluate_aligned, figures, ranges,
};
use semascan_formats::regular_file;
use semascan_geometry::measure::{CONVENTIONS, ClassScore, Comparison, SEMANTIC_CONVENTIONS};
use semascan_inspection::record::pose_record;
use semascan_inspection::spec::LengthUnit;
use semascan_model::choice::possible_instead;
use semascan_store::check_beside_record;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Extensions that can be read.
const FORMATS: [&str; 9] = ["ply", "pcd", "obj", "stl", "gltf", "glb", "e57", "las", "laz"];

/// B has surface that A lacks if the 95th percentile of distances from B to A is so many times that from A to B.
const UNSEEN: f64 = 3.0;

/// Arguments of `semascan evaluate`.
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// The model: a cloud (PLY, PCD, E57, LAS, LAZ) or a mesh (PLY, OBJ, STL, glTF, GLB); with --photometric, or where B is a truth.json, the
    /// folder of an inspection
    a: PathBuf,
    /// The reference it is judged against, likewise; with --photometric the source that was inspected; or the truth.json of a
    /// simulated turntable recording, by which the poses of A are judged
    b: PathBuf,
    /// Judge poses by the pictures, without any truth: corners of one view, carried by depth and poses, against where they
    /// are in others, in pixels
    #[arg(long, conflicts_with_all = ["align", "scale_a", "scale_b"])]
    photometric: bool,
    /// Other poses of the same views, judged on the same matches: an inspection's folder, or JSON with `views` that have
    /// `index`, `accepted`, `pose`
    #[arg(long, value_name = "FILE", requires = "photometric")]
    poses: Vec<PathBuf>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Align A with B ten times first (global, then local registration) and give the range of every figure
    #[arg(long)]
    align: bool,
    /// Distance of precision, recall and F-score in millimetres
    #[arg(
        long, value_name = "MM", default_value_t = 1.0,
        value_parser = numbers::length::<f64>, allow_negative_numbers = true
    )]
    tau: f64,
    /// Points that a mesh is sampled with
    #[arg(
        long, value_name = "N", default_value_t = 200_000,
        value_parser = numbers::samples(), allow_negative_numbers = true
    )]
    samples: usize,
    /// Seed of samples and alignments
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Unit of both files [default: assumed from the size of each, and said]
    #[arg(long, value_enum, conflicts_with_all = ["scale_a", "scale_b"])]
    unit: Option<UnitArg>,
    /// What one unit of A's coordinates is in metres (0.001 for a file in millimetres)
    #[arg(long, value_name = "METRES", value_parser = numbers::scale, allow_negative_numbers = true)]
    scale_a: Option<f64>,
    /// What one unit of B's coordinates is in metres
    #[arg(long, value_name = "METRES", value_parser = numbers::scale, allow_negative_numbers = true)]
    scale_b: Option<f64>,
}

impl EvaluateArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.photometric {
            return photometric::judge(&self.a, &self.poses, &self.b, self.unit.map(LengthUnit::from), self.json);
        }
        let wrong = |e: anyhow::Error| Err(Failure::Call(e));
        if self.b.extension().is_some_and(|extension| extension == "json") {
            if self.align || self.unit.is_some() || self.scale_a.is_some() || self.scale_b.is_some() {
                return wrong(anyhow!(
                    "--align, --unit, --scale-a and --scale-b are for clouds and meshes, not for poses"
                ));
            }
            return pose_truth::judge(&self.a, &self.b, self.json);
        }
        for path in [&self.a, &self.b] {
            if path.is_dir() {
                let mesh = path.join("mesh.ply");
                let hint = if mesh.is_file() { format!(", such as {}", mesh.display()) } else { String::new() };
                return wrong(anyhow!("{}: is a folder; name a cloud or a mesh in it{hint}", path.display()));
            }
            regular_file::check(path).with_context(|| path.display().to_string())?;
            let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
            if !FORMATS.contains(&extension.as_str()) {
                let instead = possible_instead(&extension, &FORMATS);
                return wrong(anyhow!("{}: cannot be read by its extension: {instead}", path.display()));
            }
        }
        for path in [&self.a, &self.b] {
            check_beside_record(path)?;
        }
        let unit = self.unit.map(|unit| LengthUnit::from(unit).in_metres());
        let (model, reference) = ((self.a.as_path(), unit.or(self.scale_a)), (self.b.as_path(), unit.or(self.scale_b)));
        let [a, b] = MeasuredGeometry::read_pair(model, reference, self.samples, self.seed)?;
        if self.align { self.protocol(&a, &b) } else { self.as_they_stand(&a, &b) }
    }

    fn as_they_stand(&self, a: &MeasuredGeometry, b: &MeasuredGeometry) -> Result<(), Failure> {
        let found = evaluate(a, b, &Isometry3::identity(), self.tau * 1e-3)
            .with_context(|| format!("{} and {}: nothing can be measured", self.a.display(), self.b.display()))?;
        let mut out = Stderr::default();
        self.head(&mut out, a, b, "as they stand, without alignment")?;
        for (name, value) in figures(&found.comparison) {
            writeln!(out, "{name:<26} {:>12}", readable(name, value))?;
        }
        if let Some(note) = unseen(&found.comparison) {
            writeln!(out, "{note}")?;
        }
        classes(&mut out, &found.classes)?;
        self.conventions(&mut out, &found.classes)?;
        let mut report = self.report(a, b, &found.classes);
        report["metrics"] = json!(found.comparison);
        report["classes"] = classes_json(&found.classes);
        self.print(&report)
    }

    fn protocol(&self, a: &MeasuredGeometry, b: &MeasuredGeometry) -> Result<(), Failure> {
        let results = evaluate_aligned(a, b, self.tau * 1e-3, self.seed);
        let failed: Vec<String> = results.iter().filter_map(|r| r.as_ref().err().map(ToString::to_string)).collect();
        let runs: Vec<AlignedEvaluation> = results.into_iter().filter_map(Result::ok).collect();
        let Some(first) = runs.first() else {
            let why = failed.first().cloned().unwrap_or_default();
            return Err(Failure::Work(anyhow!(
                "{} could not be aligned with {}: {why}",
                self.a.display(),
                self.b.display()
            )));
        };
        let ranges = ranges(&runs);
        let mut out = Stderr::default();
        let how =
            format!("{} alignments (global, then GICP), {} without a match", runs.len() + failed.len(), failed.len());
        self.head(&mut out, a, b, &how)?;
        writeln!(out, "{:<26} {:>12} {:>12} {:>12}", "", "min", "mean", "max")?;
        for r in &ranges {
            let [min, mean, max] = [r.min, r.mean, r.max].map(|v| readable(r.name, v));
            writeln!(out, "{:<26} {min:>12} {mean:>12} {max:>12}", r.name)?;
        }
        classes(&mut out, &first.evaluation.classes)?;
        self.conventions(&mut out, &first.evaluation.classes)?;
        let mut report = self.report(a, b, &first.evaluation.classes);
        report["alignments"] = runs.iter().map(run_json).collect();
        report["without_match"] = json!(failed);
        report["ranges"] = ranges
            .iter()
            .map(|r: &Range| (r.name.to_owned(), json!({ "min": r.min, "mean": r.mean, "max": r.max })))
            .collect::<serde_json::Map<_, _>>()
            .into();
        self.print(&report)
    }

    fn head(&self, out: &mut impl Write, a: &MeasuredGeometry, b: &MeasuredGeometry, how: &str) -> io::Result<()> {
        for (name, model) in [("A", a), ("B", b)] {
            let from = match model.triangles {
                0 => format!("{} points ({} marked or not finite are left out)", model.points.len(), model.left_out),
                n => format!("{n} triangles, {} points by area, seed {}", model.points.len(), self.seed),
            };
            writeln!(out, "{name}: {}, {}, {from}", model.path.display(), model.kind())?;
            match model.scale {
                Scale::Given(metres) => writeln!(out, "   one unit is {metres} m")?,
                Scale::Assumed(unit) => {
                    writeln!(out, "   one unit is taken for 1 {}: say another with --unit", unit.name())?;
                }
            }
        }
        writeln!(out, "{how}; distances to a mesh are point to triangle; tau {} mm", self.tau)
    }

    fn conventions(&self, out: &mut impl Write, classes: &[ClassScore]) -> io::Result<()> {
        let semantic = if classes.is_empty() { &[][..] } else { &SEMANTIC_CONVENTIONS };
        for (name, text) in CONVENTIONS.iter().chain(semantic) {
            writeln!(out, "  {name}: {text}")?;
        }
        Ok(())
    }

    fn report(&self, a: &MeasuredGeometry, b: &MeasuredGeometry, classes: &[ClassScore]) -> Value {
        let model = |m: &MeasuredGeometry, path: &Path| {
            json!({
                "path": path.display().to_string(), "kind": m.kind(), "points": m.points.len(),
                "left_out": m.left_out, "triangles": m.triangles,
                "scale": m.scale.in_metres(), "scale_assumed": matches!(m.scale, Scale::Assumed(_)),
            })
        };
        let semantic = if classes.is_empty() { &[][..] } else { &SEMANTIC_CONVENTIONS };
        json!({
            "a": model(a, &self.a), "b": model(b, &self.b), "tau": self.tau * 1e-3, "seed": self.seed,
            "conventions": CONVENTIONS.iter().chain(semantic).collect::<Vec<_>>(),
        })
    }

    fn print(&self, report: &Value) -> Result<(), Failure> {
        if self.json {
            print_json(report)?;
        }
        Ok(())
    }
}

/// What it means where much of the reference is far from the model, though the model is near the reference.
fn unseen(comparison: &Comparison) -> Option<String> {
    let (to_b, to_a) = (comparison.a_to_b.hd95, comparison.b_to_a.hd95);
    (to_a > comparison.tau && to_a > UNSEEN * to_b).then(|| {
        format!(
            "B has surface that A lacks: {:.1} % of B is farther than {} mm from A, while A is near B. Where B is the truth, that \
             is what no view saw, such as the underside: it counts in b_to_a, chamfer, recall and f_score, and says nothing \
             of how true the seen surface is, which a_to_b does",
            100.0 * (1.0 - comparison.recall),
            comparison.tau * 1e3
        )
    })
}

/// Millimetres, square millimetres or per cent.
fn readable(name: &str, value: f64) -> String {
    if name.starts_with("mean_square") {
        format!("{:.5} mm2", value * 1e6)
    } else if name.starts_with("precision") || name == "recall" || name == "f_score" {
        format!("{:.2} %", value * 100.0)
    } else {
        format!("{:.4} mm", value * 1e3)
    }
}

fn classes(out: &mut impl Write, scores: &[ClassScore]) -> io::Result<()> {
    if scores.is_empty() {
        return Ok(());
    }
    writeln!(out, "class    points  accuracy  completeness  precision   recall      IoU")?;
    for s in scores {
        let [a, c, p, r, i] =
            [s.accuracy(), s.completeness(), s.precision(), s.recall(), s.iou()].map(|v| format!("{v:.4}"));
        writeln!(out, "{:<5} {:>9} {a:>9} {c:>13} {p:>10} {r:>8} {i:>8}", s.class, s.points)?;
    }
    Ok(())
}

fn classes_json(scores: &[ClassScore]) -> Value {
    let one = |s: &ClassScore| {
        json!({
            "class": s.class, "points": s.points, "retained": s.retained, "correct": s.correct, "wrongly": s.wrongly,
            "accuracy": s.accuracy(), "completeness": s.completeness(), "precision": s.precision(),
            "recall": s.recall(), "iou": s.iou(),
        })
    };
    scores.iter().map(one).collect()
}

fn run_json(run: &AlignedEvaluation) -> Value {
    let Evaluation { comparison, classes } = &run.evaluation;
    json!({
        "seed": run.seed, "overlap": run.overlap, "b_from_a": pose_record(&run.b_from_a),
        "metrics": comparison, "classes": classes_json(classes),
    })
}
