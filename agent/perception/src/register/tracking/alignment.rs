//! One frame against the keyframes that show the same surface, all at once: projective symmetric point-to-plane ICP and
//! direct alignment of the pictures, held by the motion that was foreseen.
//!
//! The geometric part is that of the registration of single views ([`linearise`]); directions that the surfaces leave open
//! (a wall, a cylinder) are projected out of it, and the pictures, which hold them, decide there ([Kerl 2013];
//! [Whelan 2016], section III). Where neither does, the foreseen motion stands.

use super::super::correspondences::{Gate, linearise};
use super::super::degeneracy::project_out_degenerate;
use super::super::into_picture::IntoPicture;
use super::super::model_view::ModelView;
use super::super::normal_equations::Linearised;
use super::super::photometric::{self, Alikeness, PhotometricGate, RANGE};
use super::super::se3::{about, advance, halves, log, turned};
use super::super::source_points::SourcePoints;
use super::super::texture::{LEVELS as PICTURE_LEVELS, ViewTexture};
use super::frame::Frame;
use crate::view::covariance_of_prior;
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};
use semascan_geometry::vector::{dot, sub};

/// One level of the way from coarse to fine.
struct Level {
    /// Every so many points.
    thin: usize,
    /// Level of the pictures' pyramid.
    picture: usize,
    /// Smallest cosine between normals.
    cosine: f32,
    rounds: u32,
}

const LEVELS: [Level; 3] = [
    Level { thin: 12, picture: 2, cosine: 0.5, rounds: 8 },
    Level { thin: 6, picture: 1, cosine: 0.7, rounds: 5 },
    Level { thin: 2, picture: 0, cosine: 0.8, rounds: 4 },
];
/// Longest pair at the finest level, metres a metre of distance.
const FINE_GATE: f64 = 0.015;
/// Longest pair at which a surface counts as seen by both, metres a metre of distance.
const SEEN: f64 = 0.03;
/// Tukey's constant in standard deviations.
const TUKEY: f64 = 4.685;
/// Smallest standard deviations that residuals are believed to have: metres, and normalised grey values.
const SIGMA_FLOOR: (f64, f64) = (2e-4, 0.05);
/// What pictures err together, radians, and metres a metre of distance: colour and depth come from two cameras, which are never
/// registered to each other to a pixel, nor in time. However many pixels agree, they do not know the pose better.
const MISREGISTRATION: f64 = 3e-3;
/// Eigenvalue below which a direction is left to the pictures.
const WEAKEST: f64 = 6e-3;
/// Fewest pairs that say anything.
const FEWEST_PAIRS: u32 = 60;
/// A step that moves no point by more, metres a metre of distance, ends a level.
const STILL: f64 = 5e-5;
/// Every so many points are looked up to see how much a keyframe shows.
const PROBE: usize = 16;
/// Fewest of these that have to lie on a keyframe for it to show anything of the frame.
const FEWEST_PROBES: u32 = 20;
/// Fewest points that two pictures are compared in.
const FEWEST_COMPARED: u32 = 200;

/// What a frame is aligned with: the surface of a keyframe, whose pose it carries, and its picture.
#[derive(Clone, Copy)]
pub(super) struct Target<'a> {
    pub(super) surface: &'a ModelView,
    pub(super) texture: Option<&'a ViewTexture>,
}

/// Where to look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// `world_from_camera`.
    pub(super) start: Isometry3<f64>,
    /// Of the start over (rotation, translation), camera frame.
    pub(super) covariance: Matrix6<f64>,
    /// Longest pair at the coarsest level, metres.
    pub(super) reach: f64,
}

/// Where a frame was found.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    pub(super) world_from_camera: Isometry3<f64>,
    /// What surfaces and pictures say alone: inverse covariance over (rotation, translation), camera frame.
    pub(super) information: Matrix6<f64>,
    /// Share of the frame's points that lie on the surface of a target.
    pub(super) overlap: f64,
    /// Standard deviation of the distances, metres.
    pub(super) sigma: f64,
    /// Correlation of the pictures, -1 to 1; `None` where they have too little in common.
    pub(super) alike: Option<f64>,
    /// Directions that the surfaces leave open.
    pub(super) left_open: usize,
}

/// Aligns `frame` with `targets`; `None` where hardly anything is paired.
pub(super) fn align(frame: &Frame, targets: &[Target<'_>], search: &Search) -> Option<Alignment> {
    let stiffness = search.covariance.try_inverse()?;
    let distance = frame.centre.z;
    let fine = (FINE_GATE * distance).min(search.reach);
    let mut noise = Noise { geometric: search.reach / TUKEY, photometric: f64::from(RANGE) / TUKEY };
    let mut pose = search.start;
    let mut last = None;
    for (l, level) in LEVELS.iter().enumerate() {
        let points = frame.points.thinned(level.thin);
        // Gates shrink evenly on a logarithmic scale from the reach to the finest.
        let share = l as f64 / (LEVELS.len() - 1) as f64;
        let reach = search.reach.powf(1.0 - share) * fine.powf(share);
        for _ in 0..level.rounds {
            let problem = Problem { frame, points: &points, targets, level, reach, noise };
            let at = problem.equations(&pose)?;
            noise = at.noise;
            let from_start = log(&search.start, &pose);
            let gradient = at.gradient + stiffness * from_start;
            let step = -(at.hessian + stiffness).cholesky()?.solve(&gradient);
            pose = advance(&pose, &step);
            let (turn, shift) = halves(&(about(&frame.centre) * step));
            last = Some(at);
            if shift.norm() + turn.norm() * frame.radius < STILL * distance {
                break;
            }
        }
    }
    let at = last?;
    let seen = SEEN * distance;
    let all: Vec<&ModelView> = targets.iter().map(|t| t.surface).collect();
    Some(Alignment {
        overlap: covered(&frame.points, &all, &pose),
        alike: alike(frame, targets, &pose, seen),
        world_from_camera: pose,
        information: at.hessian,
        sigma: at.noise.geometric,
        left_open: at.left_open,
    })
}

/// Share of `points`, seen from `world_from_camera`, that lie on what any of `surfaces` shows: within [`SEEN`]. A point of which
/// no surface says anything, because nothing was measured there, does not count; one beyond the rim of all pictures does.
pub(super) fn covered(points: &SourcePoints, surfaces: &[&ModelView], world_from_camera: &Isometry3<f64>) -> f64 {
    let ways: Vec<(&ModelView, IntoPicture)> = surfaces
        .iter()
        .map(|s| (*s, IntoPicture::new(&(s.table_from_camera.inverse() * world_from_camera), &s.intrinsics)))
        .collect();
    let (mut on_surface, mut elsewhere) = (0_u32, 0_u32);
    for point in points.points.iter().step_by(PROBE) {
        let (mut is_shown, mut is_blank) = (false, false);
        for (surface, way) in &ways {
            let p = way.place(*point);
            let Some(at) = way.pixel(p) else { continue };
            let q = surface.points[at];
            let d = sub(p, q);
            // Nothing was measured in that pixel.
            is_blank |= q[2] <= 0.0;
            is_shown |= q[2] > 0.0 && dot(d, d) < (SEEN as f32 * p[2]).powi(2);
        }
        match (is_shown, is_blank) {
            (true, _) => on_surface += 1,
            (false, true) => {}
            (false, false) => elsewhere += 1,
        }
    }
    if on_surface < FEWEST_PROBES { 0.0 } else { f64::from(on_surface) / f64::from(on_surface + elsewhere) }
}

/// Correlation of the frame's picture with those of the targets.
fn alike(frame: &Frame, targets: &[Target<'_>], pose: &Isometry3<f64>, seen: f64) -> Option<f64> {
    let own = frame.texture.as_ref()?;
    let gate = PhotometricGate { level: PICTURE_LEVELS - 1, distance: seen as f32, tukey: f32::INFINITY };
    let all = targets.iter().filter_map(|target| {
        let target_from_frame = target.surface.table_from_camera.inverse() * pose;
        Some(photometric::compare(&own.points, target.texture?, target.surface, &target_from_frame, &gate))
    });
    all.fold(Alikeness::default(), Alikeness::and).correlation(FEWEST_COMPARED)
}

/// Standard deviations of the residuals: metres, and normalised grey values.
#[derive(Clone, Copy, Debug)]
struct Noise {
    geometric: f64,
    photometric: f64,
}

/// What one step is computed from.
struct Problem<'a> {
    frame: &'a Frame,
    points: &'a SourcePoints,
    targets: &'a [Target<'a>],
    level: &'a Level,
    reach: f64,
    noise: Noise,
}

/// Normal equations over a twist of the frame's camera, in units of information.
struct Equations {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    noise: Noise,
    left_open: usize,
}

impl Problem<'_> {
    /// The equations at `pose`; `None` where too little is paired.
    fn equations(&self, pose: &Isometry3<f64>) -> Option<Equations> {
        let centre = &self.frame.centre;
        // Surfaces: summed about the frame's centre in its own axes, then freed of what they leave open.
        let (mut surfaces, mut deviations) = (Sum::default(), Mean::default());
        let tukey = ((TUKEY * self.noise.geometric.max(SIGMA_FLOOR.0)) as f32).min(self.reach as f32);
        let gate = Gate { distance: self.reach as f32, cosine: self.level.cosine, tukey, same_label: false };
        for target in self.targets {
            let target_from_frame = target.surface.table_from_camera.inverse() * pose;
            let at = linearise(self.points, target.surface, &target_from_frame, centre, &gate);
            if at.pairs >= FEWEST_PAIRS {
                deviations.add(at.sigma, at.pairs);
                surfaces.add(&at, &target_from_frame, at.sigma.max(SIGMA_FLOOR.0));
            }
        }
        let geometric = deviations.value()?;
        let carry = about(centre);
        let observable =
            project_out_degenerate(&surfaces.hessian, &surfaces.gradient, surfaces.weight, self.frame.radius, WEAKEST);
        let (mut hessian, mut gradient) =
            (carry.transpose() * observable.hessian * carry, carry.transpose() * observable.gradient);
        // Pictures: of the keyframe that shows most.
        let mut photometric = self.noise.photometric;
        if let Some((at, target_from_frame)) = self.pictures(pose, centre) {
            photometric = at.sigma;
            let mut pictures = Sum::default();
            pictures.add(&at, &target_from_frame, at.sigma.max(SIGMA_FLOOR.1));
            let misregistration = covariance_of_prior(MISREGISTRATION, MISREGISTRATION * centre.z);
            let left = left_of(&pictures.hessian, &misregistration);
            hessian += carry.transpose() * left * pictures.hessian * carry;
            gradient += carry.transpose() * left * pictures.gradient;
        }
        let left_open = observable.degeneracy.frozen.len();
        let hessian = 0.5 * (hessian + hessian.transpose());
        Some(Equations { hessian, gradient, noise: Noise { geometric, photometric }, left_open })
    }

    fn pictures(&self, pose: &Isometry3<f64>, centre: &Point3<f64>) -> Option<(Linearised, Isometry3<f64>)> {
        let (own, target) = (self.frame.texture.as_ref()?, self.targets.first()?);
        let target_from_frame = target.surface.table_from_camera.inverse() * pose;
        let gate = PhotometricGate {
            level: self.level.picture,
            distance: (SEEN * centre.z) as f32,
            tukey: ((TUKEY * self.noise.photometric.max(SIGMA_FLOOR.1)) as f32).min(RANGE),
        };
        let at =
            photometric::linearise(&own.points, target.texture?, target.surface, &target_from_frame, centre, &gate);
        (at.pairs >= FEWEST_PAIRS).then_some((at, target_from_frame))
    }
}

/// What is left of normal equations whose residuals share an error of covariance `common`, as a factor from the left: the
/// information is then `(information^-1 + common)^-1`, also where `information` is singular.
pub(super) fn left_of(information: &Matrix6<f64>, common: &Matrix6<f64>) -> Matrix6<f64> {
    (Matrix6::identity() + information * common).try_inverse().unwrap_or_else(Matrix6::zeros)
}

/// Normal equations over a twist about the frame's centre, in its axes, in units of information.
#[derive(Default)]
struct Sum {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    weight: f64,
}

impl Sum {
    fn add(&mut self, at: &Linearised, target_from_frame: &Isometry3<f64>, sigma: f64) {
        let turn = turned(target_from_frame.rotation.to_rotation_matrix().matrix());
        let certainty = 1.0 / (sigma.powi(2) * at.correlation);
        self.hessian += turn.transpose() * at.hessian * turn * certainty;
        self.gradient += turn.transpose() * at.gradient * certainty;
        self.weight += at.weight * certainty;
    }
}

/// Mean by numbers of pairs.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64, pairs: u32) {
        self.sum += value * f64::from(pairs);
        self.count += f64::from(pairs);
    }

    fn value(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}
