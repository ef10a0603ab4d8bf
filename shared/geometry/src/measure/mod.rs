//! Measuring kernels that agent and viewer share, so that both print the same figure.
//!
//! ```
//! use semascan_geometry::measure::{NearestPoints, OneWay};
//!
//! // A reference of 100 points on a line, 1 mm apart ([x, y, z] in metres), and points 0.5 mm beside it.
//! let reference: Vec<[f32; 3]> = (0..100).map(|i| [i as f32 * 1e-3, 0.0, 0.0]).collect();
//! let model: Vec<[f32; 3]> = reference.iter().map(|p| [p[0], 5e-4, 0.0]).collect();
//!
//! let index = NearestPoints::new(&reference);
//! let nearest = index.nearest(model[7]).expect("the reference has points");
//! assert_eq!(nearest.index, 7);
//!
//! let distances: Vec<f64> = model.iter().filter_map(|p| Some(index.nearest(*p)?.distance())).collect();
//! let a_to_b = OneWay::of(&distances).expect("distances");
//! assert!((a_to_b.hd95 - 5e-4).abs() < 1e-9, "metres");
//! ```

mod area;
mod batch;
mod box_tree;
mod cloud_metrics;
pub mod dimensions;
mod figures;
mod geodesic;
mod nearest_points;
mod patch;
mod pseudo_normals;
mod semantic;
mod surface_index;
mod surface_way;

pub use area::seen_vertex_areas;
pub use cloud_metrics::{CONVENTIONS, Comparison, OneWay, PRECISION_DISTANCE, percentile};
pub use figures::model_figures;
pub use geodesic::{Distances, Geodesics};
pub use nearest_points::{Guess, NearestPoints, Neighbour};
pub use patch::PatchSurface;
pub use pseudo_normals::PseudoNormals;
pub use semantic::{ClassScore, LabelledPoint, SEMANTIC_CONVENTIONS, class_scores};
pub use surface_index::{Feature, Nearest, SurfaceIndex};
pub use surface_way::{SurfaceWay, SurfaceWays, smooth_edge_length};
