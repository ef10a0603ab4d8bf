//! The stages of the way of one view, and how an inspection ends.

use serde::{Deserialize, Serialize};

/// The stages of the way of one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Capture or read.
    Acquire,
    /// Class probabilities.
    Segment,
    /// Camera pose.
    Register,
    /// Integration into the map.
    Fuse,
    /// All poses together, after the last view.
    Refine,
}

impl Stage {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Acquire => "acquire",
            Self::Segment => "segment",
            Self::Register => "register",
            Self::Fuse => "fuse",
            Self::Refine => "refine",
        }
    }
}

/// How an inspection ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Outcome {
    /// It runs; where nothing runs any more, it was killed, and there is no result.
    Running,
    /// Every view was taken its way.
    Finished,
    /// Somebody stopped it; the model is that of the views until then.
    Stopped,
    /// There is no model, or one that lacks views of which none was to be left out.
    Failed {
        /// Why.
        reason: String,
    },
}
