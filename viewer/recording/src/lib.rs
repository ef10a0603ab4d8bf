//! What an MCAP recording (<https://mcap.dev>) holds that can be looked at without an agent: a file that the viewer opens.
//!
//! | file | what |
//! |---|---|
//! | `messages` | the messages of a file, to the last whole one |
//! | `frames` | where the frames of the transforms are |
//! | `views` | colour and depth pictures as points where the camera stood |
//! | `grid` | the mean of the points in each voxel |
//! | `clouds` | the last point cloud of each topic |
//! | `content` | which of these is shown |
//!
//! Messages of Foxglove's schemas in protobuf are read: those of our captures, of our endpoint for Foxglove, and of any program that
//! writes them. The page loads this module when a recording is opened, and not before: few people open one.

mod clouds;
mod content;
mod frames;
mod grid;
mod messages;
#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests;
mod views;
#[cfg(target_arch = "wasm32")]
mod worker;

pub use content::{Opened, read};

/// Why nothing of a recording can be shown.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// It is no MCAP file, or broken from its start.
    #[error("it is no MCAP file that can be read: {0}")]
    Broken(mcap::McapError),
    /// Nothing that is read is in it.
    #[error(
        "it holds neither views (raw colour and depth pictures), point clouds nor a mesh in Foxglove's schemas in protobuf; it \
         holds {0}. `semascan inspect` reads more"
    )]
    Nothing(String),
    /// There are depth pictures, and nothing says where their cameras were.
    #[error(
        "{0} depth pictures, and no transforms say where the camera stood: `semascan inspect --track` finds it from the pictures"
    )]
    NoPoses(u32),
    /// Its depth pictures cannot be made points of.
    #[error("its {0} depth pictures have no calibration or too few bytes")]
    Unusable(u32),
    /// What was found cannot be handed over.
    #[error(transparent)]
    Write(#[from] semascan_formats::WriteError),
}
