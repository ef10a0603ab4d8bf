//! What happens to the section plane and the box.

use super::{Direction, Ray, Shown};
use semascan_geometry::section::Plane;
use std::sync::Arc;

/// One thing that happens to them.
#[derive(Clone, Debug, PartialEq)]
pub enum SectionEvent {
    /// The person wants the plane, or no plane.
    Show(bool),
    /// The person wants the plane to lie across this.
    Turn(Direction),
    /// The person wants it to lie across the direction that the camera looks in.
    FaceCamera,
    /// The camera looks from here (metres, table frame): the side toward it is to be cut away.
    Toward([f64; 3]),
    /// The person wants the plane so far from where its offsets are counted from, metres.
    Offset(f64),
    /// The person moves it so far toward what is kept, metres.
    Deepen(f64),
    /// The person wants the other side cut away.
    Flip,
    /// The person wants a box, or none.
    ShowLimits(bool),
    /// The person wants this end of the box there.
    Limit {
        /// Axis of the table frame, 0..3.
        axis: usize,
        /// 0 for the lower end, 1 for the upper.
        end: usize,
        /// Metres, table frame.
        at: f64,
    },
    /// The person followed a link to a plane and a box.
    Follow {
        /// The plane, what lies beyond it is cut away; `None` without one.
        plane: Option<Plane>,
        /// The box: its lowest and highest corner, metres, table frame; `None` without one.
        limits: Option<[[f64; 3]; 2]>,
    },
    /// The person wants the whole model back.
    Reset,
    /// The box around the model, metres, table frame; `None` without a model.
    Extent(Option<[[f64; 3]; 2]>),
    /// What the plane cuts; `None` without a plane or a mesh.
    Cut(Option<Arc<Shown>>),
    /// The person begins to read thicknesses, or ends it.
    Read(bool),
    /// The pointer is there while they do; `None` once it has left.
    Aimed(Option<Ray>),
    /// The person clicked there.
    Clicked(Ray),
    /// The person takes the first end of a distance back, or ends reading.
    Back,
    /// The person takes this reading away.
    Remove(u32),
    /// The person takes all readings away.
    RemoveAll,
}
