//! Measuring kernels that agent and viewer share, so that both print the same figure.

mod area;
mod batch;
mod box_tree;
mod cloud_metrics;
mod nearest_points;
mod pseudo_normals;
mod semantic;
mod surface_index;

pub use area::surfel_area;
pub use cloud_metrics::{CONVENTIONS, Comparison, OneWay, PRECISION_DISTANCE, percentile};
pub use nearest_points::{Guess, NearestPoints, Neighbour};
pub use pseudo_normals::PseudoNormals;
pub use semantic::{ClassScore, LabelledPoint, SEMANTIC_CONVENTIONS, class_scores};
pub use surface_index::{Feature, Nearest, SurfaceIndex};
