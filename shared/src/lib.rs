//! What Semascan's edge agent and viewer both speak. Builds natively and for wasm32.
//!
//! | module | what |
//! |---|---|
//! | [`model`] | classes, the semantic point cloud, the semantic mesh |
//! | [`wire`] | the messages of the live stream and the chunk codec |
//! | [`mesh`] | oriented semantic points to a semantic mesh |
//! | [`measure`] | areas and distances, the same figures in agent and viewer |
//! | [`export`] | PLY, OBJ, STL and glTF writers |
//! | [`import`] | PLY, OBJ, STL and GLB readers |

pub mod export;
pub mod import;
pub mod measure;
pub mod mesh;
pub mod model;
pub mod wire;
