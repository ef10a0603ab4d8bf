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

pub(crate) mod adjacency;
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
/// ```
/// use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
/// use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
///
/// // A square of 50 mm that faces +z, a point every millimetre, of component class 1.
/// let point = |i: usize| SemanticPoint {
///     position: [(i % 50) as f32 * 1e-3, (i / 50) as f32 * 1e-3, 0.0],
///     normal: [0.0, 0.0, 1.0],
///     color: [128; 3],
///     label: 1,
///     confidence: 1.0,
///     defect: 0,
///     defect_confidence: 1.0,
///     sigma: 0.0,
///     defect_sigma: 0.0,
///     instance: 0,
///     views: 1,
///     flags: PointFlags::default(),
/// };
/// let cloud: SemanticCloud = (0..2500).map(point).collect();
///
/// // `&()` reports progress to nobody.
/// let mesh = mesh_cloud(&cloud, 1e-3, &MeshOptions::default(), &())?;
/// assert!((mesh.area() - 0.05 * 0.05).abs() < 3e-4, "square metres");
/// assert!(mesh.vertices.labels.iter().all(|label| *label == 1));
/// # Ok::<(), semascan_geometry::mesh::MeshError>(())
/// ```
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
