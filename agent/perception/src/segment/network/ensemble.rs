//! Every member of an ensemble asked about every augmentation of a view.

use super::augment::Drawn;
use super::engine::{EngineError, Tensor};
use super::model::{Answer, NetworkModel};
use super::preprocess::Frame;
use super::uncertainty::Predictions;
use crate::view::View;

/// What an ensemble says of a window of a view.
#[derive(Clone, Debug, Default)]
pub(super) struct Said {
    /// All predictions, at the window's pixels.
    pub(super) predictions: Predictions,
    /// Two-stream: mean share of the colour stream, one value a pixel.
    pub(super) contribution: Option<Vec<f32>>,
    /// Detectors: object of each pixel.
    pub(super) instances: Option<Vec<u16>>,
}

/// Asks all networks of `model` about `view` under each of `augmentations`, of which the first changes nothing.
///
/// # Errors
/// [`EngineError`] if one does not run.
pub(super) fn ask(
    model: &mut NetworkModel,
    view: &View,
    frame: &Frame,
    augmentations: &[Drawn],
) -> Result<Said, EngineError> {
    let input = model.manifest().input.clone();
    let (width, height) = frame.size;
    let plain = frame.tensor(view, &input);
    let shape = vec![1, input.channels.len(), height, width];
    let picture = |t: usize| {
        let drawn: &Drawn = &augmentations[t];
        Tensor { shape: shape.clone(), data: drawn.apply(&plain, &input, frame.size) }
    };
    let take = |t: usize, answer: Answer| {
        let plane = frame.restore(augmentations[t].undo(answer.probabilities.data, frame.size));
        // The picture as it is shows best what each stream contributes, and where objects are.
        let contribution = answer.contribution.filter(|_| t == 0).map(|share| frame.restore(share.data));
        (plane, contribution, answer.objects.filter(|_| t == 0))
    };
    let answers = model.ask_each(augmentations.len(), picture, take)?;
    let classes = model.manifest().classes.len();
    let members = answers.len() / augmentations.len().max(1);
    let (mut planes, mut shares, mut objects) = (Vec::with_capacity(answers.len()), Vec::new(), None);
    for (plane, contribution, found) in answers {
        planes.push(plane);
        shares.extend(contribution);
        objects = objects.or(found);
    }
    let known = |drawn: &Drawn| {
        let known: Vec<f32> = drawn.known(frame.size)?.into_iter().map(|k| f32::from(u8::from(k))).collect();
        Some(frame.restore(known).into_iter().map(|k| k == 1.0).collect())
    };
    let predictions = Predictions {
        classes,
        pixels: frame.window.pixels(),
        members,
        augmentations: augmentations.len(),
        planes,
        valid: augmentations.iter().map(known).collect(),
    };
    let contribution = (!shares.is_empty()).then(|| {
        let mean = |i: usize| shares.iter().map(|share: &Vec<f32>| share[i]).sum::<f32>() / shares.len() as f32;
        (0..frame.window.pixels()).map(mean).collect()
    });
    let instances = objects.map(|o| frame.restore_labels(&o.instances));
    Ok(Said { predictions, contribution, instances })
}
