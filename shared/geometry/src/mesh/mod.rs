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
mod points;
mod progress;
mod quadric;
mod simplify;
mod smooth;
mod threads;
mod tile;
mod topology;
mod vertices;

pub use decimate::decimate;
pub use holes::fill_holes;
pub use mesher::Mesher;
pub use progress::Progress;
pub use simplify::simplify_points;
pub use smooth::smooth;

use semascan_model::{PointFlags, SemanticCloud, SemanticMesh};

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshOptions {
    /// Edge of a grid cell in voxels, 0.25 to 8.
    pub pitch: f32,
    /// Radius of the kernel in voxels: 1.5 to 4 grid cells.
    pub radius: f32,
    /// Least cosine between the normals of points that belong to one sheet, -1 to 1.
    pub normal_gate: f32,
    /// Marks (bits of [`PointFlags`]), any of which leaves a point out.
    pub skip_flags: u16,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { pitch: 1.0, radius: 2.0, normal_gate: 0.5, skip_flags: PointFlags::LEFT_OUT }
    }
}

impl MeshOptions {
    fn check(&self) -> Result<(), MeshError> {
        let within = |field, value: f32, low: f32, high: f32| {
            // Not a number fails this as well.
            if (low..=high).contains(&value) { Ok(()) } else { Err(MeshError::Options { field, value, low, high }) }
        };
        within("pitch", self.pitch, 0.25, 8.0)?;
        within("radius", self.radius, 1.5 * self.pitch, 4.0 * self.pitch)?;
        within("normal_gate", self.normal_gate, -1.0, 1.0)
    }
}

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The voxel edge is not a length.
    #[error("a voxel edge of {voxel} m is not a length")]
    Voxel {
        /// What was given.
        voxel: f32,
    },
    /// A setting is out of range.
    #[error("{field} is {value}: it must be from {low} to {high}")]
    Options {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: f32,
        /// Least value.
        low: f32,
        /// Greatest value.
        high: f32,
    },
    /// The progress listener ended the work.
    #[error("meshing was cancelled")]
    Cancelled,
}

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
