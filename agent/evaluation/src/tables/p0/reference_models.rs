//! [Remanufacturing paper], Table 1: reconstructed models of four starter motors (C) against reference models (L),
//! after ten alignments each.
//!
//! There, C comes from five views of a Zivid One+ S at a robot and L from a hand-held laser scanner, over two million
//! points each; HD95, ME and MSE (printed as MCE there) are of sets of points, CD is the sum of the two means. Here the
//! motors, the camera and the robot are simulated and L is the true surface, sampled as densely. The published figures
//! stand beside ours to show the order of magnitude; they are of other parts, and of hardware.

use super::P0Error;
use crate::tables::inspect;
use crate::{AlignedEvaluation, MeasuredGeometry, Range, evaluate_aligned, ranges};
use semascan_inspection::spec::InspectionSpec;
use semascan_model::{PointFlags, SemanticCloud};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;
use std::io::{self, Write};

/// What is run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seed of each motor.
    pub motors: Vec<u64>,
    /// Views of each; the paper takes five.
    pub views: u32,
    /// Columns and rows of the camera.
    pub size: (u32, u32),
    /// Voxel edge in metres; as an inspection chooses it if absent.
    pub voxel: Option<f64>,
    /// Points that the true surface is sampled with.
    pub reference_points: usize,
    /// First seed of the alignments.
    pub seed: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            motors: vec![101, 102, 103, 104],
            views: 5,
            size: (1920, 1200),
            voxel: None,
            reference_points: 2_000_000,
            seed: 1,
        }
    }
}

/// A figure over the alignments: least, mean and greatest value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub max: f64,
}

/// One row of the table, in the paper's units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Whose figures.
    pub model: String,
    /// HD95, C to L, micrometres.
    pub hd95_c_to_l: Spread,
    /// HD95, L to C, micrometres.
    pub hd95_l_to_c: Spread,
    /// ME, C to L, micrometres.
    pub mean_error: Spread,
    /// MSE, C to L, square millimetres.
    pub mean_square_error: Spread,
    /// CD, millimetres.
    pub chamfer: Spread,
}

/// The table, ours and the published one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table1 {
    /// What was run.
    pub config: Config,
    /// How the figures are to be read.
    pub setting: String,
    /// Ours.
    pub ours: Vec<Row>,
    /// Points of each of our models, and alignments of ten that found a match.
    pub points: Vec<(usize, usize)>,
    /// The paper's.
    pub published: Vec<Row>,
}

/// The paper's Table 1 as printed: (min, max, mean) of HD95 both ways and ME in micrometres, MSE in square millimetres,
/// CD in millimetres.
const PUBLISHED: [[(f64, f64, f64); 5]; 4] = [
    [
        (623.2, 629.9, 627.9),
        (2004.0, 2008.0, 2007.0),
        (252.4, 256.1, 254.1),
        (0.3263, 0.3271, 0.32666),
        (0.7208, 0.7257, 0.7231),
    ],
    [
        (701.6, 747.2, 723.1),
        (8977.0, 9003.0, 8990.0),
        (303.1, 319.8, 311.1),
        (0.2612, 0.2714, 0.2657),
        (1.669, 1.691, 1.679),
    ],
    [
        (645.7, 648.0, 647.0),
        (5322.0, 5335.0, 5329.0),
        (282.9, 287.6, 285.3),
        (0.1842, 0.1859, 0.1851),
        (1.163, 1.167, 1.165),
    ],
    [
        (414.1, 424.6, 420.2),
        (4673.0, 4677.0, 4675.0),
        (157.4, 158.0, 157.5),
        (0.087, 0.088, 0.088),
        (0.8235, 0.8242, 0.8238),
    ],
];

/// Inspects and measures every motor; `done` is called after each.
///
/// # Errors
/// [`P0Error`] naming the motor.
pub fn run(config: &Config, mut done: impl FnMut()) -> Result<Table1, P0Error> {
    let (mut ours, mut points) = (Vec::new(), Vec::new());
    for motor in &config.motors {
        let (row, counts) = one(config, *motor)?;
        ours.push(row);
        points.push(counts);
        done();
    }
    Ok(Table1 { config: config.clone(), setting: setting(config), ours, points, published: published() })
}

/// What the figures are of.
fn setting(config: &Config) -> String {
    format!(
        "ours: virtual cell, motors {:?}, {} views of {}x{}, sensor noise of a Zivid-like camera, robot and table errors of a \
         calibrated cell, segment ICP and joint refinement; L = {} points of the true surface; distances between sets of \
         points, ten seeded alignments (global, then GICP). Published: four real motors, five views of a Zivid One+ S, L by \
         a laser scanner. Other parts and hardware: not comparable one by one",
        config.motors, config.views, config.size.0, config.size.1, config.reference_points
    )
}

fn one(config: &Config, motor: u64) -> Result<(Row, (usize, usize)), P0Error> {
    let (width, height) = config.size;
    let uri = format!("virtual:starter-motor?seed={motor}&views={}&size={width}x{height}&noise=zivid", config.views);
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri)?)?;
    let mut spec = InspectionSpec::default();
    spec.source.voxel_mm = config.voxel.map(|metres| metres * 1e3);
    let inspected = inspect(spec, Box::new(cell))?;
    let c = reconstructed(&inspected.cloud, motor);
    let truth = inspected.source.truth().ok_or(P0Error::NoView(motor))?;
    let l = MeasuredGeometry::sampled(
        &format!("truth of motor {motor}"),
        &truth.vertices,
        &truth.triangles,
        config.reference_points,
        motor,
    );
    let mut runs: Vec<AlignedEvaluation> = Vec::new();
    let mut refused = None;
    for run in evaluate_aligned(&c, &l, 1e-3, config.seed) {
        match run {
            Ok(run) => runs.push(run),
            Err(source) => refused = refused.or(Some(source)),
        }
    }
    if let (true, Some(source)) = (runs.is_empty(), refused) {
        return Err(P0Error::Align { motor, source });
    }
    let counts = (c.points.len(), runs.len());
    Ok((row(&format!("motor {motor}"), &ranges(&runs)), counts))
}

/// The model's points, without strays and without the turntable.
fn reconstructed(cloud: &SemanticCloud, motor: u64) -> MeasuredGeometry {
    let kept = |i: &usize| !cloud.flags[*i].has(PointFlags::OUTLIER | PointFlags::BACKGROUND);
    let kept: Vec<usize> = (0..cloud.len()).filter(kept).collect();
    let points = kept.iter().map(|&i| cloud.positions[i]).collect();
    let normals = kept.iter().map(|&i| cloud.normals[i]).collect();
    MeasuredGeometry::of_points(&format!("model of motor {motor}"), points, normals)
}

fn row(model: &str, ranges: &[Range]) -> Row {
    let of = |name: &str, unit: f64| {
        let range = ranges.iter().find(|r| r.name == name);
        range.map_or(Spread { min: f64::NAN, mean: f64::NAN, max: f64::NAN }, |r| Spread {
            min: r.min * unit,
            mean: r.mean * unit,
            max: r.max * unit,
        })
    };
    Row {
        model: model.to_owned(),
        hd95_c_to_l: of("hd95_a_to_b", 1e6),
        hd95_l_to_c: of("hd95_b_to_a", 1e6),
        mean_error: of("mean_error_a_to_b", 1e6),
        mean_square_error: of("mean_square_error_a_to_b", 1e6),
        chamfer: of("chamfer", 1e3),
    }
}

fn published() -> Vec<Row> {
    let row = |(i, figures): (usize, &[(f64, f64, f64); 5])| {
        let [hd95_c_to_l, hd95_l_to_c, mean_error, mean_square_error, chamfer] =
            figures.map(|(min, max, mean)| Spread { min, mean, max });
        let model = format!("P0, 3D model {}", i + 1);
        Row { model, hd95_c_to_l, hd95_l_to_c, mean_error, mean_square_error, chamfer }
    };
    PUBLISHED.iter().enumerate().map(row).collect()
}

/// Writes the table for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &Table1) -> io::Result<()> {
    writeln!(out, "P0, Table 1: min / mean / max over ten alignments")?;
    writeln!(
        out,
        "{:<18} {:>24} {:>24} {:>24} {:>24} {:>24}",
        "", "HD95 C->L um", "HD95 L->C um", "ME C->L um", "MSE C->L mm2", "CD mm"
    )?;
    for row in report.ours.iter().chain(&report.published) {
        let cell = |s: &Spread, digits: usize| format!("{:.digits$} / {:.digits$} / {:.digits$}", s.min, s.mean, s.max);
        writeln!(
            out,
            "{:<18} {:>24} {:>24} {:>24} {:>24} {:>24}",
            row.model,
            cell(&row.hd95_c_to_l, 1),
            cell(&row.hd95_l_to_c, 0),
            cell(&row.mean_error, 1),
            cell(&row.mean_square_error, 4),
            cell(&row.chamfer, 3)
        )?;
    }
    for (row, (points, matched)) in report.ours.iter().zip(&report.points) {
        writeln!(out, "{}: {points} points, {matched} of 10 alignments found a match", row.model)?;
    }
    writeln!(out, "{}", report.setting)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_table_is_made_and_printed() {
        let config =
            Config { motors: vec![3], views: 5, size: (240, 180), reference_points: 40_000, ..Config::default() };
        let mut done = 0;
        let report = run(&config, || done += 1).expect("a table");
        assert_eq!((done, report.ours.len(), report.published.len()), (1, 1, 4));
        let (points, matched) = report.points[0];
        assert!(points > 3000 && matched >= 8, "{points} points, {matched} matched");
        let ours = &report.ours[0];
        let me = ours.mean_error;
        assert!(me.min <= me.mean && me.mean <= me.max && (10.0..1500.0).contains(&me.mean), "{me:?}");
        assert!(ours.chamfer.mean * 1e3 > me.mean, "CD holds both ways: {ours:?}");
        let mut text = Vec::new();
        print(&mut text, &report).expect("printed");
        let text = String::from_utf8(text).expect("UTF-8");
        for word in ["motor 3", "P0, 3D model 4", "157.4 / 157.5 / 158.0", "not comparable"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
}
