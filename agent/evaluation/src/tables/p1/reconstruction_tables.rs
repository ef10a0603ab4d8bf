//! What the runs say together: means by object, and paired differences between methods.

use super::{Config, Dataset, Method, MethodScore, Setting, TableObject, published};
use serde::Serialize;

/// One object in one cell.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// The object.
    pub object: String,
    /// Where it comes from.
    pub dataset: Dataset,
    /// The cell.
    pub seed: u64,
    /// Figures in the order of [`Method::ALL`].
    pub methods: Vec<MethodScore>,
}

/// Means over runs of one method.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Aggregate {
    /// The method.
    pub method: Method,
    /// See [`MethodScore`].
    pub c2c_mm: f64,
    /// See [`MethodScore`].
    pub precision_1mm: f64,
    /// See [`MethodScore`].
    pub mask_iou: f64,
    /// Share of views that the gravity-centre test refused.
    pub misidentified: f64,
    /// See [`MethodScore`].
    pub segmentation_ms: f64,
    /// See [`MethodScore`].
    pub mapping_ms: f64,
}

/// One object.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectRow {
    /// Its name.
    pub object: String,
    /// Where it comes from.
    pub dataset: Dataset,
    /// In the order of [`Method::ALL`].
    pub methods: Vec<Aggregate>,
    /// The paper's C2C, millimetres, where it has the object. Other hardware, real objects: not comparable.
    pub published_c2c_mm: Option<[f64; 4]>,
    /// The paper's mask IoU before and after fusion, per cent.
    pub published_mask_iou: Option<[f64; 2]>,
}

/// Paired difference between two methods over the same runs: second minus first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Runs.
    pub n: usize,
    /// Mean difference.
    pub mean: f64,
    /// Lower end of the 95 % interval (Student).
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Differences between a method and the one before it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Step {
    /// From this method ...
    pub from: Method,
    /// ... to this one.
    pub to: Method,
    /// C2C, millimetres.
    pub c2c_mm: Difference,
    /// Share within 1 mm.
    pub precision_1mm: Difference,
    /// Mask IoU.
    pub mask_iou: Difference,
}

/// The tables.
#[derive(Clone, Debug, Serialize)]
pub struct ReconstructionTables {
    /// What was run, for people.
    pub setting: String,
    /// How figures are taken.
    pub conventions: Vec<String>,
    /// Runs of each object.
    pub seeds: u64,
    /// Views of each run.
    pub views: u32,
    /// Tables 3 and 4, and the motors.
    pub objects: Vec<ObjectRow>,
    /// Over all objects, in the order of [`Method::ALL`].
    pub overall: Vec<Aggregate>,
    /// Each method against the one before it, and the last against the first.
    pub steps: Vec<Step>,
    /// Objects whose C2C by LCCCP + SICP is below that of mask only.
    pub better_than_mask_only: usize,
    /// Mean IoU of the masks after LCCCP fusion less that before, percentage points.
    pub mask_iou_gain_points: f64,
    /// The paper's Table 5: CPU milliseconds a view of segmentation and mapping, by method.
    pub published_cpu_ms: Vec<[f64; 2]>,
    /// Every run.
    pub runs: Vec<Run>,
}

impl ReconstructionTables {
    pub(super) fn new(config: &Config, objects: &[TableObject], runs: Vec<Run>) -> Self {
        let rows: Vec<ObjectRow> = objects
            .iter()
            .map(|o| {
                let own: Vec<&Run> = runs.iter().filter(|r| r.object == o.name).collect();
                ObjectRow {
                    object: o.name.clone(),
                    dataset: o.dataset,
                    methods: aggregate(&own, config.views),
                    published_c2c_mm: published::c2c(&o.name),
                    published_mask_iou: published::mask_iou(&o.name),
                }
            })
            .collect();
        let overall = aggregate(&runs.iter().collect::<Vec<_>>(), config.views);
        let last = Method::ALL.len() - 1;
        let pairs = (1..=last).map(|k| (k - 1, k)).chain([(0, last)]);
        let better = rows.iter().filter(|r| r.methods[last].c2c_mm < r.methods[0].c2c_mm).count();
        Self {
            setting: setting(config),
            conventions: CONVENTIONS.map(str::to_owned).to_vec(),
            seeds: config.seeds,
            views: config.views,
            better_than_mask_only: better,
            mask_iou_gain_points: 100.0 * (overall[last].mask_iou - overall[0].mask_iou),
            steps: pairs.map(|(a, b)| step(&runs, a, b)).collect(),
            published_cpu_ms: Method::ALL.map(published::cpu_ms).to_vec(),
            objects: rows,
            overall,
            runs,
        }
    }
}

/// How the figures are to be read.
const CONVENTIONS: [&str; 4] = [
    "C2C: mean distance of the object's points from its true surface (point to triangle), after ICP to it; millimetres",
    "3D IoU: share of the object's points within 1 mm of the true surface (P1 calls it so; it is a precision)",
    "mask IoU: intersection over union of the mask and the true mask, mean over views and classes",
    "CPU: one thread; segmentation is its geometric part, as there is no network here; mapping is normals, registration, \
     fusion and stitching",
];

fn setting(config: &Config) -> String {
    let Setting { size, errors, sensor } = config.setting;
    format!(
        "virtual cell, {}x{}, {} views around each object, depth noise {:.2} mm and ripple {:.2} mm at 0.5 m, robot off by \
         {:.2} deg and {:.2} mm an axis and view, hand-eye calibration by {:.2} deg and {:.2} mm; masks spoiled by ragged \
         borders, holes and class flips (one setting, seeded); P1 used a RealSense D435 on a UR10, 16 views and Mask R-CNN: \
         its figures stand beside ours for orientation only",
        size.0,
        size.1,
        config.views,
        sensor.sigma * 1e3,
        sensor.ripple * 1e3,
        errors.robot.0.to_degrees(),
        errors.robot.1 * 1e3,
        errors.hand_eye.0.to_degrees(),
        errors.hand_eye.1 * 1e3,
    )
}

fn aggregate(runs: &[&Run], views: u32) -> Vec<Aggregate> {
    let n = runs.len().max(1) as f64;
    let of = |(k, method): (usize, Method)| {
        let mean = |f: fn(&MethodScore) -> f64| runs.iter().map(|r| f(&r.methods[k])).sum::<f64>() / n;
        Aggregate {
            method,
            c2c_mm: mean(|m| m.c2c_mm),
            precision_1mm: mean(|m| m.precision_1mm),
            mask_iou: mean(|m| m.mask_iou),
            misidentified: mean(|m| f64::from(m.misidentified)) / f64::from(views.max(1)),
            segmentation_ms: mean(|m| m.segmentation_ms),
            mapping_ms: mean(|m| m.mapping_ms),
        }
    };
    Method::ALL.into_iter().enumerate().map(of).collect()
}

fn step(runs: &[Run], a: usize, b: usize) -> Step {
    let of = |f: fn(&MethodScore) -> f64| {
        paired(&runs.iter().map(|r| f(&r.methods[b]) - f(&r.methods[a])).collect::<Vec<_>>())
    };
    Step {
        from: Method::ALL[a],
        to: Method::ALL[b],
        c2c_mm: of(|m| m.c2c_mm),
        precision_1mm: of(|m| m.precision_1mm),
        mask_iou: of(|m| m.mask_iou),
    }
}

/// Mean of differences with its 95 % interval.
fn paired(differences: &[f64]) -> Difference {
    let n = differences.len();
    let mean = differences.iter().sum::<f64>() / n.max(1) as f64;
    if n < 2 {
        return Difference { n, mean, low: f64::NEG_INFINITY, high: f64::INFINITY };
    }
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let half = student_975(n as f64 - 1.0) * (variance / n as f64).sqrt();
    Difference { n, mean, low: mean - half, high: mean + half }
}

/// The 97.5 % quantile of Student's distribution: exact for one and two degrees of freedom, else Hill's expansion about
/// the normal quantile (Abramowitz and Stegun 26.7.5).
fn student_975(freedom: f64) -> f64 {
    if freedom < 1.5 {
        return 12.706_204_736;
    }
    if freedom < 2.5 {
        return 4.302_652_730;
    }
    let z = 1.959_963_985_f64;
    let g1 = (z.powi(3) + z) / 4.0;
    let g2 = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let g3 = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    let g4 = (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z) / 92160.0;
    z + g1 / freedom + g2 / freedom.powi(2) + g3 / freedom.powi(3) + g4 / freedom.powi(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, t) in [(1.0, 12.706), (2.0, 4.303), (3.0, 3.182), (4.0, 2.776), (9.0, 2.262), (129.0, 1.979)] {
            assert!((student_975(freedom) - t).abs() < 0.02, "{freedom}: {}", student_975(freedom));
        }
    }

    #[test]
    fn the_interval_of_a_worked_example() {
        let d = paired(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        // s = 1.5811, t(4) = 2.776: half width 1.963.
        assert!((d.mean - 3.0).abs() < 1e-12 && (d.high - 4.963).abs() < 0.01 && (d.low - 1.037).abs() < 0.01, "{d:?}");
        assert_eq!(paired(&[2.0]).high, f64::INFINITY);
    }
}
