//! The data model: classes, semantic points, the semantic mesh.

pub mod choice;
mod cloud;
mod column;
mod figures;
mod id;
mod length_unit;
mod mesh;
pub mod record;
mod taxonomy;

pub use cloud::{POINT_COLUMNS, PointFlags, SemanticCloud, SemanticPoint};
pub use column::{ColumnValue, NumberType, PointColumn};
pub use figures::{FeatureFigures, ModelFigures};
pub use id::InspectionId;
pub use length_unit::LengthUnit;
pub use mesh::{SemanticMesh, triangle_area};
pub use taxonomy::{ClassDef, Color, Taxonomy};

/// Voxels along the edge of a chunk: the model is streamed, and meshed, in cubes of this many voxels.
pub const CHUNK_EDGE: i32 = 32;
