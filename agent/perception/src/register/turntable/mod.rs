//! Poses of the views of a turntable by a fixed camera, where nothing recorded them.
//!
//! Views of a part that turns before a room that stands still cannot be registered like others: most of a picture is
//! background, on which "no motion" fits best; the disc is the same from every side; and parts on turntables are often
//! round. But the motion has one axis that all views share, and one unknown angle a view. So the background is found
//! first, by what stays the same over all views (`still`); the disc's or the table's plane gives the axis' direction
//! (`plane`); and the place of the axis and the angles are searched for over all angles, by geometry and colour of what
//! turns (`search`, `profile`). Views are placed where they are sure, each against all that are placed already, and each is
//! tried again at the end without its own say (`chain`). A view that fits in another angle nearly as well is refused.

mod chain;
mod plane;
mod profile;
mod refine;
mod search;
mod still;
mod thinned;

pub use still::{Still, look as look_for_stillness};
pub use thinned::TurningView;

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Fewest views of which a turntable can be told.
pub const FEWEST_VIEWS: usize = 3;

/// The line that a turntable turns about, in the camera's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// A point of it, metres.
    pub point: Point3<f64>,
    /// Its direction, away from the disc towards the part.
    pub direction: Unit<Vector3<f64>>,
}

impl Axis {
    /// The motion of everything on the disc, camera frame, when it turns by `angle` radians.
    pub fn turned(&self, angle: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_axis_angle(&self.direction, angle);
        Isometry3::from_parts(Translation3::from(self.point - rotation * self.point), rotation)
    }

    /// How far `p` is along the axis from its point, and how far from it, metres.
    pub fn height_and_radius(&self, p: &Point3<f64>) -> (f64, f64) {
        let away = p - self.point;
        let height = away.dot(&self.direction);
        (height, (away - self.direction.into_inner() * height).norm())
    }

    /// The frame that turns with the disc, as it stands when the camera sees it at angle 0: the axis is +z, its point the
    /// origin, and the camera is on the side of -x.
    pub fn table_from_camera(&self) -> Isometry3<f64> {
        let z = self.direction.into_inner();
        let to_camera = -self.point.coords;
        let back = to_camera - z * to_camera.dot(&z);
        let x =
            Unit::try_new(-back, 1e-9).unwrap_or_else(|| Unit::new_normalize(z.cross(&Vector3::new(0.3, 0.9, 0.1))));
        let y = z.cross(&x);
        let axes = nalgebra::Matrix3::from_columns(&[x.into_inner(), y, z]);
        let camera_from_table = UnitQuaternion::from_matrix(&axes);
        Isometry3::from_parts(Translation3::from(self.point.coords), camera_from_table).inverse()
    }
}

/// What is known of a turntable beforehand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TurntableConfig {
    /// The axis; estimated if absent.
    pub axis: Option<Axis>,
    /// Radians between two views, of unknown sense of rotation; estimated if absent.
    pub step: Option<f64>,
}

/// The angle of one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewAngle {
    /// How far the disc has turned since the first view that has an angle, about the axis' direction, radians.
    pub radians: f64,
    /// By how much the score of the angle exceeds that of the best other one, in scores of one pair of views.
    pub margin: f64,
    /// The score.
    pub score: f64,
}

/// Why a view has no angle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoAngle {
    /// It fits in two.
    #[error(
        "the angle of the turntable is ambiguous: {angle:.0} degrees score {best:.2} and {other:.0} degrees {next:.2}"
    )]
    Ambiguous {
        /// Degrees from the first placed view.
        angle: f64,
        /// Score.
        best: f64,
        /// Degrees of the rival.
        other: f64,
        /// Its score.
        next: f64,
    },
    /// It fits in none.
    #[error("no angle of the turntable fits: the best scores {best:.2}, and {needed:.2} are needed")]
    NoFit {
        /// Score.
        best: f64,
        /// Least score.
        needed: f64,
    },
    /// It shows nothing that turns.
    #[error("hardly anything that turns is seen in it: {points} points")]
    NothingTurns {
        /// Points.
        points: usize,
    },
}

/// A turntable that was found.
#[derive(Clone, Debug)]
pub struct Turntable {
    /// Its axis; its point lies on the plane of the disc.
    pub axis: Axis,
    /// Farthest from the axis that something turns, metres.
    pub radius: f64,
    /// Largest height above the disc of something that turns, metres.
    pub height: f64,
    /// Each view's angle or why it has none.
    pub angles: Vec<Result<ViewAngle, NoAngle>>,
}

impl Turntable {
    /// Metres below the disc's plane that still turn with it: the noise of its surface.
    const BELOW: f64 = 0.006;

    /// Whether `p` (camera frame) lies where things turn.
    pub fn holds(&self, p: &Point3<f64>) -> bool {
        let (height, radius) = self.axis.height_and_radius(p);
        (-Self::BELOW..=self.height).contains(&height) && radius <= self.radius
    }
}

/// Why no turntable was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TurntableError {
    /// Too few views.
    #[error("{views} views are too few to tell what turns: {FEWEST_VIEWS} are needed")]
    FewViews {
        /// Views that can be used.
        views: usize,
    },
    /// Pictures of other sizes or cameras.
    #[error("view {view} is not of the camera of the first: a turntable mode needs one fixed camera")]
    AnotherCamera {
        /// The view.
        view: usize,
    },
    /// Nothing changes from view to view.
    #[error("nothing turns: depth and colour stay the same in all views but for {pixels} pixels")]
    NothingTurns {
        /// Pixels that change.
        pixels: usize,
    },
    /// Everything changes.
    #[error("hardly anything stands still ({share:.0} % of the pixels): the camera is not fixed")]
    NothingStandsStill {
        /// Per cent.
        share: f64,
    },
    /// The axis has no direction.
    #[error("no plane of a disc or table is seen beneath what turns: say the axis")]
    NoPlane,
    /// The views fit together in two ways.
    #[error(
        "the angles are ambiguous: all views agree with a score of {best:.1} in one way, and of {next:.1} in another"
    )]
    TwoSolutions {
        /// Score.
        best: f64,
        /// Score of the rival.
        next: f64,
    },
    /// Most views have no sure angle, so none is believed.
    #[error("only {placed} of {usable} views that show something that turns have a sure angle: none is believed")]
    FewPlaced {
        /// Views with an angle.
        placed: usize,
        /// Views that show something that turns.
        usable: usize,
    },
}

impl TurntableError {
    /// Whether the camera is fixed and something turns before it, or could be.
    pub fn is_fixed(&self) -> bool {
        !matches!(self, Self::AnotherCamera { .. } | Self::NothingStandsStill { .. } | Self::NothingTurns { .. })
    }
}

/// The axis about which the disc of a posed recording by a fixed camera turns, in the camera's frame, with its point nearest
/// to the camera and either sense; `None` where the cameras do not differ by turns about one axis.
pub fn axis_of_poses(table_from_camera: &[Isometry3<f64>]) -> Option<Axis> {
    /// Least turn that says something of the axis, radians.
    const LEAST_TURN: f64 = 0.05;
    /// Farthest that the motions may be from turns about one axis: radians and metres.
    const AGREE: (f64, f64) = (0.05, 0.01);
    let first = table_from_camera.first()?;
    let motions: Vec<Isometry3<f64>> = table_from_camera[1..]
        .iter()
        .map(|pose| pose.inverse() * first)
        .filter(|m| m.rotation.angle() > LEAST_TURN)
        .collect();
    let mut direction: Option<Vector3<f64>> = None;
    for motion in &motions {
        // The sine weighs: near half a turn the axis' sign is not known, and so it counts little.
        let turn = motion.rotation.axis()?.into_inner() * motion.rotation.angle().sin().abs().max(1e-3);
        direction = Some(direction.map_or(turn, |sum| if sum.dot(&turn) < 0.0 { sum - turn } else { sum + turn }));
    }
    let direction = Unit::try_new(direction?, 1e-9)?;
    // (I - R) c = t for all motions, least squares across the axis.
    let (mut normal, mut right) = (direction.into_inner() * direction.transpose(), Vector3::zeros());
    for motion in &motions {
        let a = nalgebra::Matrix3::identity() - motion.rotation.to_rotation_matrix().into_inner();
        normal += a.transpose() * a;
        right += a.transpose() * motion.translation.vector;
    }
    let point = Point3::from(normal.try_inverse()? * right);
    let agrees = motions.iter().all(|m| {
        let axis = m.rotation.axis().map_or(direction, |a| a);
        axis.dot(&direction).abs() > AGREE.0.cos() && (m * point - point).norm() < AGREE.1
    });
    agrees.then_some(Axis { point, direction })
}

/// Where things turn about a known `axis`: a turntable without angles.
///
/// # Errors
/// [`TurntableError`] where nothing turns or nothing stands still.
pub fn volume(views: &[TurningView], axis: &Axis) -> Result<Turntable, TurntableError> {
    let still = still::look(views)?;
    let stage = plane::stage(views, &still, Some(axis)).ok_or(TurntableError::NoPlane)?;
    Ok(Turntable { axis: stage.axis, radius: stage.radius, height: stage.height, angles: Vec::new() })
}

/// Finds the turntable in `views` of one fixed camera, in the order of capture.
///
/// # Errors
/// [`TurntableError`] where there is none to be found.
pub fn solve(mut views: Vec<TurningView>, config: &TurntableConfig) -> Result<Turntable, TurntableError> {
    let still = still::look(&views)?;
    still::subtract_standing_picture(&mut views);
    let views = &views;
    let Some(stage) = plane::stage(views, &still, config.axis.as_ref()) else { return Err(TurntableError::NoPlane) };
    let found = search::find_axes(views, &stage, config);
    chain::place(views, &found, config)
}
