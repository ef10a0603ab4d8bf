//! Labels that came with the view, recorded masks or simulated truth; or none at all.

use super::class_field::ClassField;
use super::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;

/// Passes a view's recorded labels on; a view without any is refused.
#[derive(Clone, Copy, Debug)]
pub struct RecordedSegmenter;

impl Segmenter for RecordedSegmenter {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let expected = (view.intrinsics.width * view.intrinsics.height) as usize;
        let Some(labels) = &view.labels else { return Err(SegmentError::NoLabels { view: view.index }) };
        let fields =
            [("components", &labels.components), ("defects", &labels.defects), ("instances", &labels.instances)];
        for (field, values) in fields {
            if values.len() != expected {
                return Err(SegmentError::WrongSize { view: view.index, field, found: values.len(), expected });
            }
        }
        Ok(Segmentation {
            components: ClassField::Hard(labels.components.clone()),
            defects: ClassField::Hard(labels.defects.clone()),
            instances: labels.instances.clone(),
            network: None,
        })
    }
}

/// Says nothing of any pixel, whatever labels the view carries: the model is geometry alone. Its points have no evidence
/// for a class, not even for `none`.
#[derive(Clone, Copy, Debug)]
pub struct Unlabelled;

impl Segmenter for Unlabelled {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let pixels = (view.intrinsics.width * view.intrinsics.height) as usize;
        let (probabilities, sigma) = (vec![0; pixels], vec![0; pixels]);
        let nothing = ClassField::Soft { classes: 1, probabilities, sigma, model_sigma: Vec::new() };
        Ok(Segmentation { components: nothing.clone(), defects: nothing, instances: vec![0; pixels], network: None })
    }
}
