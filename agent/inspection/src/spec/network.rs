//! Which networks label an inspection, and how.

use semascan_perception::fuse::{Uncertain, UncertaintyRule};
use semascan_perception::segment::network::{Augmentation, EngineChoice, NetworkConfig, Provider, Region, Statistic};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Which networks label an inspection, and how; what is absent has the networks' own default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NetworkSpec {
    /// Names of models, folders of models, or folders with models; by default the best of each task that is installed.
    pub models: Vec<String>,
    /// `auto`, `onnxruntime` or `tract`.
    pub engine: EngineChoice,
    /// ONNX Runtime's library, where it is not found by itself.
    pub onnxruntime: Option<PathBuf>,
    /// `cpu`, `cuda`, `tensorrt`, `openvino` or `coreml`.
    pub provider: Provider,
    /// Threads of the networks; all by default.
    pub threads: Option<usize>,
    /// `identity` first, then any of `flip`, `warp`, `light`.
    pub augmentations: Option<Vec<Augmentation>>,
    /// Seed of the augmentations.
    pub seed: Option<u64>,
    /// `norm`, `predicted` or `largest`: how the spread over the classes becomes one number.
    pub statistic: Statistic,
    /// Subtracted from the number of predictions: 0 or 1.
    pub ddof: Option<u32>,
    /// Coverage factor k of the expanded uncertainty.
    pub coverage: Option<f32>,
    /// Largest standard uncertainty of a component label, 0 to 1.
    pub threshold: Option<f32>,
    /// The same for defects.
    pub defect_threshold: Option<f32>,
    /// What becomes of pixels beyond the threshold: `geometry` (they add no evidence for a class) or `drop`.
    pub uncertain: Uncertain,
    /// `volume`: networks look at the measuring volume, and what is outside it is none; `whole`: at everything.
    pub region: Region,
    /// Pixels around the measuring volume.
    pub margin: Option<u32>,
}

impl NetworkSpec {
    /// When a label is too uncertain, and what becomes of its pixel.
    pub fn uncertainty_rule(&self) -> UncertaintyRule {
        let default = UncertaintyRule::default();
        UncertaintyRule {
            threshold: self.threshold.unwrap_or(default.threshold),
            defect_threshold: self.defect_threshold.unwrap_or(default.defect_threshold),
            uncertain: self.uncertain,
        }
    }

    /// How the networks are asked.
    pub fn network_config(&self) -> NetworkConfig {
        let rule = self.uncertainty_rule();
        let mut config = NetworkConfig { defect_threshold: rule.defect_threshold, ..NetworkConfig::default() };
        config.uncertainty.threshold = rule.threshold;
        config.uncertainty.statistic = self.statistic;
        config.uncertainty.ddof = self.ddof.unwrap_or(config.uncertainty.ddof);
        config.uncertainty.coverage = self.coverage.unwrap_or(config.uncertainty.coverage);
        config.augmentations = self.augmentations.clone().unwrap_or(config.augmentations);
        config.seed = self.seed.unwrap_or(config.seed);
        config.region = self.region;
        config.margin = self.margin.unwrap_or(config.margin);
        config
    }
}
