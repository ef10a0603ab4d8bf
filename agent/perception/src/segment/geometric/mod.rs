//! Geometric segmentation ([Eye-in-hand 2020], section 3.1): a cloud falls into patches along its creases and colour
//! borders, and the patches clean the masks of a network.
//!
//! The files are the paper's steps: [`vccs`] supervoxels, joined by `lccp` convexity and `lcccp` colour; [`slic`]
//! superpixels, the alternative that it compares with; [`fusion_segmentation`], its 50 % rule. All of it runs on one
//! thread in a fixed order: the same points give the same patches.

mod flood;
pub mod fusion_segmentation;
pub mod lcccp;
pub mod lccp;
mod noise_filters;
mod normals;
mod points;
mod seed_cells;
mod segmented_cloud;
mod segmenter;
pub mod slic;
pub mod vccs;
mod voxel_grid;

pub use noise_filters::NoiseFilter;
pub use points::ColoredPoints;
pub use segmented_cloud::{GeometricConfig, SegmentedCloud};
pub use segmenter::{GeometricSegmenter, PatchMethod};
pub use voxel_grid::{NONE, VoxelGrid};

#[cfg(test)]
mod tests;
