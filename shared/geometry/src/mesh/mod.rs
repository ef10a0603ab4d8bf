//! Oriented semantic points -> semantic mesh: one mesher for agent and browser.
//!
//! The points of the map (position, normal, evidence; voxel edge known) define an implicit surface on a narrow band of a
//! grid (`field`); cells that it crosses on good evidence (`cells`) get a vertex a sheet (`topology`), quads join
//! them (`tile`), and each vertex takes labels, colour and confidence from the points around it by their weight
//! (`vertices`). Work goes tile by tile, each on its own ([`Mesher`]): only what changed is computed again, results do
//! not depend on threads, and the same cloud gives the same mesh natively and in WebAssembly.
//!
//! Nothing is invented: gaps narrower than the kernel are bridged, everything wider stays open and its rim is marked.
//! [`fill_holes`] closes small holes where that is asked for. Sheets thinner than about 1.5 grid cells have no node
//! between their sides and break up.

mod adjacency;
mod assemble;
mod blend;
mod cells;
mod collapse_queue;
mod columns;
mod decimate;
mod field;
mod holes;
mod mesher;
mod node;
mod options;
mod points;
mod progress;
mod quadric;
mod simplify;
mod smooth;
mod threads;
mod tile;
mod topology;
mod vertices;
mod working_grid;

pub use decimate::decimate;
pub use holes::fill_holes;
pub use mesher::Mesher;
pub use options::{MeshError, MeshOptions};
pub use progress::Progress;
pub use simplify::simplify_points;
pub use smooth::smooth;

use semascan_model::{SemanticCloud, SemanticMesh};

/// Meshes a whole cloud whose points are means over voxels of edge `voxel` (metres). Without oriented points the mesh is
/// empty.
///
/// # Errors
/// [`MeshError`] if a setting is out of range or `progress` ends the work.
pub fn mesh_cloud(
    cloud: &SemanticCloud,
    voxel: f32,
    options: &MeshOptions,
    progress: &dyn Progress,
) -> Result<SemanticMesh, MeshError> {
    let mut mesher = Mesher::new(voxel, options.clone())?;
    mesher.set_cloud(cloud);
    mesher.update(progress)?;
    Ok(mesher.mesh())
}
