//! What happens to the comparison with a reference.

use crate::mesh_worker::{DeviationFigures, ReferenceInfo};
use semascan_model::LengthUnit;
use std::sync::Arc;

/// One thing that happens to the comparison.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviationEvent {
    /// The file of that name is being read.
    Reading(String),
    /// A file was read: the mesh shall be compared with what it holds.
    FileRead {
        /// Name of the file.
        name: String,
        /// Its content.
        bytes: Arc<[u8]>,
    },
    /// The person says what unit the numbers of the reference are in; `None` leaves it to the file or its size.
    Unit(Option<LengthUnit>),
    /// The file holds a reference.
    Reference(ReferenceInfo),
    /// The file holds no reference; one that was there before stays.
    NoReference,
    /// The person takes the reference away.
    Removed,
    /// There is another mesh: what was measured is of the one before.
    MeshReplaced,
    /// The mesh was compared with the reference.
    Compared(DeviationFigures),
    /// Deviations up to so many metres are within tolerance.
    Tolerance(f64),
}
