//! What was picked for a measurement: a point, an element, or a piece of surface.

use crate::features::inspect::PickedPoint;
use semascan_geometry::fit::Feature;
use semascan_geometry::measure::dimensions::{self, Estimate};
use std::sync::Arc;

/// A line in the 3D view, metres, table frame.
pub type Line = [[f32; 3]; 2];

/// Something that was picked.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken {
    /// The point or element; of an area the middle of the surface.
    pub feature: Feature,
    /// What was measured on the way to it: an area in square metres, a length along the surface in metres.
    pub figure: Option<Estimate>,
    /// What shows it in the 3D view: the edge of its surface, and the element as a wireframe.
    pub lines: Arc<[Line]>,
    /// Where it was picked, metres, table frame.
    pub place: [f32; 3],
    /// Voxel edge of the model, metres.
    pub voxel: f32,
    /// Number of the measurement in the list whose element it is; `None` for something new.
    pub of: Option<u32>,
}

impl Taken {
    /// A point.
    pub fn point(point: &PickedPoint) -> Self {
        let uncertainty = dimensions::grid_uncertainty(point.voxel.into());
        Self {
            feature: Feature::point(point.position.map(f64::from), uncertainty),
            figure: None,
            lines: Arc::default(),
            place: point.position,
            voxel: point.voxel,
            of: None,
        }
    }

    /// Whether it is a point of the surface.
    pub fn is_point(&self) -> bool {
        matches!(self.feature, Feature::Point { .. })
    }
}
