//! What happens to the mesh.

use super::PartCount;
use crate::display::Representation;
use semascan_model::ModelFigures;

/// One thing that happens to the mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshEvent {
    /// The person chose what the model is drawn as.
    Show(Representation),
    /// The mesh of the model as it is now is wanted.
    Requested,
    /// The person wants the meshing to end.
    CancelRequested,
    /// So much of the mesh is made.
    Progress {
        /// Tiles done.
        done: u32,
        /// Tiles in all.
        total: u32,
    },
    /// The mesh that comes next has so much of each component, in the order of their classes.
    Counted(Vec<PartCount>),
    /// A mesh of so many triangles is there.
    Made {
        /// Their number.
        triangles: u64,
    },
    /// The model was measured on the mesh that was just made.
    Measured(Box<ModelFigures>),
    /// The meshing was ended before it was done.
    Cancelled,
    /// The model changed: a mesh that is there is out of date.
    Outdated,
}
