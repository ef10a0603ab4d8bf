//! Geometric segmentation (P1 section 3.1): a cloud falls into patches along its creases and colour borders, and the
//! patches clean the masks of a network.
//!
//! The files are the paper's steps: [`vccs`] supervoxels, joined by `lccp` convexity and `lcccp` colour; [`slic`]
//! superpixels, P1's alternative in the picture; [`fusion_segmentation`], its 50 % rule. All of it runs on one thread in
//! a fixed order: the same points give the same patches.

mod flood;
pub mod fusion_segmentation;
pub mod lcccp;
pub mod lccp;
mod noise_filters;
mod normals;
mod points;
mod seed_cells;
mod segmenter;
pub mod slic;
pub mod vccs;
mod voxel_grid;

pub use noise_filters::NoiseFilter;
pub use points::ColoredPoints;
pub use segmenter::{GeometricSegmenter, PatchMethod};
pub use voxel_grid::{NONE, VoxelGrid};

use lcccp::{ColorCriterion, lcccp};
use lccp::{LccpConfig, Segments, lccp};
use vccs::{Supervoxels, VccsConfig};

/// How a cloud is cut into segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometricConfig {
    /// Supervoxels.
    pub vccs: VccsConfig,
    /// Convexity.
    pub lccp: LccpConfig,
    /// Colour; `None` is LCCP.
    pub color: Option<ColorCriterion>,
}

impl GeometricConfig {
    /// P1's LCCCP for a voxel edge in metres. Colour guides the supervoxels too: one that straddles a colour border has a
    /// mean colour that belongs to neither side.
    pub fn new(voxel: f32) -> Self {
        let vccs = VccsConfig { color: 1.0, ..VccsConfig::new(voxel) };
        let lccp = LccpConfig { small: 2, ..LccpConfig::default() };
        Self { vccs, lccp, color: Some(ColorCriterion::default()) }
    }
}

/// A cloud cut into segments of supervoxels.
#[derive(Clone, Debug, Default)]
pub struct SegmentedCloud {
    /// The supervoxels.
    pub supervoxels: Supervoxels,
    /// Which of them belong together.
    pub segments: Segments,
}

impl SegmentedCloud {
    /// Cuts `points`.
    pub fn new(points: &ColoredPoints, config: &GeometricConfig) -> Self {
        let supervoxels = Supervoxels::grow(points, &config.vccs);
        let segments = match &config.color {
            Some(color) => lcccp(&supervoxels, &config.vccs, &config.lccp, color),
            None => lccp(&supervoxels, &config.vccs, &config.lccp),
        };
        Self { supervoxels, segments }
    }

    /// Segment of each point; [`NONE`] for points without one.
    pub fn of_point(&self) -> Vec<u32> {
        let of_patch = &self.segments.of_patch;
        self.supervoxels.of_point.iter().map(|&p| of_patch.get(p as usize).copied().unwrap_or(NONE)).collect()
    }
}

#[cfg(test)]
mod tests;
