//! Class membership of every pixel: certain, or probabilities with their uncertainty.

use semascan_geometry::vote::largest;

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
        /// The part of `sigma` that members of an ensemble make by their disagreement (`sigma^2 = data^2 + model^2`), in the
        /// same unit; [`UNKNOWN_PART`] where it is not known. Empty where it is known nowhere.
        model_sigma: Vec<u8>,
    },
}

/// The model part of a pixel's uncertainty where nobody knows it.
pub const UNKNOWN_PART: u8 = u8::MAX;

impl ClassField {
    /// Bytes of all values.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Hard(labels) => size_of_val(labels.as_slice()),
            Self::Soft { probabilities, sigma, model_sigma, .. } => {
                probabilities.len() + sigma.len() + model_sigma.len()
            }
        }
    }

    /// Uncertainty of pixel `i`.
    pub fn sigma(&self, i: usize) -> f32 {
        match self {
            Self::Hard(_) => 0.0,
            Self::Soft { sigma, .. } => f32::from(sigma.get(i).copied().unwrap_or(u8::MAX)) / 255.0,
        }
    }

    /// The part of the uncertainty of pixel `i` that is the networks': how far members of an ensemble disagree. `None` where it
    /// is not known.
    pub fn model_sigma(&self, i: usize) -> Option<f32> {
        let Self::Soft { model_sigma, .. } = self else { return None };
        model_sigma.get(i).filter(|part| **part != UNKNOWN_PART).map(|part| f32::from(*part) / 255.0)
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
                Self::Soft { classes, probabilities, sigma, model_sigma },
                Self::Soft { classes: others, probabilities: from, sigma: from_sigma, model_sigma: from_part },
            ) if classes == others => {
                let (to, from) =
                    (probabilities.get_mut(i * *classes..(i + 1) * *classes), from.get(j * others..(j + 1) * others));
                if let (Some(to), Some(from), Some(s), Some(t)) = (to, from, sigma.get_mut(i), from_sigma.get(j)) {
                    to.copy_from_slice(from);
                    *s = *t;
                    let part = from_part.get(j).copied().unwrap_or(UNKNOWN_PART);
                    model_sigma.iter_mut().skip(i).take(1).for_each(|p| *p = part);
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
        if let Self::Soft { sigma, model_sigma, .. } = self {
            sigma.iter_mut().skip(i).take(1).for_each(|s| *s = 0);
            model_sigma.iter_mut().skip(i).take(1).for_each(|s| *s = 0);
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
                let each = weight / 255.0;
                for (slot, p) in evidence.iter_mut().zip(p) {
                    *slot += each * f32::from(*p);
                }
            }
        }
    }
}
