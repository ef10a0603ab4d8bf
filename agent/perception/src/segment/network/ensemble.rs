//! Every member of an ensemble asked about every augmentation of a view, in one batch a member.

use super::augment::Drawn;
use super::engine::{EngineError, Tensor};
use super::model::NetworkModel;
use super::preprocess::Frame;
use super::uncertainty::Predictions;
use crate::view::View;
use rayon::prelude::*;

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
    let input = &model.manifest().input;
    let (width, height) = frame.size;
    let plain = frame.tensor(view, input);
    let batch: Vec<f32> = augmentations.iter().flat_map(|a| a.apply(&plain, input, frame.size)).collect();
    let shape = vec![augmentations.len(), input.channels.len(), height, width];
    let answers = model.ask(&Tensor { shape, data: batch })?;
    let classes = model.manifest().classes.len();
    let size = width * height;
    // A prediction belongs to a member, then to an augmentation.
    let jobs: Vec<(&[f32], &Drawn)> = answers
        .iter()
        .flat_map(|answer| answer.probabilities.data.chunks_exact((classes * size).max(1)).zip(augmentations))
        .collect();
    let planes = jobs.par_iter().map(|(picture, drawn)| frame.restore(&drawn.undo(picture, frame.size))).collect();
    let known = |drawn: &Drawn| {
        let known: Vec<f32> = drawn.known(frame.size)?.into_iter().map(|k| f32::from(u8::from(k))).collect();
        Some(frame.restore(&known).into_iter().map(|k| k == 1.0).collect())
    };
    let predictions = Predictions {
        classes,
        pixels: frame.window.pixels(),
        members: answers.len(),
        augmentations: augmentations.len(),
        planes,
        valid: augmentations.iter().map(known).collect(),
    };
    // The picture as it is shows best what each stream contributes.
    let shares: Vec<&[f32]> = answers.iter().filter_map(|a| a.contribution.as_ref()?.data.get(..size)).collect();
    let contribution = (!shares.is_empty()).then(|| {
        frame.restore(
            &(0..size).map(|i| shares.iter().map(|s| s[i]).sum::<f32>() / shares.len() as f32).collect::<Vec<_>>(),
        )
    });
    let instances = answers.first().and_then(|a| a.objects.as_ref()).map(|o| frame.restore_labels(&o.instances));
    Ok(Said { predictions, contribution, instances })
}
