//! Networks as a [`Segmenter`]: components, defects where a network knows them, and objects where one separates them.

use super::augment::Drawn;
use super::config::{ModelReport, NetworkConfig, NetworkReport, Region, ViewDetail};
use super::domain::disagreement;
use super::engine::{EngineDescription, EngineError, Tensor};
use super::ensemble;
use super::glance::{Glance, glance};
use super::manifest::Task;
use super::model::NetworkModel;
use super::objects::{from_centres, from_detections};
use super::picture_statistics::statistics;
use super::preprocess::Frame;
use super::region::{Sight, Volume, Window};
use super::scale;
use super::taxonomy::numbers;
use super::uncertainty::{Estimate, UncertaintyFigures, UncertaintySettings};
use crate::segment::class_field::ClassField;
use crate::segment::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;
use semascan_model::record::DomainRecord;
use semascan_model::{ClassDef, Taxonomy};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Why models do not make up a segmenter.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SetupError {
    /// A setting is out of range.
    #[error("network.{field}: {reason}")]
    Setting {
        /// The setting.
        field: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// Two models say the same, or none labels components.
    #[error("{0}")]
    Models(String),
    /// A model's class has no place in the inspection.
    #[error("model {model}: class {class:?} is not among the classes of the inspection")]
    Class {
        /// The model.
        model: String,
        /// Its class.
        class: String,
    },
}

/// A window that cuts the part short grows by this part of its larger side in each direction.
const WIDENING: u32 = 3;
/// This part of a window's side has to show the part for it to be cut short there.
const AT_THE_RIM: u32 = 40;

/// A model and the numbers that the inspection gives its classes.
#[derive(Debug)]
struct Labeller {
    model: NetworkModel,
    numbers: Vec<u16>,
}

impl Labeller {
    fn new(model: NetworkModel, classes: &[ClassDef]) -> Result<Self, SetupError> {
        let name = model.manifest().name.clone();
        let numbers = numbers(model.manifest(), classes).map_err(|class| SetupError::Class { model: name, class })?;
        Ok(Self { model, numbers })
    }
}

/// Labels views with trained networks.
#[derive(Debug)]
pub struct NetworkSegmenter {
    components: Labeller,
    defects: Option<Labeller>,
    instances: Option<Labeller>,
    config: NetworkConfig,
    volume: Option<Volume>,
    taxonomy: Taxonomy,
    report: NetworkReport,
}

impl NetworkSegmenter {
    /// A segmenter of `models`, which `engine` runs: one for components (a detector will do), one for defects and one for
    /// objects where wanted. `taxonomy` has the
    /// classes of the inspection; `volume` (table frame, metres) is where networks look, everywhere if absent.
    ///
    /// # Errors
    /// [`SetupError`] if the models do not go together or a setting is out of range.
    pub fn new(
        models: Vec<NetworkModel>,
        engine: EngineDescription,
        taxonomy: &Taxonomy,
        volume: Option<Volume>,
        config: NetworkConfig,
    ) -> Result<Self, SetupError> {
        config.check().map_err(|(field, reason)| SetupError::Setting { field, reason })?;
        let report = NetworkReport {
            models: models.iter().map(|m| ModelReport::from(m.manifest())).collect(),
            engine,
            augmentations: config.augmentations.clone(),
            seed: config.seed,
            statistic: config.uncertainty.statistic,
            ddof: config.uncertainty.ddof,
            coverage: config.uncertainty.coverage,
            threshold: config.uncertainty.threshold,
            defect_threshold: config.defect_threshold,
            region: config.region,
            margin: config.margin,
        };
        let [mut components, mut defects, mut instances] = [None, None, None];
        for model in models {
            let name = model.manifest().name.clone();
            let place = match model.manifest().task {
                Task::Semantic | Task::TwoStream => &mut components,
                Task::Defect => &mut defects,
                Task::Instance => &mut instances,
            };
            if let Some(other) = place.replace(model) {
                let both = format!("models {} and {name} say the same: name one", other.manifest().name);
                return Err(SetupError::Models(both));
            }
        }
        // An instance network may label pixels too.
        if components.is_none() && instances.as_ref().is_some_and(NetworkModel::labels_pixels) {
            components = instances.take();
        }
        let components = components.ok_or_else(|| SetupError::Models("no model labels components".into()))?;
        let of =
            |model: Option<NetworkModel>, classes: &[ClassDef]| model.map(|m| Labeller::new(m, classes)).transpose();
        Ok(Self {
            components: Labeller::new(components, &taxonomy.components)?,
            defects: of(defects, &taxonomy.defects)?,
            instances: of(instances, &taxonomy.components)?,
            volume: volume.filter(|_| config.region == Region::Volume),
            config,
            taxonomy: taxonomy.clone(),
            report,
        })
    }

    /// What labels the inspection, and how.
    pub fn report(&self) -> &NetworkReport {
        &self.report
    }

    /// How many predictions there are of each pixel's component: one alone has no uncertainty.
    pub fn predictions(&self) -> usize {
        self.components.model.manifest().networks.len() * self.config.augmentations.len()
    }

    /// From now on the views are those of another cell, whose measuring volume this is.
    pub fn look_at(&mut self, volume: Option<Volume>) {
        self.volume = volume.filter(|_| self.config.region == Region::Volume);
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
        let draw = |(place, kind): (usize, &super::augment::Augmentation)| {
            let key = (u64::from(view) << 32 | place as u64).to_le_bytes();
            Drawn::new(*kind, xxh3_64_with_seed(&key, self.config.seed))
        };
        self.config.augmentations.iter().enumerate().map(draw).collect()
    }
}

impl Segmenter for NetworkSegmenter {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let picture = (view.intrinsics.width, view.intrinsics.height);
        let expected = picture.0 as usize * picture.1 as usize;
        let sizes = [("colour image", view.rgb.as_raw().len() / 3), ("depth image", view.depth.metres.len())];
        for (field, found) in sizes {
            if found != expected {
                return Err(SegmentError::WrongSize { view: view.index, field, found, expected });
            }
        }
        let failed = |error: EngineError| SegmentError::Network { view: view.index, reason: error.to_string() };
        // Where to look: at the measuring volume, or at what a glance takes for the part.
        let whole = Window::whole(picture.0, picture.1);
        let margin = self.config.margin;
        let (window, glance) = match Window::of_volume(view, self.volume.as_ref(), margin) {
            Sight::In(window) => (Some(window), None),
            Sight::None => (None, None),
            Sight::Unknown if self.config.region == Region::Whole => (Some(whole), None),
            Sight::Unknown => {
                let glance = glance(&mut self.components.model, view, margin).map_err(failed)?;
                (Some(glance.as_ref().map_or(whole, |glance| glance.window)), glance)
            }
        };
        let mut said = self.look(view, window, glance.as_ref())?;
        // A glance may have cut the part short.
        let mut seen = window.filter(|_| glance.is_some());
        while let Some(window) = seen.filter(|window| reaches_rim(&said.components, *window, picture)) {
            let wider = window.widened(window.width.max(window.height) / WIDENING, picture);
            said = self.look(view, Some(wider), glance.as_ref())?;
            seen = Some(wider);
        }
        Ok(said)
    }
}

impl NetworkSegmenter {
    /// Asks all networks about what `window` shows, at the scale that the components' network was trained at. Outside of it
    /// the part is not, or what `glance` saw.
    fn look(
        &mut self,
        view: &View,
        window: Option<Window>,
        glance: Option<&Glance>,
    ) -> Result<Segmentation, SegmentError> {
        let input = &self.components.model.manifest().input;
        let factor = window.map_or(1, |window| scale::factor(view, window, input));
        if factor == 1 {
            return self.ask(view, window, glance.map(|glance| (glance, 1)));
        }
        let coarse = scale::shrunk(view, factor);
        let said =
            self.ask(&coarse, window.map(|window| window.shrunk(factor)), glance.map(|glance| (glance, factor)))?;
        Ok(scale::enlarged(said, factor, (view.intrinsics.width, view.intrinsics.height)))
    }

    /// Asks all networks about what `window` shows; `glance` comes with the factor that `view` is shrunk by.
    fn ask(
        &mut self,
        view: &View,
        window: Option<Window>,
        glance: Option<(&Glance, u32)>,
    ) -> Result<Segmentation, SegmentError> {
        let picture = (view.intrinsics.width, view.intrinsics.height);
        let expected = picture.0 as usize * picture.1 as usize;
        let failed = |error: EngineError| SegmentError::Network { view: view.index, reason: error.to_string() };
        // How the picture is varied: the same for all networks of the view.
        let drawn = self.augmentations(view.index);
        let mut detail = ViewDetail { window, ..ViewDetail::default() };
        let whole = Window::whole(picture.0, picture.1);
        let (component_count, defect_count) = (self.taxonomy.component_count(), self.taxonomy.defect_count());

        // Components: the ensemble's mean is the label, its scatter the uncertainty. A detector gives objects as well.
        let mut canvas = Canvas::new(picture, component_count);
        if let Some((glance, factor)) = glance {
            canvas.sketch(glance, factor, &self.components.numbers);
        }
        let mut instances = None;
        if let Some(window) = window {
            let labeller = &mut self.components;
            let frame = Frame::new(window, picture, &labeller.model.manifest().input);
            let said = ensemble::ask(&mut labeller.model, view, &frame, &drawn).map_err(failed)?;
            let estimate = said.predictions.estimate(&self.config.uncertainty);
            canvas.paint(window, &estimate, &labeller.numbers);
            detail.components = estimate.figures;
            // Whether it is a picture that they know: a network is as sure of what it has never seen.
            detail.domain = self.domain(view, window, &estimate.figures);
            if detail.domain.is_some_and(|domain| domain.outside) {
                // What a glance said of the rest is worth no more.
                canvas.doubt(if glance.is_some() { whole } else { window }, &mut detail.components);
            }
            detail.contribution = said.contribution.map(|share| {
                let bytes: Vec<u8> = share.into_iter().map(byte).collect();
                spread(picture.0, expected, window, &bytes)
            });
            instances = said.instances.map(|i| spread(picture.0, expected, window, &i));
        }
        let components = canvas.field();

        // Defects, by the same rules with a threshold of their own.
        let defects = match (&mut self.defects, window) {
            (Some(labeller), Some(window)) => {
                let frame = Frame::new(window, picture, &labeller.model.manifest().input);
                let said = ensemble::ask(&mut labeller.model, view, &frame, &drawn).map_err(failed)?;
                let settings =
                    UncertaintySettings { threshold: self.config.defect_threshold, ..self.config.uncertainty };
                let estimate = said.predictions.estimate(&settings);
                // Where only a glance was cast, nobody looked for defects.
                let mut canvas = match glance {
                    Some(_) => Canvas::unknown(picture, defect_count),
                    None => Canvas::new(picture, defect_count),
                };
                canvas.paint(window, &estimate, &labeller.numbers);
                let mut figures = estimate.figures;
                if detail.domain.is_some_and(|domain| domain.outside) {
                    canvas.doubt(window, &mut figures);
                }
                detail.defects = Some(figures);
                canvas.field()
            }
            (Some(_), None) => Canvas::new(picture, defect_count).field(),
            (None, _) => Canvas::unknown(picture, defect_count).field(),
        };

        // Objects: of the detector above, of an instance network, or of the one that labels the components too.
        let labels: Vec<u16> = (0..expected).map(|i| components.best(i)).collect();
        let own = Some(&mut self.components).filter(|labeller| labeller.model.separates_objects());
        let instances = match (self.instances.as_mut().or(own), window, instances) {
            (_, _, Some(found)) => found,
            (Some(labeller), Some(window), None) => separate(labeller, view, window, &labels).map_err(failed)?,
            // Nothing separates objects of one class: the class is the object.
            _ => labels,
        };
        Ok(Segmentation { components, defects, instances, network: Some(Arc::new(detail)) })
    }
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
fn reaches_rim(components: &ClassField, window: Window, picture: (u32, u32)) -> bool {
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

/// A share in eight bits, 255 = 1.
fn byte(share: f32) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// A class field in the making: none with certainty, until networks have looked.
struct Canvas {
    columns: usize,
    classes: usize,
    probabilities: Vec<u8>,
    sigma: Vec<u8>,
}

impl Canvas {
    fn new(picture: (u32, u32), classes: usize) -> Self {
        let pixels = picture.0 as usize * picture.1 as usize;
        let mut probabilities = vec![0; pixels * classes];
        probabilities.iter_mut().step_by(classes.max(1)).for_each(|none| *none = u8::MAX);
        Self { columns: picture.0 as usize, classes, probabilities, sigma: vec![0; pixels] }
    }

    /// Where nobody looked: no evidence for anything, not even for soundness.
    fn unknown(picture: (u32, u32), classes: usize) -> Self {
        let pixels = picture.0 as usize * picture.1 as usize;
        let (probabilities, sigma) = (vec![0; pixels * classes], vec![u8::MAX; pixels]);
        Self { columns: picture.0 as usize, classes, probabilities, sigma }
    }

    /// Puts an estimate into its window; class `c` of the estimate is class `numbers[c]` of the field.
    fn paint(&mut self, window: Window, estimate: &Estimate, numbers: &[u16]) {
        let pixels = window.pixels();
        for i in 0..pixels {
            let row = window.top as usize + i / window.width as usize;
            let at = row * self.columns + window.left as usize + i % window.width as usize;
            self.sigma[at] = byte(estimate.sigma[i]);
            let field = &mut self.probabilities[at * self.classes..(at + 1) * self.classes];
            field.fill(0);
            for (c, &number) in numbers.iter().enumerate() {
                field[usize::from(number)] = byte(estimate.mean[c * pixels + i]);
            }
        }
    }

    /// Puts what a glance saw of the picture, which was shrunk by `factor`, everywhere.
    fn sketch(&mut self, glance: &Glance, factor: u32, numbers: &[u16]) {
        let pixels = self.probabilities.chunks_exact_mut(self.classes.max(1)).zip(&mut self.sigma);
        for (i, (field, sigma)) in pixels.enumerate() {
            let (probabilities, deviation) = glance.at((i % self.columns) as u32, (i / self.columns) as u32, factor);
            *sigma = byte(deviation);
            field.fill(0);
            for (&number, p) in numbers.iter().zip(probabilities) {
                field[usize::from(number)] = byte(p);
            }
        }
    }

    /// Makes every label of a window as uncertain as can be: what stands there is no evidence. The probabilities stay, so that
    /// people can see what was said.
    fn doubt(&mut self, window: Window, figures: &mut UncertaintyFigures) {
        let (left, width) = (window.left as usize, window.width as usize);
        for row in window.top as usize..(window.top + window.height) as usize {
            self.sigma[row * self.columns + left..][..width].fill(u8::MAX);
        }
        figures.sigma = 1.0;
        figures.uncertain = figures.foreground;
    }

    fn field(self) -> ClassField {
        ClassField::Soft { classes: self.classes, probabilities: self.probabilities, sigma: self.sigma }
    }
}

#[cfg(test)]
mod tests;
