//! The data model: classes, semantic points, the record of an inspection.

mod cloud;
mod taxonomy;

pub use cloud::{PointFlags, SemanticCloud, SemanticPoint};
pub use taxonomy::{ClassDef, Color, Taxonomy};
