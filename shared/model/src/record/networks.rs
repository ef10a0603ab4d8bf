//! What the record says of the networks that labelled the views.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The networks of an inspection, and how their uncertainty was computed and used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NetworksRecord {
    /// Models, engine, augmentations, statistic, thresholds.
    #[serde(flatten)]
    pub network: NetworkReport,
    /// What became of pixels beyond the threshold.
    pub uncertain: Uncertain,
}

/// What the networks said of one view, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ViewNetworksRecord {
    /// Where they looked; absent if the part was out of sight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<WindowRecord>,
    /// Whether it is of the world that the networks were trained for; absent where that cannot be told, as
    /// when no network is calibrated: that is no sign that it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub domain: Option<DomainRecord>,
    /// Components.
    pub components: UncertaintyFigures,
    /// Defects, where a network looked for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defects: Option<UncertaintyFigures>,
}

/// How unlike a view is to those that the networks' labels can be believed for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DomainRecord {
    /// Mahalanobis distance of the picture's statistics, divided by the square root of their number: about 1 inside.
    pub score: f64,
    /// Largest score of a view that is believed.
    pub threshold: f64,
    /// How far the ensemble disagrees: mean standard uncertainty of what it takes for components; absent where little is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disagreement: Option<f64>,
    /// Largest disagreement of a view that is believed; absent where it was not calibrated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disagreement_threshold: Option<f64>,
    /// Whether the view is out of domain: then its labels have the uncertainty 1 and do not count.
    pub outside: bool,
}

/// A window of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WindowRecord {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// What a network says of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Component classes.
    Semantic,
    /// Defect classes.
    Defect,
    /// Single objects.
    Instance,
    /// Component classes from a colour and a depth stream, and how much each contributes [Wang 2023].
    TwoStream,
}

impl Task {
    /// As it stands in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Semantic => "semantic",
            Self::Defect => "defect",
            Self::Instance => "instance",
            Self::TwoStream => "two-stream",
        }
    }
}

/// Where colour and depth meet: the fusion variants of [Remanufacturing paper], the contribution layer of [Wang 2023].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Fusion {
    /// One of them only.
    None,
    /// In the input.
    Early,
    /// Features are added.
    IntermediateAdd,
    /// Features are joined by a convolution.
    IntermediateConv,
    /// Outputs are added.
    LateAdd,
    /// Outputs are joined by a network.
    LateNetwork,
    /// Outputs are weighed pixel by pixel.
    Contribution,
}

/// One `.onnx` file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct NetworkFile {
    /// Its name, in the model's folder.
    pub file: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// The files that it keeps weights in, if there are such.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<WeightsFile>,
}

/// A file of weights beside an `.onnx` file (ONNX calls it external data).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WeightsFile {
    /// Its name as the network has it, in the model's folder.
    pub file: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// Where networks look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Region {
    /// At the measuring volume and a margin around it; all else is taken to be none, with certainty. Where the volume is not
    /// known, at what a first glance of one network takes for the part; all else is none as far as that glance says so, and
    /// else unknown.
    #[default]
    Volume,
    /// At the whole picture.
    Whole,
}

/// One model in a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ModelReport {
    /// Its name.
    pub name: String,
    /// Version of its weights.
    pub version: String,
    /// What it says.
    pub task: Task,
    /// Kind of network.
    pub architecture: String,
    /// Feature extractor.
    pub backbone: String,
    /// How colour and depth meet.
    pub fusion: Fusion,
    /// Files and their checksums.
    pub networks: Vec<NetworkFile>,
    /// Whether it is known which views its labels can be believed for (`semascan models calibrate`).
    #[serde(default)]
    pub calibrated: bool,
}

/// What labelled an inspection, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NetworkReport {
    /// The models.
    pub models: Vec<ModelReport>,
    /// What ran them.
    pub engine: EngineDescription,
    /// The augmentations.
    pub augmentations: Vec<Augmentation>,
    /// Their seed.
    pub seed: u64,
    /// What sigma is.
    pub statistic: Statistic,
    /// Subtracted from the number of predictions.
    pub ddof: u32,
    /// Coverage factor k of the expanded uncertainty.
    pub coverage: f32,
    /// Component pixels with a larger sigma are uncertain.
    pub threshold: f32,
    /// Defect pixels with a larger sigma are uncertain.
    pub defect_threshold: f32,
    /// Where the networks looked.
    pub region: Region,
    /// Pixels around the measuring volume.
    pub margin: u32,
}

/// What an engine is, for people and records.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EngineDescription {
    /// `onnxruntime` or `tract`.
    pub name: String,
    /// Its version.
    pub version: String,
    /// What computes: `cpu`, `cuda` ...
    pub provider: Provider,
    /// The library it was loaded from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub library: Option<PathBuf>,
}

/// What computes (ONNX Runtime's execution providers).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Provider {
    /// The processor.
    #[default]
    Cpu,
    /// Nvidia's GPUs.
    Cuda,
    /// Nvidia's GPUs, with networks compiled for them.
    TensorRt,
    /// Intel's processors, GPUs and NPUs.
    OpenVino,
    /// Apple's GPUs and neural engines.
    CoreMl,
}

impl Provider {
    /// All there are.
    pub const ALL: [Self; 5] = [Self::Cpu, Self::Cuda, Self::TensorRt, Self::OpenVino, Self::CoreMl];

    /// As it stands in configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Cuda => "cuda",
            Self::TensorRt => "tensorrt",
            Self::OpenVino => "openvino",
            Self::CoreMl => "coreml",
        }
    }
}

/// A kind of change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Augmentation {
    /// None.
    Identity,
    /// Left and right exchanged.
    Flip,
    /// A small turn and change of size about the middle, drawn anew for each view.
    Warp,
    /// Contrast, brightness and noise of the colours, drawn anew for each view.
    Light,
}

/// What sigma of a pixel is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Statistic {
    /// `sqrt(sum_c u_c^2)`.
    #[default]
    Norm,
    /// u of the predicted class.
    Predicted,
    /// The largest u_c.
    Largest,
}

/// A picture's uncertainty in numbers. Means are over the pixels whose predicted class is not none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct UncertaintyFigures {
    /// Pixels the networks looked at.
    pub pixels: u64,
    /// Those whose predicted class is not none.
    pub foreground: u64,
    /// Pixels of the foreground that are uncertain.
    pub uncertain: u64,
    /// Mean sigma.
    pub sigma: f64,
    /// Mean data part.
    pub data: f64,
    /// Mean model part.
    pub model: f64,
    /// Mean expanded uncertainty U = k u of the predicted class.
    pub expanded: f64,
    /// Mean 2.5 % quantile of the predicted class's probability.
    pub quantile_low: f64,
    /// Mean 97.5 % quantile.
    pub quantile_high: f64,
}

/// What becomes of pixels whose component class is too uncertain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Uncertain {
    /// They add geometry, but no evidence for any class.
    #[default]
    Geometry,
    /// They are dropped, as in [Remanufacturing paper]: they move no voxel, and one that nothing else has seen is marked
    /// [`UNCERTAIN`](crate::PointFlags::UNCERTAIN), so that completeness can still be measured.
    Drop,
}
