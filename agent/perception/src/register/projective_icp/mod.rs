//! Projective symmetric point-to-plane ICP of one view against the fused model, as a maximum-a-posteriori estimate.
//!
//! [Remanufacturing paper], step 3, and [Eye-in-hand 2020], section 3.2 (segment ICP). The kinematic pose is a
//! measurement like any other: its covariance holds the directions that the data leave open
//! (`(H + S^-1) d = -(g + S^-1 e)`, `e` the way from the prior), and bounds how far the view may be carried. Pairs come
//! from look-ups in a rendering of the model, from coarse (every eighth pixel, wide gate) to fine.

use super::correspondences::{Gate, linearise};
use super::degeneracy::{Degeneracy, ObservableEquations, project_out_degenerate};
use super::model_view::{ModelSurface, ModelView};
use super::normal_equations::Linearised;
use super::se3::{about, advance, halves, log, turned};
use super::source_points::SourcePoints;
use crate::view::Intrinsics;
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

/// Settings of the ICP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IcpConfig {
    /// Eigenvalue (see [`Degeneracy`]) below which a direction is frozen.
    pub weakest: f64,
    /// Pairs of different component classes do not count.
    pub same_label: bool,
    /// Least share of the source points that must find a pair at the end.
    pub least_overlap: f64,
    /// Farthest that the estimate may lie from the prior, in standard deviations.
    pub farthest: f64,
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self { weakest: 6e-3, same_label: true, least_overlap: 0.1, farthest: 6.0 }
    }
}

/// How a view was aligned.
#[derive(Clone, Debug, PartialEq)]
pub struct IcpReport {
    /// Rounds in all.
    pub iterations: u32,
    /// Share of the source points that are paired at the estimate.
    pub overlap: f64,
    /// Standard deviation of the residuals at the estimate, metres.
    pub sigma: f64,
    /// Neighbouring points that share their error and count as one witness.
    pub correlation: f64,
    /// Root mean truncated square distance at the prior, metres.
    pub fit_before: f64,
    /// The same at the estimate.
    pub fit_after: f64,
    /// What the data hold.
    pub degeneracy: Degeneracy,
}

/// An alignment that holds.
#[derive(Clone, Debug)]
pub struct Aligned {
    /// The estimate.
    pub table_from_camera: Isometry3<f64>,
    /// Over (rotation, translation), camera frame.
    pub covariance: Matrix6<f64>,
    /// How it came about.
    pub report: IcpReport,
}

/// Why a view keeps its prior.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotAligned {
    /// Nothing to align.
    #[error("no points with normals to register")]
    NoPoints,
    /// Too little of the view lies on the model so far.
    #[error("only {found:.0} % of the points lie on the model, {needed:.0} % are needed")]
    LittleOverlap {
        /// Per cent.
        found: f64,
        /// Per cent.
        needed: f64,
    },
    /// The estimate fits worse than the prior.
    #[error("the fit would be worse: {after:.4} mm after, {before:.4} mm before")]
    Worse {
        /// Millimetres.
        before: f64,
        /// Millimetres.
        after: f64,
    },
    /// The estimate contradicts the kinematics.
    #[error("the estimate lies {deviations:.1} standard deviations from the kinematic pose")]
    Implausible {
        /// How far.
        deviations: f64,
    },
    /// The prior's covariance cannot be inverted.
    #[error("the covariance of the kinematic pose is not positive definite")]
    BadCovariance,
}

/// One level of the way from coarse to fine.
struct Level {
    /// Every so many source points.
    thin: usize,
    /// Edge of the model's pixels, in spacings of its points.
    pixel: f64,
    /// Smallest cosine between normals.
    cosine: f32,
    rounds: u32,
}

const LEVELS: [Level; 3] = [
    Level { thin: 16, pixel: 4.0, cosine: 0.5, rounds: 25 },
    Level { thin: 4, pixel: 2.0, cosine: 0.7, rounds: 12 },
    Level { thin: 1, pixel: 2.0, cosine: 0.8, rounds: 8 },
];
/// Longest pair at the finest level, in spacings of the model's points.
const FINE_GATE: f64 = 3.0;
/// Tukey's constant in standard deviations: 95 % as good as least squares on clean data.
const TUKEY: f64 = 4.685;
/// Smallest standard deviation that residuals are believed to have, metres.
const SIGMA_FLOOR: f64 = 5e-6;
/// Longest pair of all, metres.
const LONGEST: f64 = 0.05;
/// An update that moves the object by less ends a level: metres, and standard deviations of the residuals.
const STILL: (f64, f64) = (1.5e-6, 0.01);
/// Fewest pairs that say anything.
const FEWEST_PAIRS: u32 = 50;
/// So many pixels of motion since the rendering make a new one worth its time.
const STALE: f64 = 6.0;

/// Aligns `source` (camera frame) to `model`. `prior` is `table_from_camera` with `covariance` over (rotation,
/// translation) in the camera frame; `camera` is the view's.
///
/// # Errors
/// [`NotAligned`]: the view should keep its prior, and why.
pub fn align(
    source: &SourcePoints,
    camera: &Intrinsics,
    model: &dyn ModelSurface,
    prior: &Isometry3<f64>,
    covariance: &Matrix6<f64>,
    config: &IcpConfig,
) -> Result<Aligned, NotAligned> {
    let centre = source.centroid().ok_or(NotAligned::NoPoints)?;
    let stiffness = covariance.try_inverse().ok_or(NotAligned::BadCovariance)?;
    let problem = Problem { centre, radius: source.radius(&centre), prior, stiffness, config };
    let fine = (FINE_GATE * model.spacing()).max(8.0 * SIGMA_FLOOR);
    let widest = (3.0 * problem.spread(covariance) + fine).min(LONGEST);
    // The model is looked at through the window that the source lies in; a pixel finer than its spacing would only
    // show its gaps.
    let look = |pose: &Isometry3<f64>, reach: f64, pixel: f64| {
        let window = source.window(camera, reach);
        model.view(&window.scaled((camera.footprint(centre.z) / (pixel * model.spacing())).min(1.0)), pose)
    };
    let mut rendered = look(prior, widest, LEVELS[0].pixel);
    let mut pose = *prior;
    let mut iterations = 0;
    for (l, level) in LEVELS.iter().enumerate() {
        let points = source.thinned(level.thin);
        // Gates shrink evenly on a logarithmic scale from the prior's reach to the model's spacing.
        let share = l as f64 / (LEVELS.len() - 1) as f64;
        let distance = (widest.powf(1.0 - share) * fine.powf(share)) as f32;
        let mut gate = Gate { distance, cosine: level.cosine, tukey: distance, same_label: config.same_label };
        // The model is rendered anew where pixels get finer, or where the pose has moved far from the last rendering.
        let moved = problem.moved(&log(&rendered.table_from_camera, &pose));
        if l > 0 && (level.pixel < LEVELS[l - 1].pixel || moved > STALE * model.spacing()) {
            rendered = look(&pose, widest, level.pixel);
        }
        for _ in 0..level.rounds {
            // One Gauss-Newton step: pair, linearise, solve together with the prior, move.
            let at = problem.linearise(&points, &rendered, &pose, &gate);
            iterations += 1;
            let Some(step) = problem.step(&at, &rendered, &pose) else { break };
            pose = advance(&pose, &step);
            // The residuals' own spread decides what counts as an outlier in the next round.
            gate.tukey = ((TUKEY * at.sigma.max(SIGMA_FLOOR)) as f32).min(gate.distance);
            if problem.moved(&step) < STILL.0.max(STILL.1 * at.sigma) {
                break;
            }
        }
    }
    problem.judge(source, &rendered, &pose, fine, iterations)
}

/// What stays the same while a view is aligned.
struct Problem<'a> {
    /// Centre of the object in the camera frame.
    centre: Point3<f64>,
    /// Root mean square distance of its points from there, metres.
    radius: f64,
    prior: &'a Isometry3<f64>,
    /// Inverse covariance of the prior.
    stiffness: Matrix6<f64>,
    config: &'a IcpConfig,
}

impl Problem<'_> {
    /// How far a twist of the camera carries the object, metres.
    fn moved(&self, twist: &Vector6<f64>) -> f64 {
        let (w, v) = halves(&(about(&self.centre) * twist));
        v.norm() + w.norm() * self.radius
    }

    /// Standard deviation of where the prior puts the object's points, metres.
    fn spread(&self, covariance: &Matrix6<f64>) -> f64 {
        let at_object = about(&self.centre) * covariance * about(&self.centre).transpose();
        let turn = (0..3).map(|i| at_object[(i, i)]).sum::<f64>() * self.radius.powi(2);
        ((3..6).map(|i| at_object[(i, i)]).sum::<f64>() + turn).sqrt()
    }

    fn linearise(&self, points: &SourcePoints, model: &ModelView, pose: &Isometry3<f64>, gate: &Gate) -> Linearised {
        linearise(points, model, &(model.table_from_camera.inverse() * pose), &self.centre, gate)
    }

    /// Normal equations over a twist of the camera, in units of information.
    fn information(&self, at: &Linearised, model: &ModelView, pose: &Isometry3<f64>) -> ObservableEquations {
        let observable = project_out_degenerate(&at.hessian, &at.gradient, at.weight, self.radius, self.config.weakest);
        let turn = (model.table_from_camera.inverse() * pose).rotation.to_rotation_matrix();
        // The linearisation is over a twist about the object's centre in the model's camera; the unknown is one of the
        // view's camera.
        let carry = turned(turn.matrix()) * about(&self.centre);
        let certainty = 1.0 / (at.sigma.max(SIGMA_FLOOR).powi(2) * at.correlation);
        ObservableEquations {
            hessian: carry.transpose() * observable.hessian * carry * certainty,
            gradient: carry.transpose() * observable.gradient * certainty,
            degeneracy: observable.degeneracy,
        }
    }

    /// The maximum-a-posteriori step from `pose`; `None` if there is nothing to go by.
    fn step(&self, at: &Linearised, model: &ModelView, pose: &Isometry3<f64>) -> Option<Vector6<f64>> {
        if at.pairs < FEWEST_PAIRS {
            return None;
        }
        let data = self.information(at, model, pose);
        // (H + S^-1) d = -(g + S^-1 e), e the way from the prior to the pose.
        let from_prior = log(self.prior, pose);
        (data.hessian + self.stiffness).cholesky().map(|c| -c.solve(&(data.gradient + self.stiffness * from_prior)))
    }

    /// Accepts the estimate if it lies on the model, fits better than the prior and does not contradict it.
    fn judge(
        &self,
        source: &SourcePoints,
        model: &ModelView,
        pose: &Isometry3<f64>,
        fine: f64,
        iterations: u32,
    ) -> Result<Aligned, NotAligned> {
        let wide = Gate { distance: fine as f32, cosine: 0.7, tukey: fine as f32, same_label: self.config.same_label };
        let count = source.len() as f64;
        let fit = |at: &Linearised| (at.truncated_cost / count).max(0.0).sqrt();
        // Prior and estimate are compared on all points, with one gate and without weights that depend on the fit.
        let before = fit(&self.linearise(source, model, self.prior, &wide));
        let first = self.linearise(source, model, pose, &wide);
        // What the covariance is computed from is weighted by the spread of the residuals at the estimate.
        let tukey = ((TUKEY * first.sigma.max(SIGMA_FLOOR)) as f32).min(wide.distance);
        let at = self.linearise(source, model, pose, &Gate { tukey, ..wide });
        let (overlap, after) = (f64::from(at.pairs) / count, fit(&first));
        if overlap < self.config.least_overlap || at.pairs < FEWEST_PAIRS {
            let needed = self.config.least_overlap * 100.0;
            return Err(NotAligned::LittleOverlap { found: overlap * 100.0, needed });
        }
        if after >= before {
            return Err(NotAligned::Worse { before: before * 1e3, after: after * 1e3 });
        }
        let from_prior = log(self.prior, pose);
        let deviations = (from_prior.transpose() * self.stiffness * from_prior).x.max(0.0).sqrt();
        if deviations > self.config.farthest {
            return Err(NotAligned::Implausible { deviations });
        }
        let data = self.information(&at, model, pose);
        let covariance = (data.hessian + self.stiffness).try_inverse().ok_or(NotAligned::BadCovariance)?;
        let report = IcpReport {
            iterations,
            overlap,
            sigma: at.sigma,
            correlation: at.correlation,
            fit_before: before,
            fit_after: after,
            degeneracy: data.degeneracy,
        };
        Ok(Aligned { table_from_camera: *pose, covariance, report })
    }
}

#[cfg(test)]
mod tests;
