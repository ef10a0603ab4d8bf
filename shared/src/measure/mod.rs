//! Measuring kernels that agent and viewer share, so that both print the same figure.

mod area;
mod batch;
mod box_tree;
mod nearest_points;
mod pseudo_normals;
mod surface;

pub use area::surfel_area;
pub use nearest_points::{NearestPoints, Neighbour};
pub use pseudo_normals::PseudoNormals;
pub use surface::{Feature, Nearest, SurfaceIndex};
