//! Geometric segmentation (P1 section 3.1): a cloud falls into patches along its creases and colour borders, and the
//! patches clean the masks of a network.
//!
//! The files are the paper's steps: [`vccs`] supervoxels, joined by [`lccp`] convexity and [`lcccp`] colour; [`slic`]
//! superpixels, P1's alternative in the picture; [`fusion_segmentation`], its 50 % rule.

pub mod lcccp;
pub mod lccp;
mod normals;
mod points;
pub mod vccs;
mod voxel_grid;

pub use points::ColouredPoints;
pub use voxel_grid::{NONE, VoxelGrid};
