//! What a segmenter says of a view, and the seam that segmenters plug into.

use super::class_field::ClassField;
use super::network::config::ViewDetail;
use crate::view::View;
use std::sync::Arc;

/// What a segmenter says of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation {
    /// Component classes (column K of [Remanufacturing paper], Eq. 2).
    pub components: ClassField,
    /// Defect classes (column D of [Remanufacturing paper], Eq. 3); each task has an uncertainty of its own.
    pub defects: ClassField,
    /// Instance of each pixel; 0 = not separated.
    pub instances: Vec<u16>,
    /// What networks said beyond labels, for overlays and the record; not kept with the view.
    pub network: Option<Arc<ViewDetail>>,
}

/// Why a view could not be segmented.
#[derive(Debug, thiserror::Error)]
pub enum SegmentError {
    /// The view has no recorded labels although they were asked for.
    #[error("view {view} carries no recorded labels (--labels network or none does without)")]
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
