//! All views at once: the last view must meet the first (loop refinement at the end of an inspection).
//!
//! A small pose graph whose edges are not fixed measurements but live surfaces: every pair of views that see common
//! ground is linearised projectively like a single ICP, and one Gauss-Newton step moves all cameras together, each held
//! by its kinematic prior. Errors that sequential registration laid onto late views are spread over the whole turn, and
//! a sensor's ripple, which differs from view to view, averages out. Beside the surfaces, the pictures are aligned
//! ([`super::photometric`]): they hold what slides along a surface, and what the depth sensor errs in.

use super::correspondences::{Gate, linearise};
use super::degeneracy::project_out_degenerate;
use super::joint_equations::{Edge, Equations};
use super::model_view::ModelView;
use super::normal_equations::Linearised;
use super::photometric::{self, PhotometricGate, RANGE};
use super::se3::{about, advance, halves, log};
use super::source_points::SourcePoints;
use super::texture::ViewTexture;
use nalgebra::{Isometry3, Matrix6, Point3};
use rayon::prelude::*;

/// Most other views that a view is paired with: enough for closure, and time stays linear in the number of views.
const MOST_PARTNERS: usize = 12;
/// Least share of a view's points on another view for the two to be paired.
const LEAST_OVERLAP: f64 = 0.1;

/// One stage of the way from coarse to fine.
struct Stage {
    /// Level of the pictures' pyramid.
    level: usize,
    /// Gates of its rounds in metres per metre of distance from the camera, from drift to noise; the last one stays.
    gates: &'static [f64],
    rounds: u32,
}

const STAGES: [Stage; 3] = [
    Stage { level: 2, gates: &[6e-3, 4e-3, 3e-3, 2e-3], rounds: 8 },
    Stage { level: 1, gates: &[2e-3], rounds: 8 },
    // The finest pictures are noisiest: more rounds follow the noise (on `shelf-eye-in-hand` a median of 1.30 pixels after
    // twelve rounds, 1.26 after two, between features that take no part).
    Stage { level: 0, gates: &[2e-3], rounds: 2 },
];
/// The widest and the narrowest gate.
const WIDEST: f64 = STAGES[0].gates[0];
const NARROWEST: f64 = STAGES[2].gates[0];
/// Least gate in standard deviations of the residuals: a narrower one would cut them off.
const WIDE_ENOUGH: f64 = 4.0;
/// How far a textured point may lie from what the other view sees in its pixel, metres per metre of distance.
const SEEN: f64 = 0.015;
/// Tukey's constant in standard deviations.
const TUKEY: f64 = 4.685;
/// Smallest standard deviation that residuals are believed to have, metres.
const SIGMA_FLOOR: f64 = 5e-6;
/// Smallest standard deviation that differences of normalised grey values are believed to have.
const GREY_FLOOR: f64 = 0.02;
/// Points that decide whether two views overlap.
const PROBES: usize = 1500;
/// Fewest pairs that make an edge.
const FEWEST_PAIRS: u32 = 200;
/// A round that moves no object by more ends a stage, in pixels of its pictures.
const STILL: f64 = 0.01;

/// Squares of the way from a prior in standard deviations that one way in forty is longer than by chance: chi-square of six
/// degrees of freedom.
const TORN: f64 = 14.45;
/// How many times the usual squares these must be: where the priors of all views are worse than they say, none is torn.
const APART: f64 = 4.0;

/// What the refinement keeps of a view: a coarse picture of its surface, and its prior.
#[derive(Clone, Debug)]
pub struct RefinedView {
    /// Its surface as a target; the pose in it is the current one.
    pub surface: ModelView,
    /// The points that are matched into other views.
    pub points: SourcePoints,
    /// Its picture; `None` where it shows too little.
    pub texture: Option<ViewTexture>,
    /// Its picture where that says which side is seen but not where exactly it is.
    pub side: Option<ViewTexture>,
    /// Pose from kinematics.
    pub prior: Isometry3<f64>,
    /// Of the prior, over (rotation, translation), camera frame.
    pub covariance: Matrix6<f64>,
    /// Of the way from the model to the view, as it was registered; the same coordinates.
    pub registered: Matrix6<f64>,
}

impl RefinedView {
    /// Edge of a pixel at `level` of the pictures' pyramid on the object, metres.
    fn footprint(&self, level: usize) -> f64 {
        let depth = self.points.centroid().map_or(0.0, |centre| centre.z);
        self.surface.intrinsics.footprint(depth) * f64::from(1_u32 << level)
    }

    /// Its picture, if there is one of any use.
    pub(super) fn appearance(&self) -> Option<&ViewTexture> {
        self.texture.as_ref().or(self.side.as_ref())
    }

    /// How differently two views look at what they see: the angle between their cameras, and between the rays from
    /// either to what this one sees; radians.
    pub(super) fn distance_to(&self, other: &Self) -> f64 {
        let (pose, other) = (&self.surface.table_from_camera, &other.surface.table_from_camera);
        let depth = self.points.centroid().map_or(f64::INFINITY, |centre| centre.z);
        let baseline = (pose.translation.vector - other.translation.vector).norm();
        pose.rotation.angle_to(&other.rotation) + baseline.atan2(depth)
    }
}

/// What the refinement did.
#[derive(Clone, Debug)]
pub struct JointRefinement {
    /// New `table_from_camera`, one a view.
    pub table_from_camera: Vec<Isometry3<f64>>,
    /// Covariance of each, over (rotation, translation), camera frame: what priors and matches leave open together.
    pub covariances: Vec<Matrix6<f64>>,
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

/// Moves all `views` at once; `None` if there is nothing to refine or it would not fit better.
pub(super) fn refine(views: &[&RefinedView], config: &JointConfig) -> Option<JointRefinement> {
    let centred: Vec<(Point3<f64>, f64)> = views
        .iter()
        .map(|v| {
            let centre = v.points.centroid().unwrap_or_else(Point3::origin);
            (centre, v.points.radius(&centre))
        })
        .collect();
    let stiffness: Option<Vec<_>> = views.iter().map(|v| v.covariance.try_inverse()).collect();
    let stiffness = stiffness?;
    let before: Vec<Isometry3<f64>> = views.iter().map(|v| v.surface.table_from_camera).collect();
    let mut edges = overlapping(views, &before);
    loop {
        if edges.is_empty() {
            return None;
        }
        let problem = Problem { views, centred: &centred, stiffness: &stiffness, edges: &edges, config };
        let refined = problem.refine(&before)?;
        let torn = problem.torn_from_priors(&refined.table_from_camera);
        if torn.is_empty() {
            return Some(refined);
        }
        // They stay where the robot says, and pull no other view along.
        edges.retain(|edge| !torn.contains(&edge.source) && !torn.contains(&edge.target));
    }
}

/// Ordered pairs of views that see common ground, each view with those it shares most with.
fn overlapping(views: &[&RefinedView], poses: &[Isometry3<f64>]) -> Vec<Edge> {
    (0..views.len()).into_par_iter().flat_map_iter(|source| partners(views, poses, source)).collect()
}

/// The edges from one view to those that it shares most surface with.
fn partners(views: &[&RefinedView], poses: &[Isometry3<f64>], source: usize) -> Vec<Edge> {
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
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut positive: Vec<f64> = values.filter(|v| *v > 0.0).collect();
    positive.sort_unstable_by(f64::total_cmp);
    positive.get(positive.len() / 2).copied().unwrap_or(0.0)
}

/// How far the residuals of an edge scatter.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// Standard deviation of distances, metres; 0 where nothing is paired.
    geometric: f64,
    /// Neighbouring points that share their distance's error.
    geometric_correlation: f64,
    /// Standard deviation of differences of normalised grey values.
    photometric: f64,
    /// Neighbouring points that share their difference's error.
    photometric_correlation: f64,
}

struct Problem<'a> {
    views: &'a [&'a RefinedView],
    /// Centre (camera frame) and radius of each view's points.
    centred: &'a [(Point3<f64>, f64)],
    stiffness: &'a [Matrix6<f64>],
    edges: &'a [Edge],
    config: &'a JointConfig,
}

impl Problem<'_> {
    /// Moves all views from the poses `before`; `None` if that would not fit better.
    fn refine(&self, before: &[Isometry3<f64>]) -> Option<JointRefinement> {
        let mut poses = before.to_vec();
        let mut noise = self.noise(&poses);
        let bound = 3.0 * median(noise.iter().map(|n| n.geometric)).max(SIGMA_FLOOR);
        let fit_before = self.fit(&poses, bound);
        let mut rounds = 0;
        for stage in STAGES {
            let still = STILL * median(self.views.iter().map(|v| v.footprint(stage.level)));
            for round in 0..stage.rounds as usize {
                let gate = stage.gates[round.min(stage.gates.len() - 1)];
                let moved = self.round(&mut poses, &mut noise, gate, stage.level)?;
                rounds += 1;
                if round + 1 >= stage.gates.len() && moved < still {
                    break;
                }
            }
        }
        let fit_after = self.fit(&poses, bound);
        if self.objective(&poses, &noise) >= self.objective(before, &noise) {
            return None;
        }
        Some(JointRefinement {
            covariances: self.covariances(&poses, &mut noise)?,
            table_from_camera: poses,
            edges: self.edges.len(),
            rounds,
            fit_before,
            fit_after,
        })
    }

    /// Views that matches have moved farther from their priors than these allow, where those of the others hold: they are matched
    /// wrongly (thin fins, repeated blades), or at least not by evidence that outweighs the robot's.
    fn torn_from_priors(&self, poses: &[Isometry3<f64>]) -> Vec<usize> {
        let distances: Vec<f64> = (0..poses.len()).map(|i| self.squares_from_prior(i, &poses[i])).collect();
        let usual = median(distances.iter().copied());
        let is_matched = |i: usize| self.edges.iter().any(|edge| edge.source == i || edge.target == i);
        let is_torn = |i: &usize| distances[*i] > TORN.max(APART * usual) && is_matched(*i);
        (0..poses.len()).filter(is_torn).collect()
    }

    /// Squares of the way from a view's prior, in its standard deviations.
    fn squares_from_prior(&self, view: usize, pose: &Isometry3<f64>) -> f64 {
        let from_prior = log(&self.views[view].prior, pose);
        from_prior.dot(&(self.stiffness[view] * from_prior))
    }

    /// One edge with pairs up to `reach` (times the distance) and Tukey's constant `tukey` (metres).
    fn linearise(&self, edge: &Edge, poses: &[Isometry3<f64>], reach: f64, tukey: f64) -> Linearised {
        let (centre, _) = &self.centred[edge.source];
        let distance = (reach * centre.z).max(WIDE_ENOUGH * tukey / TUKEY) as f32;
        let tukey = (tukey as f32).min(distance);
        let gate = Gate { distance, cosine: 0.75, tukey, same_label: self.config.same_label };
        let target_from_source = poses[edge.target].inverse() * poses[edge.source];
        linearise(&self.views[edge.source].points, &self.views[edge.target].surface, &target_from_source, centre, &gate)
    }

    /// The pictures of one edge at `level`, with Tukey's constant `tukey`; `None` where either view has none.
    fn compare_pictures(&self, edge: &Edge, poses: &[Isometry3<f64>], level: usize, tukey: f64) -> Option<Linearised> {
        let (source, target) = (self.views[edge.source].texture.as_ref()?, &self.views[edge.target]);
        let (centre, _) = &self.centred[edge.source];
        let gate = PhotometricGate { level, distance: (SEEN * centre.z) as f32, tukey: (tukey as f32).min(RANGE) };
        let target_from_source = poses[edge.target].inverse() * poses[edge.source];
        let picture = target.texture.as_ref()?;
        Some(photometric::linearise(&source.points, picture, &target.surface, &target_from_source, centre, &gate))
    }

    /// How far the residuals of each edge scatter at the start.
    fn noise(&self, poses: &[Isometry3<f64>]) -> Vec<Noise> {
        let (reach, level) = (WIDEST, STAGES[0].level);
        let of_edge = |edge: &Edge| {
            let surfaces = self.linearise(edge, poses, reach, reach * self.centred[edge.source].0.z);
            let pictures = self.compare_pictures(edge, poses, level, RANGE.into());
            Noise {
                geometric: surfaces.sigma,
                geometric_correlation: surfaces.correlation,
                photometric: pictures.as_ref().map_or(0.0, |at| at.sigma),
                photometric_correlation: pictures.map_or(1.0, |at| at.correlation),
            }
        };
        self.edges.par_iter().map(of_edge).collect()
    }

    /// What the rounds make small, with `noise` held: robust squares of all residuals in standard deviations, each
    /// divided by how many residuals share their error, and of the ways from the priors.
    fn objective(&self, poses: &[Isometry3<f64>], noise: &[Noise]) -> f64 {
        let reach = NARROWEST;
        let of_edge = |(edge, noise): (&Edge, &Noise)| {
            let sigma = noise.geometric.max(SIGMA_FLOOR);
            let at = self.linearise(edge, poses, reach, TUKEY * sigma);
            let geometric = at.truncated_cost / (sigma.powi(2) * noise.geometric_correlation);
            let sigma = noise.photometric.max(GREY_FLOOR);
            let pictures = self.compare_pictures(edge, poses, 0, TUKEY * sigma);
            geometric + pictures.map_or(0.0, |at| at.truncated_cost / (sigma.powi(2) * noise.photometric_correlation))
        };
        let edges: Vec<f64> = self.edges.par_iter().zip(noise).map(of_edge).collect();
        let prior = poses.iter().enumerate().map(|(i, pose)| self.squares_from_prior(i, pose));
        0.5 * edges.iter().sum::<f64>() + prior.sum::<f64>()
    }

    /// Root mean square distance over all source points, truncated at `bound` (metres); a point without a pair counts
    /// as one at the bound.
    fn fit(&self, poses: &[Isometry3<f64>], bound: f64) -> f64 {
        let reach = NARROWEST;
        let costs: Vec<f64> =
            self.edges.par_iter().map(|e| self.linearise(e, poses, reach, bound).truncated_cost).collect();
        let points: usize = self.edges.iter().map(|e| self.views[e.source].points.len()).sum();
        (costs.iter().sum::<f64>() / points.max(1) as f64).max(0.0).sqrt()
    }

    /// What priors and matches leave open of each pose. A view's surface has the same error in all its edges: these are
    /// together worth no more than two, one for either surface of a pair.
    fn covariances(&self, poses: &[Isometry3<f64>], noise: &mut [Noise]) -> Option<Vec<Matrix6<f64>>> {
        let edges_of_a_view = self.edges.len() as f64 / self.views.len() as f64;
        self.equations(poses, noise, NARROWEST, 0, (2.0 / edges_of_a_view).min(1.0)).covariances()
    }

    /// The equations of one Gauss-Newton step at `poses`, in which edges count `weight` times; `noise` becomes what is
    /// measured there.
    fn equations(
        &self,
        poses: &[Isometry3<f64>],
        noise: &mut [Noise],
        reach: f64,
        level: usize,
        weight: f64,
    ) -> Equations {
        let linearised: Vec<(Linearised, Option<Linearised>)> = self
            .edges
            .par_iter()
            .zip(&*noise)
            .map(|(edge, noise)| {
                let geometric = self.linearise(edge, poses, reach, TUKEY * noise.geometric.max(SIGMA_FLOOR));
                let tukey = TUKEY * noise.photometric.max(GREY_FLOOR);
                (geometric, self.compare_pictures(edge, poses, level, tukey))
            })
            .collect();
        // One block of six unknowns a view: a twist of its camera. First the priors, which tie each view to its kinematics.
        let mut equations = Equations::new(self.views.len());
        for (i, pose) in poses.iter().enumerate() {
            let from_prior = log(&self.views[i].prior, pose);
            equations.add_prior(i, &self.stiffness[i], &from_prior);
        }
        // Then the edges, each of which ties two views to each other.
        for ((edge, (geometric, pictures)), noise) in self.edges.iter().zip(&linearised).zip(noise.iter_mut()) {
            let (centre, radius) = &self.centred[edge.source];
            if geometric.pairs >= FEWEST_PAIRS {
                (noise.geometric, noise.geometric_correlation) = (geometric.sigma, geometric.correlation);
                let at = geometric;
                let observable =
                    project_out_degenerate(&at.hessian, &at.gradient, at.weight, *radius, self.config.weakest);
                // Each pair of views is usually linearised twice, once from either side.
                let certainty = 0.5 * weight / (at.sigma.max(SIGMA_FLOOR).powi(2) * at.correlation);
                let normal = (observable.hessian * certainty, observable.gradient * certainty);
                equations.add_edge(edge, poses, centre, &at.centre, normal);
            }
            if let Some(at) = pictures.as_ref().filter(|at| at.pairs >= FEWEST_PAIRS) {
                (noise.photometric, noise.photometric_correlation) = (at.sigma, at.correlation);
                let certainty = 0.5 * weight / (at.sigma.max(GREY_FLOOR).powi(2) * at.correlation);
                equations.add_edge(edge, poses, centre, &at.centre, (at.hessian * certainty, at.gradient * certainty));
            }
        }
        equations
    }

    /// One Gauss-Newton step of all poses; how far it moved the object at most, metres.
    fn round(&self, poses: &mut [Isometry3<f64>], noise: &mut [Noise], reach: f64, level: usize) -> Option<f64> {
        let equations = self.equations(poses, noise, reach, level, 1.0);
        // All cameras move at once; what counts is how far that carries the object.
        let step = equations.solve()?;
        let mut most = 0.0_f64;
        for (i, pose) in poses.iter_mut().enumerate() {
            let twist = step.fixed_rows::<6>(6 * i).into_owned();
            *pose = advance(pose, &twist);
            let (w, v) = halves(&(about(&self.centred[i].0) * twist));
            most = most.max(v.norm() + w.norm() * self.centred[i].1);
        }
        Some(most)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::organized::OrganizedCloud;
    use crate::view::{DepthImage, Intrinsics, covariance_of_prior};
    use image::{Rgb, RgbImage};
    use nalgebra::Vector3;

    const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 300.0, fy: 300.0, cx: 159.5, cy: 119.5 };

    /// A camera half a metre above the table plane, `x` metres along it, looking down.
    pub(in super::super) fn above(x: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(x, 0.0, 0.5), Vector3::new(std::f64::consts::PI, 0.0, 0.0))
    }

    /// What a camera truly at `truth` sees of a printed, flat table, with exposure `gain`; its prior is `prior`.
    pub(in super::super) fn view(truth: &Isometry3<f64>, prior: &Isometry3<f64>, gain: f64) -> RefinedView {
        let depth = DepthImage { width: CAMERA.width, height: CAMERA.height, metres: vec![0.5; 320 * 240] };
        let cloud = OrganizedCloud::new(CAMERA, &depth, None);
        let rgb = RgbImage::from_fn(CAMERA.width, CAMERA.height, |u, v| {
            let p = truth * CAMERA.unproject(u.into(), v.into(), 0.5);
            let print = (p.x * 700.0).sin() * (p.y * 500.0).cos() + 0.6 * (p.x * 230.0 + p.y * 310.0).sin();
            Rgb([((110.0 + 40.0 * print) * gain) as u8; 3])
        });
        RefinedView {
            surface: ModelView::of(&cloud, *prior, 1, |_| 0, |_| true),
            texture: ViewTexture::of(&rgb, &cloud, 1, |_| true),
            side: None,
            points: SourcePoints::select(&cloud, 4, |_| 0, |_| true),
            prior: *prior,
            covariance: covariance_of_prior(0.01, 0.005),
            registered: covariance_of_prior(1e-4, 1e-4),
        }
    }

    /// How far the way from the second view to the first is off, metres.
    fn offset(refined: &JointRefinement) -> f64 {
        let found = refined.table_from_camera[0].inverse() * refined.table_from_camera[1];
        (found.translation.vector - (above(0.0).inverse() * above(0.05)).translation.vector).norm()
    }

    #[test]
    fn pictures_hold_what_slides_along_a_plane_whatever_the_exposure() {
        let slid = above(0.054);
        let config = JointConfig { weakest: 2e-3, same_label: false };
        let mut views = [view(&above(0.0), &above(0.0), 1.0), view(&above(0.05), &slid, 0.6)];
        let refined = refine(&views.each_ref(), &config).expect("refined");
        assert!(offset(&refined) < 1e-4, "{} m", offset(&refined));
        // Matches tie the views to each other, not to the table: two priors are better than one, and no more.
        let prior = views[0].covariance;
        for covariance in &refined.covariances {
            for axis in 0..6 {
                let share = covariance[(axis, axis)] / prior[(axis, axis)];
                assert!((0.3..1.0).contains(&share), "axis {axis}: {share}");
            }
        }
        // Surfaces alone do not see it.
        views.iter_mut().for_each(|view| view.texture = None);
        let refined = refine(&views.each_ref(), &config);
        assert!(refined.is_none_or(|refined| offset(&refined) > 3e-3));
    }

    #[test]
    fn a_view_that_matches_tear_from_its_prior_stays_there_and_pulls_no_other_along() {
        let config = JointConfig { weakest: 2e-3, same_label: false };
        let torn = above(0.084);
        let good = [0.0, 0.05, 0.02, 0.03, 0.07].map(|x| view(&above(x), &above(x), 1.0));
        let mut views = Vec::from(good);
        views[1] = view(&above(0.05), &above(0.0503), 1.0);
        views.push(view(&above(0.08), &torn, 1.0));
        // Four millimetres are eight standard deviations of its prior.
        views.iter_mut().for_each(|view| view.covariance = covariance_of_prior(1e-3, 5e-4));
        let refined = refine(&views.iter().collect::<Vec<_>>(), &config).expect("refined");
        let moved = (refined.table_from_camera[5].translation.vector - torn.translation.vector).norm();
        assert!(moved < 1e-9, "{moved} m");
        assert!(offset(&refined) < 1e-4, "{} m", offset(&refined));
        assert_eq!(refined.edges, 20);
    }

    #[test]
    fn a_blank_picture_is_no_evidence() {
        let depth = DepthImage { width: CAMERA.width, height: CAMERA.height, metres: vec![0.5; 320 * 240] };
        let cloud = OrganizedCloud::new(CAMERA, &depth, None);
        let blank = RgbImage::from_pixel(CAMERA.width, CAMERA.height, Rgb([90; 3]));
        assert!(ViewTexture::of(&blank, &cloud, 1, |_| true).is_none());
    }
}
