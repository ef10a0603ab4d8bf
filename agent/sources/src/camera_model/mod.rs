//! Pictures of cameras whose lens bends rays ([`CameraModel`]) brought to those of a pinhole, which views of the product have:
//! [`Rectification`] when they are read, and [`DepthRegistration`] of the depth of a second camera to the colour picture.

mod alignment;
mod depth_encoding;
mod local_plane;
mod rectification;
mod registration;
#[cfg(test)]
mod tests;

pub(crate) use alignment::Aligner;
pub use depth_encoding::{DEPTH_CAMERAS, DepthEncoding};
pub use rectification::Rectification;
pub use registration::DepthRegistration;
pub use semascan_perception::view::{CameraModel, Distortion, UnusableCamera};
