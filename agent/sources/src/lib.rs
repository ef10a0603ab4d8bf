//! Where views come from: one folder a source. Each implements [`Source`](semascan_inspection::source::Source).

pub mod bop;
pub mod camera_mask;
pub mod depth_map;
pub mod mesh_file;
mod open;
pub mod pcd;
pub mod percent;
pub mod training_set;

pub use open::open;
