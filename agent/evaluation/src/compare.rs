//! One model against another: as they stand, or by a published protocol after ten seeded alignments.
//!
//! [Remanufacturing paper], Table 1: "C as well as L are registered 10 times using a global (RANSAC) followed by a
//! local (ICP) approach. All these registration results are then used to calculate the minimum, maximum, and mean
//! metric values." Here global registration draws motions from consistent pairs of features [Chen 2022], and GICP
//! [Segal 2009] is the local one.

use super::MeasuredGeometry;
use nalgebra::{Isometry3, Point3};
use semascan_geometry::measure::{ClassScore, Comparison, LabelledPoint, class_scores};
use semascan_perception::register::gicp::{self, GicpConfig};
use semascan_perception::register::global::{CloudInput, GlobalConfig, GlobalError, GlobalMatch, register_globally};
use semascan_perception::register::{CloudError, SurfelCloud};

/// Alignments of the protocol.
pub const ALIGNMENTS: u64 = 10;
/// The local alignment's grid is this much finer than that of the global one.
const FINER: f64 = 3.0;
/// Neighbours that its normals are fitted to.
const NEIGHBOURS: usize = 16;

/// Figures of A against B.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Geometry.
    pub comparison: Comparison,
    /// Labels by class; empty where one of the models has none.
    pub classes: Vec<ClassScore>,
}

/// One alignment of A with B and what it leads to.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedEvaluation {
    /// Seed of the alignment.
    pub seed: u64,
    /// The alignment.
    pub b_from_a: Isometry3<f64>,
    /// Share of the smaller model that lies on the other, on the grid of the global registration.
    pub overlap: f64,
    /// The figures.
    pub evaluation: Evaluation,
}

/// Why models could not be aligned.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AlignError {
    /// Global registration failed.
    #[error(transparent)]
    Global(#[from] GlobalError),
    /// One of the models has too little surface for the local alignment.
    #[error("model {model}: {source}")]
    Cloud {
        /// A or B.
        model: char,
        /// Why.
        source: CloudError,
    },
}

/// Figures of `a`, moved by `b_from_a`, against `b`. `tau` is the distance of precision and recall in metres. `None`
/// where nothing can be measured, which [`MeasuredGeometry::read_pair`] rules out.
pub fn evaluate(a: &MeasuredGeometry, b: &MeasuredGeometry, b_from_a: &Isometry3<f64>, tau: f64) -> Option<Evaluation> {
    let place = |by: &Isometry3<f64>, points: &[[f64; 3]]| -> Vec<[f64; 3]> {
        points.iter().map(|p| (by * Point3::from(*p)).coords.into()).collect()
    };
    let forth = b.nearest(&place(b_from_a, &a.exact_points));
    let back = a.nearest(&place(&b_from_a.inverse(), &b.exact_points));
    let distances =
        |found: &[Option<(f64, u32)>]| -> Vec<f64> { found.iter().map(|n| n.map_or(f64::NAN, |n| n.0)).collect() };
    let judged = forth.iter().zip(&a.labels).filter_map(|(n, (given, retained))| {
        let truth = *b.target_labels.get(n.as_ref()?.1 as usize)?;
        Some(LabelledPoint { truth, given: *given, retained: *retained })
    });
    Some(Evaluation {
        comparison: Comparison::new(&distances(&forth), &distances(&back), tau)?,
        classes: class_scores(judged),
    })
}

/// The protocol: the figures after each of [`ALIGNMENTS`] alignments, with the seeds from `seed` on.
///
/// # Errors
/// For each alignment on its own.
pub fn evaluate_aligned(
    a: &MeasuredGeometry,
    b: &MeasuredGeometry,
    tau: f64,
    seed: u64,
) -> Vec<Result<AlignedEvaluation, AlignError>> {
    let mut fine = None;
    (0..ALIGNMENTS).map(|k| seed.wrapping_add(k)).map(|seed| aligned(a, b, tau, seed, &mut fine)).collect()
}

fn aligned(
    a: &MeasuredGeometry,
    b: &MeasuredGeometry,
    tau: f64,
    seed: u64,
    fine: &mut Option<(SurfelCloud, SurfelCloud)>,
) -> Result<AlignedEvaluation, AlignError> {
    // Both are models of one part, and parts of revolution leave directions open.
    let config = GlobalConfig { seed, max_unconstrained: 3, ..GlobalConfig::default() };
    let GlobalMatch { target_from_source, overlap, voxel, .. } = register_globally(&input(a), &input(b), &config)?;
    if fine.is_none() {
        let make = |m: &MeasuredGeometry, model| {
            SurfelCloud::new(&m.points, m.facing(), voxel / FINER, NEIGHBOURS)
                .map_err(|source| AlignError::Cloud { model, source })
        };
        *fine = Some((make(a, 'A')?, make(b, 'B')?));
    }
    let local =
        fine.as_ref().and_then(|(a, b)| gicp::align(a, b, &target_from_source, &GicpConfig::within(voxel)).ok());
    // Where the local alignment has nothing to hold, the global one stands.
    let b_from_a = local.map_or(target_from_source, |fit| fit.target_from_source);
    let evaluation = evaluate(a, b, &b_from_a, tau).ok_or(GlobalError::Source(CloudError::Empty))?;
    Ok(AlignedEvaluation { seed, b_from_a, overlap, evaluation })
}

fn input(model: &MeasuredGeometry) -> CloudInput<'_> {
    CloudInput { points: &model.points, facing: model.facing() }
}

/// The figures of a comparison by name, for tables and summaries: metres, square metres, shares.
pub fn figures(c: &Comparison) -> [(&'static str, f64); 13] {
    [
        ("mean_error_a_to_b", c.a_to_b.mean_error),
        ("mean_error_b_to_a", c.b_to_a.mean_error),
        ("mean_square_error_a_to_b", c.a_to_b.mean_square_error),
        ("mean_square_error_b_to_a", c.b_to_a.mean_square_error),
        ("hd95_a_to_b", c.a_to_b.hd95),
        ("hd95_b_to_a", c.b_to_a.hd95),
        ("hausdorff_a_to_b", c.a_to_b.hausdorff),
        ("hausdorff_b_to_a", c.b_to_a.hausdorff),
        ("chamfer", c.chamfer),
        ("precision_1mm", c.precision_1mm),
        ("precision", c.precision),
        ("recall", c.recall),
        ("f_score", c.f_score),
    ]
}

/// Least, mean and greatest value of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Name of the figure.
    pub name: &'static str,
    /// Least value.
    pub min: f64,
    /// Mean value.
    pub mean: f64,
    /// Greatest value.
    pub max: f64,
}

/// Ranges of all figures over several alignments; empty without any.
pub fn ranges(runs: &[AlignedEvaluation]) -> Vec<Range> {
    let Some(first) = runs.first() else { return Vec::new() };
    let names = figures(&first.evaluation.comparison).map(|f| f.0);
    let column = |k: usize| runs.iter().map(move |r| figures(&r.evaluation.comparison)[k].1);
    let range = |(k, name)| Range {
        name,
        min: column(k).fold(f64::INFINITY, f64::min),
        mean: column(k).sum::<f64>() / runs.len() as f64,
        max: column(k).fold(f64::NEG_INFINITY, f64::max),
    };
    names.into_iter().enumerate().map(range).collect()
}
