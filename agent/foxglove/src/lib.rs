//! An inspection for other people's tools: in the schemas of Foxglove (<https://foxglove.dev>), which Rerun, Lichtblick and readers
//! of MCAP know too, and over Foxglove's WebSocket protocol.
//!
//! | file | what |
//! |---|---|
//! | `topic.rs` | what is published: topics and their schemas |
//! | `protocol.rs`, `client.rs` | the protocol's texts and frames, from both sides |
//! | `scene.rs` | what the live stream has said of the inspection by now |
//! | `packed_points.rs`, `drawing.rs` | points, cameras and findings as messages |

pub mod client;
mod drawing;
mod packed_points;
pub mod protocol;
mod scene;
mod topic;

pub use drawing::{findings, mesh};
pub use scene::Scene;
pub use semascan_foxglove_schema as schema;
pub use topic::{TOPICS, Topic};

/// The frame that everything is published in: that of the turntable, z up.
pub const TABLE: &str = "table";
