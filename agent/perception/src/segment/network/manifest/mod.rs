//! `model.toml`: what a network needs to know of its input, what its output means, and where it comes from.
//!
//! A model is a folder with this file and the `.onnx` files that it names; several are an ensemble whose probabilities
//! are averaged ([Remanufacturing paper], Fig. 6). Nothing is hard-wired to our own networks: any ONNX file with a
//! manifest that fits it can be used.

mod checksum;
mod external;
mod output;
#[cfg(test)]
mod tests;
mod validate;

use super::domain::Domain;
pub use output::{Activation, Output};
use semascan_formats::regular_file;
pub use semascan_model::record::{Fusion, NetworkFile, Task, WeightsFile};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Name of the file in a model's folder.
pub const FILE_NAME: &str = "model.toml";

/// Largest manifest that is read, bytes: one is a few kilobytes, and what lies about may be anything.
const LARGEST: u64 = 1 << 20;

/// A model's description; unknown keys are errors, so that a typing mistake is noticed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this format; 1.
    pub schema: u32,
    /// Lower-case name, as commands take it: `ud-net-edge`.
    pub name: String,
    /// Version of the weights.
    pub version: String,
    /// What the network says.
    pub task: Task,
    /// Kind of network, for people: `ud-net`, `mask-rcnn` ...
    #[serde(default)]
    pub architecture: String,
    /// Feature extractor, for people: `edge`, `vgg16`, `resnet34` ...
    #[serde(default)]
    pub backbone: String,
    /// How colour and depth meet.
    pub fusion: Fusion,
    /// SPDX expression.
    pub licence: String,
    /// The files; several are an ensemble.
    #[serde(rename = "network")]
    pub networks: Vec<NetworkFile>,
    /// What goes in.
    pub input: Input,
    /// What comes out.
    pub output: Output,
    /// Classes in the order of the output; the first is `none`.
    pub classes: Vec<Class>,
    /// Which views its labels can be believed for (`semascan models calibrate`); absent where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub domain: Option<Domain>,
    /// How it was trained, for people and reports.
    #[serde(default)]
    pub training: toml::Table,
    /// What it was measured to be, for people and reports.
    #[serde(default)]
    pub metrics: toml::Table,
}

/// One channel of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// sRGB red.
    Red,
    /// sRGB green.
    Green,
    /// sRGB blue.
    Blue,
    /// Distance along the optical axis.
    Depth,
}

/// The input tensor, `[N, C, H, W]` of f32.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Its name in the graph.
    pub tensor: String,
    /// What its channels are.
    pub channels: Vec<Channel>,
    /// Height and width are padded to multiples of this (edges replicated, the result cropped).
    #[serde(default = "one")]
    pub multiple: u32,
    /// Width of a network with a fixed size; pictures are then resized.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<u32>,
    /// Height of a network with a fixed size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<u32>,
    /// Finest and coarsest footprint of a pixel on the parts of the training, metres: pictures of finer pixels are shrunk.
    /// Where it is not stated, pictures are taken as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub footprint: Option<[f64; 2]>,
    /// Scaling of the colour channels, where there are any.
    #[serde(default, rename = "colour", skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorScale>,
    /// Scaling of the depth channel, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthScale>,
}

fn one() -> u32 {
    1
}

/// `value = (byte / 255 - mean) / std`, red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColorScale {
    /// Subtracted.
    pub mean: [f32; 3],
    /// Divided by.
    pub std: [f32; 3],
}

/// `value = (z - near) / (far - near)`, clamped to 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthScale {
    /// Metres that become 0.
    pub near: f32,
    /// Metres that become 1.
    pub far: f32,
    /// The value where nothing was measured.
    pub missing: f32,
}

/// One class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// Its name, as taxonomies have it.
    pub name: String,
    /// `#rrggbb`.
    #[serde(rename = "colour")]
    pub color: String,
}

impl Class {
    /// The colour; `None` if it is none.
    pub fn rgb(&self) -> Option<[u8; 3]> {
        let digits = self.color.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
        let value = u32::from_str_radix(digits, 16).ok()?;
        Some([(value >> 16) as u8, (value >> 8) as u8, value as u8])
    }
}

/// A manifest, or what it names, is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {field}: {reason}", path.display())]
pub struct ManifestError {
    /// The file at fault.
    pub path: PathBuf,
    /// The field at fault, as a path: `input.depth.near`.
    pub field: String,
    /// What is wrong.
    pub reason: String,
}

impl ManifestError {
    /// An error about `field` in the manifest of `folder`.
    pub(super) fn new(folder: &Path, field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { path: folder.join(FILE_NAME), field: field.into(), reason: reason.into() }
    }
}

impl Manifest {
    /// Reads and checks the manifest of the model in `folder`. The networks themselves are not looked at.
    ///
    /// # Errors
    /// [`ManifestError`] naming file and field.
    pub fn read(folder: &Path) -> Result<Self, ManifestError> {
        let path = folder.join(FILE_NAME);
        let fail = |reason: String| ManifestError::new(folder, "file", reason);
        let bytes = regular_file::read_at_most(&path, LARGEST).map_err(|e| fail(e.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| fail("is no UTF-8 text".into()))?;
        Self::parse(&text).map_err(|(field, reason)| ManifestError::new(folder, field, reason))
    }

    /// Reads and checks a manifest; what is wrong comes as (field, reason).
    ///
    /// # Errors
    /// The field at fault and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, (String, String)> {
        let manifest: Self = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(0, |s| text.get(..s.start).map_or(0, |head| head.matches('\n').count()));
            (format!("line {}", line + 1), e.message().replace('\n', " "))
        })?;
        manifest.validate()?;
        Ok(manifest)
    }

    /// Whether the network looks at depth.
    pub fn uses_depth(&self) -> bool {
        self.input.channels.contains(&Channel::Depth)
    }
}
