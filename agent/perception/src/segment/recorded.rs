//! Labels that came with the view: recorded masks or simulated truth; or none at all.

use super::class_field::ClassField;
use super::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;

/// Passes a view's recorded labels on.
#[derive(Clone, Copy, Debug)]
pub struct RecordedSegmenter {
    /// Refuse views without labels; otherwise they count as unlabelled.
    pub required: bool,
}

impl Segmenter for RecordedSegmenter {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let expected = (view.intrinsics.width * view.intrinsics.height) as usize;
        let Some(labels) = &view.labels else {
            if self.required {
                return Err(SegmentError::NoLabels { view: view.index });
            }
            let zeros = vec![0; expected];
            return Ok(Segmentation {
                components: ClassField::Hard(zeros.clone()),
                defects: ClassField::Hard(zeros.clone()),
                instances: zeros,
                network: None,
            });
        };
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
