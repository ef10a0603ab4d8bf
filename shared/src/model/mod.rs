//! The data model: classes, semantic points, the semantic mesh.

mod cloud;
mod mesh;
mod taxonomy;

pub use cloud::{PointFlags, SemanticCloud, SemanticPoint};
pub use mesh::SemanticMesh;
pub(crate) use mesh::triangle_area;
pub use taxonomy::{ClassDef, Color, Taxonomy};
