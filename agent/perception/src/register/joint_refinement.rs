//! All views at once: the last view must meet the first (loop refinement at the end of an inspection).
//!
//! A small pose graph whose edges are not fixed measurements but live surfaces: every pair of views that see common
//! ground is linearised projectively like a single ICP, and one Gauss-Newton step moves all cameras together, each held
//! by its kinematic prior. Errors that sequential registration laid onto late views are spread over the whole turn, and
//! a sensor's ripple, which differs from view to view, averages out.

use super::correspondences::{Gate, Linearised, linearise};
use super::degeneracy::project_out_degenerate;
use super::model_view::ModelView;
use super::se3::{about, exp, halves, log, turned};
use super::source_points::SourcePoints;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3};
use rayon::prelude::*;

/// Most other views that a view is paired with: enough for closure, and time stays linear in the number of views.
const MOST_PARTNERS: usize = 12;
/// Least share of a view's points on another view for the two to be paired.
const LEAST_OVERLAP: f64 = 0.1;
/// Gates of the rounds in metres per metre of distance from the camera: from drift to noise.
const ROUNDS: [f64; 8] = [6e-3, 4e-3, 3e-3, 2e-3, 2e-3, 2e-3, 2e-3, 2e-3];
/// Tukey's constant in standard deviations.
const TUKEY: f64 = 4.685;
/// Smallest standard deviation that residuals are believed to have, metres.
const SIGMA_FLOOR: f64 = 5e-6;
/// Points that decide whether two views overlap.
const PROBES: usize = 1500;
/// Fewest pairs that make an edge.
const FEWEST_PAIRS: u32 = 200;
/// A round that moves no object by more ends the refinement, metres.
const STILL: f64 = 1e-6;

/// What the refinement keeps of a view: a coarse picture of its surface, and its prior.
#[derive(Clone, Debug)]
pub struct RefinedView {
    /// Its surface as a target; the pose in it is the current one.
    pub surface: ModelView,
    /// The points that are matched into other views.
    pub points: SourcePoints,
    /// Pose from kinematics.
    pub prior: Isometry3<f64>,
    /// Over (rotation, translation), camera frame.
    pub covariance: Matrix6<f64>,
}

/// What the refinement did.
#[derive(Clone, Debug)]
pub struct JointRefinement {
    /// New `table_from_camera`, one a view.
    pub table_from_camera: Vec<Isometry3<f64>>,
    /// Pairs of views that were matched.
    pub edges: usize,
    /// Rounds.
    pub rounds: u32,
    /// Root mean truncated square distance between overlapping views before, metres.
    pub fit_before: f64,
    /// The same after.
    pub fit_after: f64,
}

/// Settings shared with the single-view ICP.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointConfig {
    pub(super) weakest: f64,
    pub(super) same_label: bool,
}

struct Edge {
    source: usize,
    target: usize,
}

/// Moves all `views` at once; `None` if there is nothing to refine or it would not fit better.
pub(super) fn refine(views: &[RefinedView], config: &JointConfig) -> Option<JointRefinement> {
    let centred: Vec<(Point3<f64>, f64)> = views
        .iter()
        .map(|v| {
            let centre = v.points.centroid().unwrap_or_else(Point3::origin);
            (centre, v.points.radius(&centre))
        })
        .collect();
    // The views share one hand-eye and one table calibration: as witnesses their priors count as one.
    let witnesses = views.len() as f64;
    let stiffness: Option<Vec<_>> = views.iter().map(|v| Some(v.covariance.try_inverse()? / witnesses)).collect();
    let stiffness = stiffness?;
    let mut poses: Vec<Isometry3<f64>> = views.iter().map(|v| v.surface.table_from_camera).collect();
    let edges = overlapping(views, &poses);
    if edges.is_empty() {
        return None;
    }
    let problem = Problem { views, centred: &centred, stiffness: &stiffness, edges: &edges, config };
    let mut sigmas = problem.sigmas(&poses);
    let bound = 3.0 * median(&sigmas).max(SIGMA_FLOOR);
    let fit_before = problem.fit(&poses, bound);
    let mut rounds = 0;
    for reach in ROUNDS {
        let moved = problem.round(&mut poses, &mut sigmas, reach)?;
        rounds += 1;
        if moved < STILL {
            break;
        }
    }
    let fit_after = problem.fit(&poses, bound);
    (fit_after < fit_before).then_some(JointRefinement {
        table_from_camera: poses,
        edges: edges.len(),
        rounds,
        fit_before,
        fit_after,
    })
}

/// Ordered pairs of views that see common ground, each view with those it shares most with.
fn overlapping(views: &[RefinedView], poses: &[Isometry3<f64>]) -> Vec<Edge> {
    (0..views.len()).into_par_iter().flat_map_iter(|source| partners(views, poses, source)).collect()
}

/// The edges from one view to those that it shares most surface with.
fn partners(views: &[RefinedView], poses: &[Isometry3<f64>], source: usize) -> Vec<Edge> {
    let points = views[source].points.thinned(views[source].points.len().div_ceil(PROBES));
    let Some(centre) = points.centroid() else { return Vec::new() };
    let reach = (0.02 * centre.z) as f32;
    let gate = Gate { distance: reach, cosine: 0.5, tukey: reach, same_label: false };
    let share = |target: usize| {
        let at = linearise(&points, &views[target].surface, &(poses[target].inverse() * poses[source]), &centre, &gate);
        f64::from(at.pairs) / points.len() as f64
    };
    let mut found: Vec<(f64, usize)> =
        (0..views.len()).filter(|&t| t != source).map(|t| (share(t), t)).filter(|f| f.0 >= LEAST_OVERLAP).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    found.truncate(MOST_PARTNERS);
    found.into_iter().map(|(_, target)| Edge { source, target }).collect()
}

/// Median of positive values; 0 without any.
fn median(values: &[f64]) -> f64 {
    let mut positive: Vec<f64> = values.iter().copied().filter(|v| *v > 0.0).collect();
    positive.sort_unstable_by(f64::total_cmp);
    positive.get(positive.len() / 2).copied().unwrap_or(0.0)
}

struct Problem<'a> {
    views: &'a [RefinedView],
    /// Centre (camera frame) and radius of each view's points.
    centred: &'a [(Point3<f64>, f64)],
    stiffness: &'a [Matrix6<f64>],
    edges: &'a [Edge],
    config: &'a JointConfig,
}

impl Problem<'_> {
    /// One edge with pairs up to `reach` (times the distance) and Tukey's constant `tukey` (metres).
    fn linearise(&self, edge: &Edge, poses: &[Isometry3<f64>], reach: f64, tukey: f64) -> Linearised {
        let (centre, _) = &self.centred[edge.source];
        let distance = (reach * centre.z) as f32;
        let tukey = (tukey as f32).min(distance);
        let gate = Gate { distance, cosine: 0.75, tukey, same_label: self.config.same_label };
        let target_from_source = poses[edge.target].inverse() * poses[edge.source];
        linearise(&self.views[edge.source].points, &self.views[edge.target].surface, &target_from_source, centre, &gate)
    }

    /// Standard deviation of each edge's residuals, metres; 0 where nothing is paired.
    fn sigmas(&self, poses: &[Isometry3<f64>]) -> Vec<f64> {
        self.edges.par_iter().map(|edge| self.linearise(edge, poses, ROUNDS[0], ROUNDS[0]).sigma).collect()
    }

    /// Root mean square distance over all source points, truncated at `bound` (metres); a point without a pair counts
    /// as one at the bound.
    fn fit(&self, poses: &[Isometry3<f64>], bound: f64) -> f64 {
        let reach = ROUNDS[ROUNDS.len() - 1];
        let costs: Vec<f64> =
            self.edges.par_iter().map(|e| self.linearise(e, poses, reach, bound).truncated_cost).collect();
        let points: usize = self.edges.iter().map(|e| self.views[e.source].points.len()).sum();
        (costs.iter().sum::<f64>() / points.max(1) as f64).max(0.0).sqrt()
    }

    /// One Gauss-Newton step of all poses; how far it moved the object at most, metres.
    fn round(&self, poses: &mut [Isometry3<f64>], sigmas: &mut [f64], reach: f64) -> Option<f64> {
        let linearised: Vec<Linearised> = self
            .edges
            .par_iter()
            .zip(&*sigmas)
            .map(|(edge, sigma)| self.linearise(edge, poses, reach, TUKEY * sigma.max(SIGMA_FLOOR)))
            .collect();
        // One block of six unknowns a view: a twist of its camera. First the priors, which tie each view to its kinematics.
        let n = 6 * self.views.len();
        let (mut hessian, mut gradient) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (i, pose) in poses.iter().enumerate() {
            let from_prior = log(&self.views[i].prior, pose);
            let mut block = hessian.view_mut((6 * i, 6 * i), (6, 6));
            block += self.stiffness[i];
            let mut rows = gradient.rows_mut(6 * i, 6);
            rows += self.stiffness[i] * from_prior;
        }
        // Then the edges, each of which ties two views to each other.
        for ((edge, at), sigma) in self.edges.iter().zip(&linearised).zip(sigmas.iter_mut()) {
            if at.pairs < FEWEST_PAIRS {
                continue;
            }
            *sigma = at.sigma;
            let (i, j) = (edge.source, edge.target);
            let (centre, radius) = &self.centred[i];
            let observable = project_out_degenerate(&at.hessian, &at.gradient, at.weight, *radius, self.config.weakest);
            // Each pair of views is usually linearised twice, once from either side.
            let certainty = 0.5 / (at.sigma.max(SIGMA_FLOOR).powi(2) * at.correlation);
            // How a twist of either camera moves the source's points relative to the target, about their centre.
            let turn = (poses[j].inverse() * poses[i]).rotation.to_rotation_matrix();
            let by_source = turned(turn.matrix()) * about(centre);
            let by_target = -about(&at.centre);
            let sides = [(i, by_source), (j, by_target)];
            for (a, jacobian_a) in &sides {
                let weighted = jacobian_a.transpose() * observable.hessian * certainty;
                for (b, jacobian_b) in &sides {
                    let mut block = hessian.view_mut((6 * a, 6 * b), (6, 6));
                    block += weighted * jacobian_b;
                }
                let mut rows = gradient.rows_mut(6 * a, 6);
                rows += jacobian_a.transpose() * observable.gradient * certainty;
            }
        }
        // All cameras move at once; what counts is how far that carries the object.
        let step = hessian.cholesky()?.solve(&-gradient);
        let mut most = 0.0_f64;
        for (i, pose) in poses.iter_mut().enumerate() {
            let twist = step.fixed_rows::<6>(6 * i).into_owned();
            *pose *= exp(&twist);
            let (w, v) = halves(&(about(&self.centred[i].0) * twist));
            most = most.max(v.norm() + w.norm() * self.centred[i].1);
        }
        Some(most)
    }
}
