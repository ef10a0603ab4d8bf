//! One view before the networks: components first, where the part may turn out to be larger than was thought; defects and
//! objects when it is known how large.

use super::canvas::{Canvas, byte};
use super::{Labeller, NetworkSegmenter};
use crate::segment::class_field::ClassField;
use crate::segment::network::augment::{Augmentation, Drawn};
use crate::segment::network::config::{NetworkConfig, ViewDetail};
use crate::segment::network::domain::disagreement;
use crate::segment::network::engine::{EngineError, Tensor};
use crate::segment::network::ensemble;
use crate::segment::network::glance::Glance;
use crate::segment::network::objects::{from_centres, from_detections};
use crate::segment::network::picture_statistics::statistics;
use crate::segment::network::preprocess::Frame;
use crate::segment::network::region::Window;
use crate::segment::network::scale;
use crate::segment::network::uncertainty::{Estimate, UncertaintyFigures, UncertaintySettings};
use crate::segment::segmentation::Segmentation;
use crate::view::View;
use semascan_model::record::DomainRecord;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// What the components' network said of a view.
#[derive(Debug)]
pub(super) struct Look {
    /// What the picture is shrunk by for the networks.
    factor: u32,
    /// The shrunk picture, where the factor is not 1.
    shrunk: Option<View>,
    /// Where networks look, in the shrunk picture's pixels.
    window: Option<Window>,
    components: ClassField,
    /// Objects, of a detector.
    objects: Option<Vec<u16>>,
    detail: ViewDetail,
    /// How the picture is varied: the same for all networks of the view.
    drawn: Vec<Drawn>,
}

impl NetworkSegmenter {
    /// Asks the components' network about what `window` shows, at the scale that it was trained at. Outside of it the part
    /// is not, or what `glance` saw. `before` is what was said of a smaller window.
    pub(super) fn look(
        &mut self,
        view: &View,
        window: Option<Window>,
        glance: Option<&Glance>,
        before: Option<Look>,
    ) -> Result<Look, EngineError> {
        let factor = window.map_or(1, |window| scale::factor(view, window, &self.components.model.manifest().input));
        let shrunk = before.filter(|before| before.factor == factor).and_then(|before| before.shrunk);
        let shrunk = shrunk.or_else(|| (factor > 1).then(|| scale::shrunk(view, factor)));
        let seen = shrunk.as_ref().unwrap_or(view);
        let window = window.map(|window| if factor > 1 { window.shrunk(factor) } else { window });
        let drawn = self.augmentations(view.index);
        let mut detail = ViewDetail { window, ..ViewDetail::default() };
        let picture = (seen.intrinsics.width, seen.intrinsics.height);
        let pixels = picture.0 as usize * picture.1 as usize;

        // The ensemble's mean is the label, its scatter the uncertainty. A detector gives objects as well.
        let mut canvas = Canvas::new(picture, self.taxonomy.component_count());
        if let Some(glance) = glance {
            canvas.sketch(glance, factor, &self.components.numbers);
        }
        let mut objects = None;
        if let Some(window) = window {
            let labeller = &mut self.components;
            let frame = Frame::new(window, picture, &labeller.model.manifest().input);
            let said = ensemble::ask(&mut labeller.model, seen, &frame, &drawn)?;
            let estimate = said.predictions.estimate(&self.config.uncertainty);
            canvas.paint(window, &estimate, &labeller.numbers);
            detail.components = estimate.figures;
            // Whether it is a picture that they know: a network is as sure of what it has never seen.
            detail.domain = self.domain(seen, window, &estimate.figures);
            if detail.domain.is_some_and(|domain| domain.outside) {
                // What a glance said of the rest is worth no more.
                let doubted = if glance.is_some() { Window::whole(picture.0, picture.1) } else { window };
                canvas.doubt(doubted, &mut detail.components);
            }
            detail.contribution = said.contribution.map(|share| {
                let bytes: Vec<u8> = share.into_iter().map(byte).collect();
                spread(picture.0, pixels, window, &bytes)
            });
            objects = said.instances.map(|i| spread(picture.0, pixels, window, &i));
        }
        Ok(Look { factor, window, components: canvas.field(), objects, detail, drawn, shrunk })
    }

    /// Asks the other networks about what `look` has found, and says all of it in `view`'s own pixels.
    pub(super) fn complete(
        &mut self,
        view: &View,
        look: Look,
        glance: Option<&Glance>,
    ) -> Result<Segmentation, EngineError> {
        let Look { factor, window, components, objects, mut detail, drawn, shrunk } = look;
        let seen = shrunk.as_ref().unwrap_or(view);
        let picture = (seen.intrinsics.width, seen.intrinsics.height);
        let doubted = detail.domain.is_some_and(|domain| domain.outside);
        let pixels = picture.0 * picture.1;
        let labels: Vec<u16> = (0..pixels as usize).map(|i| components.best(i)).collect();

        // Defects and objects do not need each other. Objects are those of the detector above, of an instance network, or
        // of the one that labels the components too.
        let own = Some(&mut self.components).filter(|labeller| labeller.model.separates_objects());
        let separating = self.instances.as_mut().or(own);
        let find_objects = || match (separating, window, objects) {
            (_, _, Some(found)) => Ok(found),
            (Some(labeller), Some(window), None) => separate(labeller, seen, window, &labels),
            // Nothing separates objects of one class: the class is the object.
            _ => Ok(labels),
        };
        let (defects, config) = (&mut self.defects, &self.config);
        let find_defects = || {
            let (Some(labeller), Some(window)) = (defects.as_mut(), window) else { return Ok(None) };
            estimate_defects(labeller, seen, window, &drawn, config).map(Some)
        };
        let (estimate, instances) = rayon::join(find_defects, find_objects);
        let (estimate, instances) = (estimate?, instances?);

        // Where only a glance was cast, or no network knows defects, nobody looked for them.
        let unlooked = self.defects.is_none() || estimate.is_some() && glance.is_some();
        let blank = if unlooked { Canvas::unknown } else { Canvas::new };
        let mut canvas = blank(picture, self.taxonomy.defect_count());
        if let (Some(labeller), Some(window), Some(estimate)) = (&self.defects, window, estimate) {
            canvas.paint(window, &estimate, &labeller.numbers);
            let mut figures = estimate.figures;
            if doubted {
                canvas.doubt(window, &mut figures);
            }
            detail.defects = Some(figures);
        }
        let defects = canvas.field();
        let said = Segmentation { components, defects, instances, network: Some(Arc::new(detail)) };
        let full = (view.intrinsics.width, view.intrinsics.height);
        Ok(if factor > 1 { scale::enlarged(said, factor, full) } else { said })
    }

    /// Whether a view is of the world that the models were trained for: the picture's statistics, and how far the ensemble
    /// disagrees where it is asked as it was calibrated. `None` where no model is calibrated or pictures were prepared.
    fn domain(&self, view: &View, window: Window, figures: &UncertaintyFigures) -> Option<DomainRecord> {
        let numbers = statistics(&view.rgb, window).filter(|_| self.config.judge_domain)?;
        let default = NetworkConfig::default();
        let (asked, calibrated) = (&self.config.uncertainty, &default.uncertainty);
        let as_calibrated = (asked.statistic, asked.ddof) == (calibrated.statistic, calibrated.ddof)
            && self.config.augmentations == default.augmentations;
        let disagreement = disagreement(figures).filter(|_| as_calibrated);
        // A model of defects has a say of its own about the picture; the disagreement is that of the components.
        let verdicts =
            [(Some(&self.components), disagreement), (self.defects.as_ref(), None)].map(|(labeller, disagreement)| {
                Some(labeller?.model.manifest().domain.as_ref()?.judge(&numbers, disagreement))
            });
        let [of_components, of_defects] = verdicts;
        match (of_components, of_defects) {
            (Some(inside), Some(outside)) if outside.outside && !inside.outside => Some(outside),
            (of_components, of_defects) => of_components.or(of_defects),
        }
    }

    /// The augmentations of a view: the same for every network, so that their scatter can be told apart.
    fn augmentations(&self, view: u32) -> Vec<Drawn> {
        let draw = |(place, kind): (usize, &Augmentation)| {
            let key = (u64::from(view) << 32 | place as u64).to_le_bytes();
            Drawn::new(*kind, xxh3_64_with_seed(&key, self.config.seed))
        };
        self.config.augmentations.iter().enumerate().map(draw).collect()
    }
}

impl Look {
    /// Whether the part goes on beyond the window: something other than none lies along its rim, where that is not the rim
    /// of the picture.
    pub(super) fn cuts_the_part(&self, view: &View) -> bool {
        let seen = self.shrunk.as_ref().unwrap_or(view).intrinsics;
        self.window.is_some_and(|window| reaches_rim(&self.components, window, (seen.width, seen.height)))
    }
}

/// This part of a window's side has to show the part for it to be cut short there.
const AT_THE_RIM: u32 = 40;

/// Probabilities of defects in a window of a view: as with components, with a threshold of their own.
fn estimate_defects(
    labeller: &mut Labeller,
    view: &View,
    window: Window,
    drawn: &[Drawn],
    config: &NetworkConfig,
) -> Result<Estimate, EngineError> {
    let picture = (view.intrinsics.width, view.intrinsics.height);
    let frame = Frame::new(window, picture, &labeller.model.manifest().input);
    let said = ensemble::ask(&mut labeller.model, view, &frame, drawn)?;
    Ok(said.predictions.estimate(&UncertaintySettings { threshold: config.defect_threshold, ..config.uncertainty }))
}

/// Objects of a view whose pixels have `labels`, by the centres that an instance network finds.
fn separate(labeller: &mut Labeller, view: &View, window: Window, labels: &[u16]) -> Result<Vec<u16>, EngineError> {
    let picture = (view.intrinsics.width, view.intrinsics.height);
    let manifest = labeller.model.manifest();
    let frame = Frame::new(window, picture, &manifest.input);
    let (width, height) = frame.size;
    let classes = manifest.classes.len();
    let input = Tensor {
        shape: vec![1, manifest.input.channels.len(), height, width],
        data: frame.tensor(view, &manifest.input),
    };
    let file = labeller.model.folder().to_owned();
    let own: Vec<u16> = frame
        .labels(labels, picture.0)
        .into_iter()
        .map(|label| labeller.numbers.iter().position(|n| *n == label).unwrap_or(0) as u16)
        .collect();
    let detects = manifest.output.boxes.is_some();
    let outputs = labeller.model.outputs(&input)?;
    let objects = if detects {
        from_detections(&outputs, classes, frame.size).map(|(_, objects)| objects)
    } else {
        from_centres(&outputs, classes, &own, frame.size)
    };
    let objects = objects.map_err(|e| EngineError::Run { file, reason: e.to_string() })?;
    Ok(spread(picture.0, labels.len(), window, &frame.restore_labels(&objects.instances)))
}

/// Values of a window on a picture of `columns` and `pixels`, the rest zero.
fn spread<T: Copy + Default>(columns: u32, pixels: usize, window: Window, values: &[T]) -> Vec<T> {
    let mut picture = vec![T::default(); pixels];
    for (row, values) in values.chunks_exact(window.width.max(1) as usize).enumerate() {
        let start = (window.top as usize + row) * columns as usize + window.left as usize;
        picture[start..start + values.len()].copy_from_slice(values);
    }
    picture
}

/// Whether the part goes on beyond `window`: something other than none lies along its rim, where that is not the rim of the
/// picture (columns, rows).
pub(super) fn reaches_rim(components: &ClassField, window: Window, picture: (u32, u32)) -> bool {
    let Window { left, top, width, height } = window;
    let (right, bottom) = (left + width - 1, top + height - 1);
    let at = |u: u32, v: u32| components.best((v * picture.0 + u) as usize) != 0;
    let many = |pixels: usize, side: u32| pixels as u32 * AT_THE_RIM > side;
    let beside = |u: u32| many((top..=bottom).filter(|&v| at(u, v)).count(), height);
    let along = |v: u32| many((left..=right).filter(|&u| at(u, v)).count(), width);
    left > 0 && beside(left)
        || right + 1 < picture.0 && beside(right)
        || top > 0 && along(top)
        || bottom + 1 < picture.1 && along(bottom)
}
