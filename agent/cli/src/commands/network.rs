//! Which networks label an inspection, and how: arguments, and the section `[network]` of `cell.toml` below them.

use super::Failure;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use semascan_inspection::source::SourceInfo;
use semascan_model::Taxonomy;
use semascan_perception::fuse::{Uncertain, UncertaintyRule};
use semascan_perception::segment::network::{
    Augmentation, EngineChoice, Manifest, NetworkConfig, NetworkModel, NetworkSegmenter, Provider, Region, Statistic,
    engine, extended, select,
};
use serde::Deserialize;
use std::path::PathBuf;
use std::sync::OnceLock;

/// What becomes of uncertain pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UncertainArg {
    /// They add geometry, but no evidence for a class
    Geometry,
    /// They are dropped, as P0 does
    Drop,
}

/// Networks, as the command line names them.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct NetworkArgs {
    /// Models for `--labels network`: names, folders of models, or folders with models, separated by commas; by default
    /// the best of each task that is installed
    #[arg(long, value_name = "NAME|DIR", value_delimiter = ',')]
    models: Vec<String>,
    /// Largest standard uncertainty of a component label, 0 to 1 [default: 0.16]
    #[arg(long, value_name = "T")]
    sigma: Option<f32>,
    /// What becomes of pixels beyond it [default: geometry]
    #[arg(long, value_enum)]
    uncertain: Option<UncertainArg>,
    /// What `cell.toml` says.
    #[arg(skip)]
    pub(crate) section: NetworkSection,
    /// What was chosen by all this.
    #[arg(skip)]
    chosen: OnceLock<Vec<(PathBuf, Manifest)>>,
}

/// `[network]` of `cell.toml`.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct NetworkSection {
    /// As `--models`.
    models: Vec<String>,
    /// `auto`, `onnxruntime` or `tract`.
    engine: EngineChoice,
    /// ONNX Runtime's library, where it is not found by itself.
    onnxruntime: Option<PathBuf>,
    /// `cpu`, `cuda`, `tensorrt`, `openvino` or `coreml`.
    provider: Provider,
    /// Threads of the networks; all by default.
    threads: Option<usize>,
    /// `identity` first, then any of `flip`, `warp`, `light`.
    augmentations: Option<Vec<Augmentation>>,
    /// Of the augmentations.
    seed: Option<u64>,
    /// `norm`, `predicted` or `largest`.
    statistic: Statistic,
    /// 0 or 1.
    ddof: Option<u32>,
    /// Coverage factor k of the expanded uncertainty.
    coverage: Option<f32>,
    /// As `--sigma`.
    threshold: Option<f32>,
    /// The same for defects; 0.5 by default.
    defect_threshold: Option<f32>,
    /// As `--uncertain`.
    uncertain: Uncertain,
    /// `volume`: networks look at the measuring volume, and what is outside it is none; `whole`: at everything.
    region: Region,
    /// Pixels around the measuring volume.
    margin: Option<u32>,
}

impl NetworkSection {
    /// Where ONNX Runtime lies, if that is said, and what is to compute.
    pub(crate) fn runtime(&self) -> (Option<PathBuf>, Provider) {
        (self.onnxruntime.clone(), self.provider)
    }
}

impl NetworkArgs {
    /// The models for a source with the classes `known`; chosen once for an inspection.
    fn models(&self, known: &Taxonomy) -> Result<&[(PathBuf, Manifest)], Failure> {
        if self.chosen.get().is_none() {
            let asked = if self.models.is_empty() { &self.section.models } else { &self.models };
            // Whoever was first has chosen the same.
            let _ = self.chosen.set(select(asked, known)?);
        }
        Ok(self.chosen.get().map_or(&[], Vec::as_slice))
    }

    /// The classes of an inspection of a source with these classes. Where its truth is known its numbers stay; otherwise
    /// the networks' classes are all there are.
    pub(crate) fn taxonomy(&self, known: &Taxonomy, has_truth: bool) -> Result<Taxonomy, Failure> {
        let models = self.models(known)?;
        let manifests: Vec<&Manifest> = models.iter().map(|(_, manifest)| manifest).collect();
        let none = Taxonomy::from_names::<&str>(&[], &[]);
        Ok(extended(if has_truth { known } else { &none }, &manifests))
    }

    /// When a label is too uncertain, and what becomes of its pixel.
    pub(crate) fn rule(&self) -> UncertaintyRule {
        let default = UncertaintyRule::default();
        let threshold = self.sigma.or(self.section.threshold).unwrap_or(default.threshold);
        UncertaintyRule {
            threshold,
            defect_threshold: self.section.defect_threshold.unwrap_or(default.defect_threshold),
            uncertain: match self.uncertain {
                Some(UncertainArg::Geometry) => Uncertain::Geometry,
                Some(UncertainArg::Drop) => Uncertain::Drop,
                None => self.section.uncertain,
            },
        }
    }

    fn config(&self) -> NetworkConfig {
        let (section, rule) = (&self.section, self.rule());
        let mut config = NetworkConfig { defect_threshold: rule.defect_threshold, ..NetworkConfig::default() };
        config.uncertainty.threshold = rule.threshold;
        config.uncertainty.statistic = section.statistic;
        config.uncertainty.ddof = section.ddof.unwrap_or(config.uncertainty.ddof);
        config.uncertainty.coverage = section.coverage.unwrap_or(config.uncertainty.coverage);
        config.augmentations = section.augmentations.clone().unwrap_or(config.augmentations);
        config.seed = section.seed.unwrap_or(config.seed);
        config.region = section.region;
        config.margin = section.margin.unwrap_or(config.margin);
        config
    }

    /// Loads the networks for an inspection of a source like `info`: everything that is wrong with them shows here.
    pub(crate) fn segmenter(&self, info: &SourceInfo) -> Result<NetworkSegmenter, Failure> {
        let config = self.config();
        config.check().map_err(|(field, reason)| Failure::Call(anyhow!("network.{field}: {reason}")))?;
        let section = &self.section;
        let engine = engine::open(section.engine, section.onnxruntime.as_deref(), section.provider)?;
        let threads = section.threads.unwrap_or_else(rayon::current_num_threads);
        let models = self.models(&info.taxonomy)?;
        let load = |(folder, _): &(PathBuf, Manifest)| NetworkModel::load(folder, engine.as_ref(), threads);
        let models: Vec<NetworkModel> = models.iter().map(load).collect::<Result<_, _>>()?;
        let description = engine.description();
        let names: Vec<&str> = models.iter().map(|m| m.manifest().name.as_str()).collect();
        tracing::info!("labels by {} in {} {}", names.join(", "), description.name, description.version);
        let segmenter = NetworkSegmenter::new(models, description, &info.taxonomy, info.volume, config);
        let segmenter = segmenter.context("the networks cannot be used")?;
        if segmenter.predictions() == 1 {
            tracing::warn!("one network asked once: its uncertainty cannot be known and counts as none");
        }
        Ok(segmenter)
    }
}
