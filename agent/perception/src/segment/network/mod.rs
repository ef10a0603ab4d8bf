//! Trained networks: from a view to class probabilities and how sure they are ([Remanufacturing paper], section
//! "Uncertainty estimation for segmentation results", and [Wang 2023] for two streams).
//!
//! A [`NetworkModel`] is a [`Manifest`] and the networks it names, run by an [`engine`]. [`NetworkSegmenter`] asks an ensemble of
//! them about several augmentations of a view's region of interest; the mean is the label, the scatter its uncertainty.

mod augment;
pub(super) mod config;
mod domain;
pub mod engine;
mod ensemble;
#[cfg(test)]
pub(crate) mod fixtures;
mod glance;
mod library;
mod manifest;
mod model;
mod objects;
mod picture_statistics;
mod places;
mod preprocess;
mod region;
mod scale;
mod segmenter;
mod taxonomy;
mod uncertainty;
mod upsample;

pub use augment::Augmentation;
pub use config::{ModelReport, NetworkConfig, NetworkReport, Region, ViewDetail};
pub use domain::{CalibrationError, Domain, FALSE_ALARMS, disagreement, numbers_of};
pub use engine::{EngineChoice, EngineDescription, EngineError, Provider};
pub use library::{Installed, SelectError, find, installed, search_path, select};
pub use manifest::{
    Activation, Channel, Class, ColorScale, DepthScale, FILE_NAME, Fusion, Input, Manifest, ManifestError, NetworkFile,
    Output, Task, WeightsFile,
};
pub use model::{Answer, ModelError, NetworkModel};
pub use objects::{Objects, ShapeError};
pub use picture_statistics::STATISTICS;
pub use region::{Sight, Volume, Window};
pub use segmenter::{NetworkSegmenter, SetupError};
pub use taxonomy::{class_number, extended};
pub use uncertainty::{Estimate, Predictions, Statistic, UncertaintyFigures, UncertaintySettings};
