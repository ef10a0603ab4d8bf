//! Labels that came with the view, recorded masks or simulated truth; or none at all.

use super::class_field::ClassField;
use super::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::{RecordedLabels, View};

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
            components: field(&labels.components),
            defects: field(&labels.defects),
            instances: labels.instances.clone(),
            network: None,
        })
    }
}

/// Labels as they are; those that nobody knows give no evidence for a class, not for none either.
fn field(labels: &[u16]) -> ClassField {
    if !labels.contains(&RecordedLabels::UNKNOWN) {
        return ClassField::Hard(labels.to_vec());
    }
    let known = labels.iter().filter(|class| **class != RecordedLabels::UNKNOWN);
    let classes = usize::from(known.copied().max().unwrap_or(0)) + 1;
    let mut probabilities = vec![0; labels.len() * classes];
    let mut sigma = vec![0; labels.len()];
    for (i, class) in labels.iter().enumerate() {
        match *class {
            RecordedLabels::UNKNOWN => sigma[i] = u8::MAX,
            class => probabilities[i * classes + usize::from(class)] = u8::MAX,
        }
    }
    ClassField::Soft { classes, probabilities, sigma, model_sigma: Vec::new() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_knows_is_no_evidence_and_the_rest_votes_as_before() {
        assert_eq!(field(&[0, 2, 1]), ClassField::Hard(vec![0, 2, 1]));
        let labels = [0, 2, RecordedLabels::UNKNOWN, 1];
        let (said, hard) = (field(&labels), ClassField::Hard(labels.to_vec()));
        for i in [0, 1, 3] {
            let (mut votes, mut expected) = ([0.0; 4], [0.0; 4]);
            said.add_evidence(i, 0.7, &mut votes);
            hard.add_evidence(i, 0.7, &mut expected);
            assert_eq!((votes, said.sigma(i)), (expected, 0.0), "{i}");
        }
        let mut votes = [0.0; 4];
        said.add_evidence(2, 0.7, &mut votes);
        assert_eq!((votes, said.sigma(2)), ([0.0; 4], 1.0));
        let mut nothing = [0.0; 4];
        field(&[RecordedLabels::UNKNOWN; 2]).add_evidence(1, 1.0, &mut nothing);
        assert_eq!(nothing, [0.0; 4]);
    }
}
