//! Where views come from: one folder a source. Each implements [`Source`](semascan_inspection::source::Source).

pub mod bop;
pub mod camera_mask;
pub mod depth_map;
mod open;
pub mod pcd;
pub mod training_set;

pub use open::open;
