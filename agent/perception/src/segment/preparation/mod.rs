//! Image preparation ([Wang 2023], "Image processing"): what a picture is freed of before it is segmented and fused.
//!
//! Noise first: its type and level are measured in the wavelet domain ([`noise`]), and the matching filter takes it out
//! ([`denoise`]). Then the background: by edges and an active contour as the paper does ([`contour`]), or, where the
//! cell knows its measuring volume, by geometry ([`volume`]), which needs no guess. Each can be on or off; [`Prepared`]
//! puts them before any segmenter.

pub mod contour;
pub mod denoise;
pub mod noise;
pub mod volume;
mod wavelet;

use super::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;
use contour::Snake;
use nalgebra::Point3;
use std::sync::Arc;

/// How background and part are separated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// It is kept.
    #[default]
    Kept,
    /// By edges and an active contour around them.
    Contour(Snake),
    /// Pixels whose points lie outside this box (min and max corner, metres, table frame).
    Volume(Point3<f64>, Point3<f64>),
}

/// What is done to a view before it is segmented.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Preparation {
    /// Noise is measured and filtered.
    pub denoise: bool,
    /// What becomes of the background.
    pub background: Background,
}

/// A segmenter that sees prepared pictures; what they show of the background is of no class, and certainly so.
pub struct Prepared<S> {
    segmenter: S,
    preparation: Preparation,
}

impl<S: Segmenter> Prepared<S> {
    /// Puts `preparation` before `segmenter`.
    pub fn new(segmenter: S, preparation: Preparation) -> Self {
        Self { segmenter, preparation }
    }
}

impl Preparation {
    /// The background of `view`, row-major: true where nothing of the part shows.
    pub fn background_of(&self, view: &View) -> Option<Vec<bool>> {
        match &self.background {
            Background::Kept => None,
            Background::Contour(snake) => Some(contour::background(&view.rgb, snake)),
            Background::Volume(low, high) => volume::background(view, low, high),
        }
    }
}

impl<S: Segmenter> Segmenter for Prepared<S> {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let quiet = if self.preparation.denoise { denoise::denoised(&view.rgb) } else { None };
        let background = self.preparation.background_of(view);
        let mut segmentation = match quiet {
            Some(rgb) => self.segmenter.segment(&View { rgb: Arc::new(rgb), ..view.clone() })?,
            None => self.segmenter.segment(view)?,
        };
        for (i, _) in background.iter().flatten().enumerate().filter(|(_, outside)| **outside) {
            segmentation.components.set_certain(i, 0);
            segmentation.defects.set_certain(i, 0);
            if let Some(instance) = segmentation.instances.get_mut(i) {
                *instance = 0;
            }
        }
        Ok(segmentation)
    }
}
