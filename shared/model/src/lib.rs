//! The data model: classes, semantic points, the semantic mesh, the record of an inspection, of a calibration, findings, criteria,
//! verdicts, reviews, measurements, roles, and what was done with accounts.

pub mod account_log;
pub mod calibration;
pub mod choice;
mod cloud;
mod column;
pub mod criteria;
mod figures;
pub mod finding;
mod id;
mod length_unit;
pub mod measurement;
mod mesh;
pub mod record;
pub mod review;
mod role;
mod taxonomy;
pub mod verdict;

pub use cloud::{POINT_COLUMNS, PointFlags, SemanticCloud, SemanticPoint};
pub use column::{ColumnValue, NumberType, PointColumn};
pub use figures::{FeatureFigures, ModelFigures};
pub use id::InspectionId;
pub use length_unit::LengthUnit;
pub use mesh::{SemanticMesh, triangle_area};
pub use role::{InvalidRole, Role};
pub use taxonomy::{ClassDef, Color, Taxonomy};

/// Voxels along the edge of a chunk: the model is streamed, and meshed, in cubes of this many voxels.
pub const CHUNK_EDGE: i32 = 32;
