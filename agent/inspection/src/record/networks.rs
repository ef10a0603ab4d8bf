//! What the record says of the networks that labelled the views.

use schemars::JsonSchema;
use semascan_perception::fuse::Uncertain;
use semascan_perception::segment::network::{NetworkReport, UncertaintyFigures};
use serde::{Deserialize, Serialize};

/// The networks of an inspection, and how their uncertainty was computed and used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NetworksRecord {
    /// Models, engine, augmentations, statistic, thresholds.
    #[serde(flatten)]
    pub network: NetworkReport,
    /// What became of pixels beyond the threshold.
    pub uncertain: Uncertain,
}

/// What the networks said of one view, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewNetworksRecord {
    /// Where they looked; absent if the part was out of sight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<WindowRecord>,
    /// Components.
    pub components: UncertaintyFigures,
    /// Defects, where a network looked for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defects: Option<UncertaintyFigures>,
}

/// A window of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
