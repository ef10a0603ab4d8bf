//! How well a camera is tracked, and why it is lost.

use super::super::se3::log;
use super::alignment::Alignment;
use super::motion::Motion;
use nalgebra::Isometry3;

/// Share of a frame's points that must lie on the model.
const LEAST_OVERLAP: f64 = 0.3;
/// Largest standard deviation of the distances, metres a metre of distance.
const LARGEST_SIGMA: f64 = 0.02;
/// Farthest that a frame may lie from where it was foreseen, in standard deviations, and what is never too far: radians, metres.
const FARTHEST: f64 = 8.0;
const NEAR: (f64, f64) = (0.12, 0.12);
/// Correlation of the pictures below which surfaces that agree are another place.
const UNLIKE: f64 = 0.0;

/// Why a frame has no pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Lost {
    /// The view has hardly any depth.
    #[error("the view has hardly any depth")]
    NoDepth,
    /// Hardly a point of it meets the model.
    #[error("nothing of the view meets the model")]
    Nowhere,
    /// Too little of it lies on the model.
    #[error("{found:.0} % of the view lie on the model, {needed:.0} % are needed")]
    LittleOverlap {
        /// Per cent.
        found: f64,
        /// Per cent.
        needed: f64,
    },
    /// The surfaces do not fit.
    #[error("the surfaces are {found:.1} mm apart at the median, at most {most:.1} mm can be noise")]
    Rough {
        /// Standard deviation, millimetres.
        found: f64,
        /// Millimetres.
        most: f64,
    },
    /// The pictures are of another place.
    #[error("the surfaces fit, but the pictures correlate by {correlation:.2} only")]
    Unlike {
        /// -1 to 1.
        correlation: f64,
    },
    /// The camera would have jumped.
    #[error("the camera would have jumped by {shift:.0} mm and {turn:.1} degrees from where it was heading")]
    Jump {
        /// Millimetres.
        shift: f64,
        /// Degrees.
        turn: f64,
    },
}

/// How well a frame was tracked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// Share of its points that lie on the model.
    pub overlap: f64,
    /// Standard deviation of their distances from it, metres.
    pub sigma: f64,
    /// Correlation of its picture with those of the keyframes, -1 to 1; `None` where they have too little in common.
    pub alike: Option<f64>,
    /// Directions that the surface leaves open and that the picture, or else the motion, has to hold.
    pub left_open: usize,
}

impl Health {
    /// Of an alignment that holds by itself, `distance` metres from the surface.
    ///
    /// # Errors
    /// [`Lost`]: why it does not.
    pub(super) fn of(alignment: &Alignment, distance: f64) -> Result<Self, Lost> {
        let Alignment { overlap, sigma, alike, left_open, .. } = *alignment;
        if overlap < LEAST_OVERLAP {
            return Err(Lost::LittleOverlap { found: overlap * 100.0, needed: LEAST_OVERLAP * 100.0 });
        }
        let most = LARGEST_SIGMA * distance;
        if sigma > most {
            return Err(Lost::Rough { found: sigma * 1e3, most: most * 1e3 });
        }
        if let Some(correlation) = alike.filter(|alike| *alike < UNLIKE) {
            return Err(Lost::Unlike { correlation });
        }
        Ok(Self { overlap, sigma, alike, left_open })
    }
}

/// Whether a camera that was at `last` can be at `now`.
///
/// # Errors
/// [`Lost::Jump`].
pub(super) fn plausible(motion: &Motion, last: &Isometry3<f64>, now: &Isometry3<f64>) -> Result<(), Lost> {
    let off = log(&motion.predict(last), now);
    let (turn, shift) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
    let (sigma_turn, sigma_shift) = motion.sigma();
    if turn > NEAR.0.max(FARTHEST * sigma_turn) || shift > NEAR.1.max(FARTHEST * sigma_shift) {
        return Err(Lost::Jump { shift: shift * 1e3, turn: turn.to_degrees() });
    }
    Ok(())
}
