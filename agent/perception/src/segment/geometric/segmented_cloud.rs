//! A cloud cut into segments: supervoxels, joined where they meet convexly and in one colour (P1 section 3.1.2).

use super::lcccp::{ColorCriterion, lcccp};
use super::lccp::{LccpConfig, Segments, lccp};
use super::points::ColoredPoints;
use super::vccs::{Supervoxels, VccsConfig};
use super::voxel_grid::NONE;

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
    /// LCCCP for a voxel edge in metres. Colour guides the supervoxels too: one that straddles a colour border has a
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
