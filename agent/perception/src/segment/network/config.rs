//! What is asked of networks, and what an inspection's record says of it.

use super::augment::Augmentation;
use super::manifest::Manifest;
use super::region::Window;
use super::uncertainty::{UncertaintyFigures, UncertaintySettings};
use crate::segment::sigma_limits::DEFECT_SIGMA_LIMIT;
pub use semascan_model::record::{ModelReport, NetworkReport, Region};

use semascan_model::record::DomainRecord;

/// How networks are asked.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkConfig {
    /// How the uncertainty of components is computed, and when it is too large.
    pub uncertainty: UncertaintySettings,
    /// The threshold of defects; the rest is as for components.
    pub defect_threshold: f32,
    /// The augmentations, [`Augmentation::Identity`] first.
    pub augmentations: Vec<Augmentation>,
    /// Of the augmentations.
    pub seed: u64,
    /// Where networks look.
    pub region: Region,
    /// Pixels around the measuring volume.
    pub margin: u32,
    /// Whether views are compared with those that the models' labels can be believed for; pictures that were prepared
    /// (freed of noise or background) cannot be.
    pub judge_domain: bool,
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self {
            uncertainty: UncertaintySettings::default(),
            defect_threshold: DEFECT_SIGMA_LIMIT,
            augmentations: vec![Augmentation::Identity, Augmentation::Flip],
            seed: 1,
            region: Region::Volume,
            margin: 16,
            judge_domain: true,
        }
    }
}

impl NetworkConfig {
    /// Checks the settings; what is wrong comes as (field, reason).
    ///
    /// # Errors
    /// The field at fault and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        for (field, value) in [("threshold", self.uncertainty.threshold), ("defect_threshold", self.defect_threshold)] {
            if !(value.is_finite() && value > 0.0 && value <= 1.0) {
                return Err((field, format!("{value} is not above 0 and at most 1")));
            }
        }
        if !(self.uncertainty.coverage.is_finite() && self.uncertainty.coverage > 0.0) {
            return Err(("coverage", format!("{} is no factor", self.uncertainty.coverage)));
        }
        if self.uncertainty.ddof > 1 {
            return Err(("ddof", format!("{} is neither 0 nor 1", self.uncertainty.ddof)));
        }
        if self.augmentations.first() != Some(&Augmentation::Identity) {
            return Err(("augmentations", "the first is identity: every pixel must be known once".into()));
        }
        if self.augmentations.len() > 64 {
            return Err(("augmentations", format!("{} are more than 64", self.augmentations.len())));
        }
        Ok(())
    }
}

impl From<&Manifest> for ModelReport {
    fn from(m: &Manifest) -> Self {
        Self {
            name: m.name.clone(),
            version: m.version.clone(),
            task: m.task,
            architecture: m.architecture.clone(),
            backbone: m.backbone.clone(),
            fusion: m.fusion,
            networks: m.networks.clone(),
            calibrated: m.domain.is_some(),
        }
    }
}

/// What networks said of one view, beyond its labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewDetail {
    /// Where they looked; `None` if the part was out of sight.
    pub window: Option<Window>,
    /// Whether the view is of the world that the networks were trained for; `None` where that cannot be told.
    pub domain: Option<DomainRecord>,
    /// Components in numbers.
    pub components: UncertaintyFigures,
    /// Defects in numbers, where a network looked for them.
    pub defects: Option<UncertaintyFigures>,
    /// Two-stream: the share of the colour stream, 255 = all, one byte a pixel of the picture; 0 outside the window.
    pub contribution: Option<Vec<u8>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_name_their_field() {
        NetworkConfig::default().check().expect("the defaults are in range");
        let field = |change: fn(&mut NetworkConfig)| {
            let mut config = NetworkConfig::default();
            change(&mut config);
            config.check().expect_err("out of range").0
        };
        assert_eq!(field(|c| c.uncertainty.threshold = f32::NAN), "threshold");
        assert_eq!(field(|c| c.defect_threshold = 0.0), "defect_threshold");
        assert_eq!(field(|c| c.uncertainty.coverage = -1.0), "coverage");
        assert_eq!(field(|c| c.uncertainty.ddof = 2), "ddof");
        assert_eq!(field(|c| c.augmentations.clear()), "augmentations");
        assert_eq!(field(|c| c.augmentations = vec![Augmentation::Flip]), "augmentations");
        assert_eq!(field(|c| c.augmentations = vec![Augmentation::Identity; 65]), "augmentations");
    }
}
