//! What the record says of how well the poses agree with the pictures: a figure that needs no truth.

use serde::{Deserialize, Serialize};

/// Poses against pictures: where corners of one view lie in others by depth and poses, and where they are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PhotometricRecord {
    /// How the figures are to be read.
    pub convention: String,
    /// Of the estimated poses, pixels; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Of the kinematic poses, on the same matches, pixels; absent where it is not known or a view has no kinematic pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_error: Option<f64>,
    /// Why the error is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unknown: Option<String>,
    /// Views that were compared: all, or evenly chosen ones of many.
    pub views: u64,
    /// Pairs of views that see common ground.
    pub compared: u64,
    /// Of these: pairs with enough matches, which count.
    pub pairs: u64,
    /// Corners that were searched for.
    pub searched: u64,
    /// Of these: corners that stand still with the camera, which do not count.
    pub still: u64,
    /// Matches of the pairs that count.
    pub matches: u64,
}
