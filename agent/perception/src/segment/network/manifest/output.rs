//! The `[output]` of a manifest: which tensors of the graph say what.

use serde::{Deserialize, Serialize};

/// What is still to be done to the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// They are probabilities already.
    #[default]
    None,
    /// Over the classes of a pixel.
    Softmax,
    /// For each class on its own; the classes of a pixel are then scaled to a sum of 1.
    Sigmoid,
}

/// The output tensors' names in the graph.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Class probabilities, `[N, K, H, W]`; instance networks may have them too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tensor: Option<String>,
    /// What is still to be applied to `tensor` or `centres`.
    #[serde(default)]
    pub activation: Activation,
    /// Two-stream: the share of the colour stream, `[N, 1, H, W]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contribution: Option<String>,
    /// Instances by centres: how likely an object of a class is centred here, `[N, K, H/4, W/4]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centres: Option<String>,
    /// Instances by centres: from the middle of a cell of 4 x 4 pixels to its object's centre, x then y, in pixels of the
    /// input, `[N, 2, H/4, W/4]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offsets: Option<String>,
    /// Instances by detection (Mask R-CNN): `[D, 4]`, x0 y0 x1 y1 in pixels of the input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub boxes: Option<String>,
    /// Instances by detection: class of each, `[D]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels: Option<String>,
    /// Instances by detection: score of each, `[D]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scores: Option<String>,
    /// Instances by detection: mask of each, `[D, 1, H, W]`, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub masks: Option<String>,
}

impl Output {
    /// The outputs that are used, as (field, name in the graph): those of pixels first.
    pub fn names(&self) -> Vec<(&'static str, &str)> {
        let pixels = [("output.tensor", &self.tensor), ("output.contribution", &self.contribution)];
        let named = pixels.into_iter().filter_map(|(field, name)| Some((field, name.as_deref()?)));
        named.chain(self.object_names()).collect()
    }

    /// The outputs that objects come from: centres and offsets, or boxes, labels, scores and masks.
    pub fn object_names(&self) -> Vec<(&'static str, &str)> {
        let all = [
            ("output.centres", &self.centres),
            ("output.offsets", &self.offsets),
            ("output.boxes", &self.boxes),
            ("output.labels", &self.labels),
            ("output.scores", &self.scores),
            ("output.masks", &self.masks),
        ];
        all.into_iter().filter_map(|(field, name)| Some((field, name.as_deref()?))).collect()
    }
}
