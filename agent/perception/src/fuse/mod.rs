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
pub use kept_views::KeptViews;
pub use labelled_view::LabelledView;
pub use map::{Integration, SemanticMap, TouchedChunk};
pub use map_config::{MapConfig, SMALLEST_VOXEL, Uncertain, UncertaintyRule, voxel_for};
