//! Every member of an ensemble asked about every augmentation of a view, in one batch a member.

use super::augment::Drawn;
use super::engine::{EngineError, Tensor};
use super::model::Model;
use super::preprocess::Frame;
use super::uncertainty::Predictions;
use crate::acquire::View;

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

/// Asks all networks of `model` about `view` under each of `augmentations`.
///
/// # Errors
/// [`EngineError`] if one does not run.
pub(super) fn ask(model: &mut Model, view: &View, frame: &Frame, augmentations: &[Drawn]) -> Result<Said, EngineError> {
    let input = &model.manifest().input;
    let (width, height) = frame.size;
    let plain = frame.tensor(view, input);
    let batch: Vec<f32> = augmentations.iter().flat_map(|a| a.apply(&plain, input, frame.size)).collect();
    let shape = vec![augmentations.len(), input.channels.len(), height, width];
    let answers = model.ask(&Tensor { shape, data: batch })?;
    let classes = model.manifest().classes.len();
    let pixels = frame.window.pixels();
    let size = width * height;
    let mut said = Said {
        predictions: Predictions {
            classes,
            pixels,
            members: answers.len(),
            augmentations: augmentations.len(),
            planes: Vec::with_capacity(answers.len() * augmentations.len()),
            valid: vec![None; augmentations.len()],
        },
        contribution: None,
        instances: answers.first().and_then(|a| a.objects.as_ref()).map(|o| frame.restore_labels(&o.instances)),
    };
    let restore = |planes: &[f32]| planes.chunks_exact(size.max(1)).flat_map(|p| frame.restore(p)).collect::<Vec<_>>();
    let mut contributions = 0.0;
    for answer in &answers {
        let pictures = answer.probabilities.data.chunks_exact((classes * size).max(1));
        for (t, (drawn, picture)) in augmentations.iter().zip(pictures).enumerate() {
            let undone = drawn.undo(picture, frame.size);
            said.predictions.planes.push(restore(&undone.planes));
            if let (Some(valid), None) = (undone.valid, &said.predictions.valid[t]) {
                let known = restore(&valid.iter().map(|v| f32::from(u8::from(*v))).collect::<Vec<_>>());
                said.predictions.valid[t] = Some(known.into_iter().map(|v| v == 1.0).collect());
            }
        }
        // The picture as it is shows best what each stream contributes.
        let share = answer.contribution.as_ref().and_then(|c| c.data.get(..size));
        if let (Some(share), Some(Drawn::Identity)) = (share, augmentations.first()) {
            let sum = said.contribution.get_or_insert_with(|| vec![0.0; pixels]);
            sum.iter_mut().zip(frame.restore(share)).for_each(|(sum, s)| *sum += s);
            contributions += 1.0;
        }
    }
    if let Some(share) = &mut said.contribution {
        share.iter_mut().for_each(|s| *s = (*s / contributions).clamp(0.0, 1.0));
    }
    Ok(said)
}
