//! Posed, labelled views -> the semantic map.
//!
//! [`SemanticMap`] is a voxel hash of bricks. A voxel keeps the weighted mean position, normal and colour, a Dirichlet
//! histogram over component classes and one over defect classes, uncertainties, and who saw it. Views are kept
//! ([`KeptViews`]) because an averaging map cannot subtract: better poses mean a new map ([`SemanticMap::rebuild`]).
//!
//! ```
//! use image::RgbImage;
//! use nalgebra::Isometry3;
//! use semascan_perception::fuse::{LabelledView, MapConfig, SemanticMap};
//! use semascan_perception::organized::OrganizedCloud;
//! use semascan_perception::segment::{ClassField, Segmentation};
//! use semascan_perception::view::{DepthImage, Intrinsics};
//!
//! // A wall half a metre in front of the camera, all of it of component class 2; row-major, one value a pixel.
//! let camera = Intrinsics { width: 64, height: 48, fx: 80.0, fy: 80.0, cx: 31.5, cy: 23.5 };
//! let pixels = 64 * 48;
//! let depth = DepthImage { width: 64, height: 48, metres: vec![0.5; pixels] };
//! let view = LabelledView {
//!     index: 0,
//!     cloud: OrganizedCloud::new(camera, &depth, None),
//!     rgb: RgbImage::new(64, 48).into(),
//!     segmentation: Segmentation {
//!         components: ClassField::Hard(vec![2; pixels]),
//!         defects: ClassField::Hard(vec![0; pixels]),
//!         instances: vec![0; pixels],
//!         network: None,
//!     },
//!     table_from_camera: Isometry3::identity(),
//! };
//!
//! // Voxels of 5 mm, three component classes (none included), one defect class (none).
//! let mut map = SemanticMap::new(MapConfig::new(0.005, 3, 1))?;
//! map.integrate(&view)?;
//! let cloud = map.cloud();
//! assert_eq!(cloud.len(), map.len());
//! assert!(cloud.positions.iter().all(|p| (p[2] - 0.5).abs() < 1e-3), "metres, table frame");
//! assert!(cloud.labels.iter().all(|label| *label == 2));
//! # Ok::<(), semascan_perception::fuse::FuseError>(())
//! ```

mod association;
mod associator;
mod brick;
mod consolidation;
mod error;
mod filters;
mod kept_views;
mod keys;
mod labelled_view;
mod map;
mod map_config;
mod merge;
mod runs;
mod splat_renderer;
#[cfg(test)]
mod tests;
mod view_codec;

pub use association::{
    Association, GravityCentre, Misidentification, ObjectCloud, Overlap, by_gravity_centre, by_overlap,
};
pub use associator::{AssociationTest, Associator};
pub use error::FuseError;
pub use filters::OutlierFilter;
pub use kept_views::{KeptDepth, KeptPicture, KeptViews};
pub use labelled_view::LabelledView;
pub use map::{Integration, SemanticMap, TouchedChunk};
pub use map_config::{MapConfig, SMALLEST_VOXEL, Uncertain, UncertaintyRule, voxel_at, voxel_for};
