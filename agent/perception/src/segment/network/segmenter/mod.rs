//! Networks as a [`Segmenter`]: components, defects where a network knows them, and objects where one separates them.

mod canvas;
mod look;

use super::config::{ModelReport, NetworkConfig, NetworkReport, Region};
use super::engine::{EngineDescription, EngineError};
use super::glance::glance;
use super::manifest::Task;
use super::model::NetworkModel;
use super::region::{Sight, Volume, Window};
use super::taxonomy::numbers;
use crate::segment::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;
use semascan_model::{ClassDef, Taxonomy};

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
        let mut look = self.look(view, window, glance.as_ref(), None).map_err(failed)?;
        // A glance may have cut the part short.
        let mut seen = window.filter(|_| glance.is_some());
        while let Some(window) = seen.filter(|_| look.cuts_the_part(view)) {
            let wider = window.widened(window.width.max(window.height) / WIDENING, picture);
            look = self.look(view, Some(wider), glance.as_ref(), Some(look)).map_err(failed)?;
            seen = Some(wider);
        }
        self.complete(view, look, glance.as_ref()).map_err(failed)
    }
}

#[cfg(test)]
mod tests;
