//! Pixels -> class probabilities and uncertainty.
//!
//! A [`Segmenter`] is the seam that networks plug into; [`RecordedSegmenter`] passes on labels that came with the view
//! (recorded masks, simulated truth), [`network::NetworkSegmenter`] asks trained networks. [`preparation`] frees pictures
//! of noise and background first, [`GeometricSegmenter`] fits another's masks to the geometry, [`Degraded`] spoils
//! them as networks do.

mod degrade;
pub mod geometric;
pub mod network;
pub mod preparation;
mod recorded;

pub use degrade::{Degradation, Degraded};
pub use geometric::GeometricSegmenter;
pub use recorded::RecordedSegmenter;

use crate::view::View;
use semascan_geometry::vote::largest;
use std::sync::Arc;

/// Class membership of every pixel, row-major.
#[derive(Clone, Debug, PartialEq)]
pub enum ClassField {
    /// One class a pixel, certain.
    Hard(Vec<u16>),
    /// `classes` probabilities a pixel, pixel-major, with the uncertainty `sigma = sqrt(sum_c u_c^2)` of each pixel.
    /// Eight bits each: 48 kept views of six classes fit in memory, and what is fused is what a rebuild fuses again.
    Soft {
        /// Number of classes, `none` included.
        classes: usize,
        /// `pixels * classes` values, 255 = certain.
        probabilities: Vec<u8>,
        /// One value a pixel, 255 = 1.
        sigma: Vec<u8>,
    },
}

impl ClassField {
    /// Uncertainty of pixel `i`.
    pub fn sigma(&self, i: usize) -> f32 {
        match self {
            Self::Hard(_) => 0.0,
            Self::Soft { sigma, .. } => f32::from(sigma.get(i).copied().unwrap_or(u8::MAX)) / 255.0,
        }
    }

    /// Most probable class of pixel `i`; 0 past the end.
    pub fn best(&self, i: usize) -> u16 {
        match self {
            Self::Hard(labels) => labels.get(i).copied().unwrap_or(0),
            Self::Soft { classes, probabilities, .. } => {
                let p = probabilities.get(i * classes..(i + 1) * classes).unwrap_or(&[]);
                largest(p, 0) as u16
            }
        }
    }

    /// Makes pixel `i` what pixel `j` of `other` is. Nothing happens where either is past the end, or the fields are not
    /// of one kind.
    pub(crate) fn copy_from(&mut self, i: usize, other: &Self, j: usize) {
        match (self, other) {
            (Self::Hard(labels), Self::Hard(others)) => {
                if let (Some(label), Some(other)) = (labels.get_mut(i), others.get(j)) {
                    *label = *other;
                }
            }
            (
                Self::Soft { classes, probabilities, sigma },
                Self::Soft { classes: others, probabilities: from, sigma: from_sigma },
            ) if classes == others => {
                let (to, from) =
                    (probabilities.get_mut(i * *classes..(i + 1) * *classes), from.get(j * others..(j + 1) * others));
                if let (Some(to), Some(from), Some(s), Some(t)) = (to, from, sigma.get_mut(i), from_sigma.get(j)) {
                    to.copy_from_slice(from);
                    *s = *t;
                }
            }
            _ => {}
        }
    }

    /// Makes pixel `i` certainly of `class`; its uncertainty stays. Nothing happens past the end.
    pub(crate) fn set(&mut self, i: usize, class: u16) {
        match self {
            Self::Hard(labels) => {
                if let Some(label) = labels.get_mut(i) {
                    *label = class;
                }
            }
            Self::Soft { classes, probabilities, .. } => {
                if let Some(p) = probabilities.get_mut(i * *classes..(i + 1) * *classes) {
                    p.fill(0);
                    p.iter_mut().skip(usize::from(class)).take(1).for_each(|p| *p = u8::MAX);
                }
            }
        }
    }

    /// As [`Self::set`], and nothing of its uncertainty stays.
    pub(crate) fn set_certain(&mut self, i: usize, class: u16) {
        self.set(i, class);
        if let Self::Soft { sigma, .. } = self {
            sigma.iter_mut().skip(i).take(1).for_each(|s| *s = 0);
        }
    }

    /// Adds `weight` times pixel `i`'s class probabilities to `evidence` (one slot a class).
    pub fn add_evidence(&self, i: usize, weight: f32, evidence: &mut [f32]) {
        match self {
            Self::Hard(labels) => {
                if let Some(slot) = labels.get(i).and_then(|&c| evidence.get_mut(usize::from(c))) {
                    *slot += weight;
                }
            }
            Self::Soft { classes, probabilities, .. } => {
                let p = probabilities.get(i * classes..(i + 1) * classes).unwrap_or(&[]);
                for (slot, p) in evidence.iter_mut().zip(p) {
                    *slot += weight * f32::from(*p) / 255.0;
                }
            }
        }
    }
}

/// What a segmenter says of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation {
    /// Component classes (column K of P0 Eq. 2).
    pub components: ClassField,
    /// Defect classes (column D of P0 Eq. 3); each task has an uncertainty of its own.
    pub defects: ClassField,
    /// Instance of each pixel; 0 = not separated.
    pub instances: Vec<u16>,
    /// What networks said beyond labels, for overlays and the record; not kept with the view.
    pub network: Option<Arc<network::ViewDetail>>,
}

/// Why a view could not be segmented.
#[derive(Debug, thiserror::Error)]
pub enum SegmentError {
    /// The view has no recorded labels although they were asked for.
    #[error("view {view} carries no recorded labels")]
    NoLabels {
        /// The view.
        view: u32,
    },
    /// The labels do not fit the picture.
    #[error("view {view}: {field} holds {found} values for {expected} pixels")]
    WrongSize {
        /// The view.
        view: u32,
        /// What does not fit.
        field: &'static str,
        /// Its length.
        found: usize,
        /// The number of pixels.
        expected: usize,
    },
    /// A network did not run.
    #[error("view {view}: {reason}")]
    Network {
        /// The view.
        view: u32,
        /// Why.
        reason: String,
    },
}

impl<S: Segmenter + ?Sized> Segmenter for Box<S> {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        self.as_mut().segment(view)
    }
}

/// Labels every pixel of a view.
pub trait Segmenter: Send {
    /// Class probabilities of `view`'s pixels.
    ///
    /// # Errors
    /// [`SegmentError`] if the view cannot be segmented; it is then reported and left out.
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError>;
}
