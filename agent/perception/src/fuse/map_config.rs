//! Settings of the map, and the voxel that suits a view.

use crate::organized::OrganizedCloud;
use crate::segment::{COMPONENT_SIGMA_LIMIT, DEFECT_SIGMA_LIMIT};
use crate::view::Intrinsics;
use nalgebra::Point3;
pub use semascan_model::record::Uncertain;

/// When a pixel's label is too uncertain, and what becomes of the pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertaintyRule {
    /// Largest sigma of a component label.
    pub threshold: f32,
    /// Largest sigma of a defect label; beyond it there is no evidence for any defect, and that is all.
    pub defect_threshold: f32,
    /// What becomes of pixels beyond `threshold`.
    pub uncertain: Uncertain,
}

impl Default for UncertaintyRule {
    fn default() -> Self {
        Self { threshold: COMPONENT_SIGMA_LIMIT, defect_threshold: DEFECT_SIGMA_LIMIT, uncertain: Uncertain::Geometry }
    }
}

/// Settings of a map.
#[derive(Clone, Debug)]
pub struct MapConfig {
    /// Voxel edge in metres.
    pub voxel: f64,
    /// Component classes, `none` included.
    pub components: usize,
    /// Defect classes, `none` included.
    pub defects: usize,
    /// Most evidence that one view may add to a voxel.
    pub evidence_cap: f32,
    /// When a pixel's label is too uncertain, and what becomes of the pixel.
    pub uncertainty: UncertaintyRule,
    /// Measuring volume in the table frame (min and max corner); points outside are marked as background.
    pub volume: Option<(Point3<f64>, Point3<f64>)>,
    /// Bytes of kept views held in memory before they go to disk.
    pub keep_in_memory: usize,
}

impl MapConfig {
    /// The usual settings for a voxel size and class counts.
    pub fn new(voxel: f64, components: usize, defects: usize) -> Self {
        Self {
            voxel,
            components,
            defects,
            evidence_cap: 1.0,
            uncertainty: UncertaintyRule::default(),
            volume: None,
            keep_in_memory: 256 << 20,
        }
    }
}

/// Smallest voxel that is chosen by itself, metres.
pub const SMALLEST_VOXEL: f64 = 0.5e-3;

/// Voxel edge for views like this one: twice the median pixel footprint, at least [`SMALLEST_VOXEL`]. `None` without depth.
pub fn voxel_for(cloud: &OrganizedCloud) -> Option<f64> {
    cloud.median_depth().map(|depth| voxel_at(&cloud.intrinsics, depth))
}

/// Voxel edge in metres for views whose median depth is `depth` metres.
pub fn voxel_at(intrinsics: &Intrinsics, depth: f64) -> f64 {
    (2.0 * intrinsics.footprint(depth)).max(SMALLEST_VOXEL)
}
