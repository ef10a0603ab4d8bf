//! Settings of the mesher, and why there is no mesh.

use semascan_model::PointFlags;

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
    pub(super) fn check(&self) -> Result<(), MeshError> {
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
