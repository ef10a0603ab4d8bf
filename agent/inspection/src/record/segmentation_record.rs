//! What `inspection.json` says of the networks that labelled the views.

use semascan_perception::fuse::Uncertain;
use semascan_perception::segment::network::{NetworkReport, UncertaintyFigures, ViewDetail};
use serde::{Deserialize, Serialize};

/// The networks of an inspection, and how their uncertainty was computed and used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SegmentationRecord {
    /// Models, engine, augmentations, statistic, thresholds.
    #[serde(flatten)]
    pub network: NetworkReport,
    /// What became of pixels beyond the threshold.
    pub uncertain: Uncertain,
}

/// What the networks said of one view, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewSegmentationRecord {
    /// Where they looked: first column, first row, columns, rows; absent if the part was out of sight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<[u32; 4]>,
    /// Components.
    pub components: UncertaintyFigures,
    /// Defects, where a network looked for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defects: Option<UncertaintyFigures>,
}

impl From<&ViewDetail> for ViewSegmentationRecord {
    fn from(detail: &ViewDetail) -> Self {
        Self {
            window: detail.window.map(|w| [w.left, w.top, w.width, w.height]),
            components: detail.components,
            defects: detail.defects,
        }
    }
}
