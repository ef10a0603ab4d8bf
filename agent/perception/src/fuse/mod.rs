//! Posed, labelled views -> the semantic map.
//!
//! [`SemanticMap`] is a voxel hash of bricks. A voxel keeps the weighted mean position, normal and colour, a Dirichlet
//! histogram over component classes and one over defect classes, uncertainties, and who saw it. Views are kept
//! ([`KeptViews`]) because an averaging map cannot subtract: better poses mean a new map ([`SemanticMap::rebuild`]).

mod association;
mod associator;
mod brick;
mod error;
mod filters;
mod kept_views;
mod keys;
mod map;
mod map_config;
mod merge;
mod runs;
mod splat_renderer;
#[cfg(test)]
mod tests;
mod view_cloud;
mod view_codec;

pub use association::{
    Association, GravityCentre, Misidentification, ObjectCloud, Overlap, by_gravity_centre, by_overlap,
};
pub use associator::{AssociationTest, Associator};
pub use error::FuseError;
pub use filters::OutlierFilter;
pub use kept_views::KeptViews;
pub use map::{Integration, SemanticMap, TouchedChunk};
pub use map_config::{MapConfig, Uncertain, UncertaintyRule};

use crate::organized::OrganizedCloud;
use crate::segment::Segmentation;
use image::RgbImage;
use nalgebra::Isometry3;

/// Everything fusion needs of one view.
#[derive(Clone, Debug)]
pub struct LabelledView {
    /// Position in the capture order.
    pub index: u32,
    /// Points and normals in the camera frame.
    pub cloud: OrganizedCloud,
    /// Colour.
    pub rgb: RgbImage,
    /// Class membership of every pixel.
    pub segmentation: Segmentation,
    /// Camera pose.
    pub table_from_camera: Isometry3<f64>,
}

/// Smallest voxel that is chosen by itself, metres.
pub const SMALLEST_VOXEL: f64 = 0.5e-3;

/// Voxel edge for views like this one: twice the median pixel footprint, at least [`SMALLEST_VOXEL`]. `None` without depth.
pub fn voxel_for(cloud: &OrganizedCloud) -> Option<f64> {
    let depth = cloud.median_depth()?;
    Some((2.0 * cloud.intrinsics.footprint(depth)).max(SMALLEST_VOXEL))
}
