//! What happens to the photographs of a picked point.

use super::Sight;
use crate::features::inspect::PickedPoint;

/// One thing that happens to them.
#[derive(Clone, Debug, PartialEq)]
pub enum EvidenceEvent {
    /// These photographs show the picked point, the best first.
    Found {
        /// The point.
        point: PickedPoint,
        /// The photographs.
        sights: Vec<Sight>,
    },
    /// No point is picked any more.
    Lost,
    /// The person opens or closes the photographs.
    Open(bool),
    /// The person wants the photograph so many places further.
    Step(i32),
    /// The person wants the photograph at this place of the list.
    Show(usize),
    /// The person wants to see the surroundings of the point at large, or the whole picture.
    Magnify(bool),
    /// The person lays the photograph onto the mesh, or takes it away.
    Project(bool),
    /// How strongly it is laid over, 0..=1.
    Strength(f32),
    /// The pixels of this view's photograph are there: in full size, or of the small picture alone.
    Loaded {
        /// The view.
        view: u32,
        /// Whether they are as many as the camera has.
        is_full: bool,
    },
    /// There are no pixels of this view's photograph.
    NotLoaded(u32),
}
