//! A plane, and coordinates on it.

use super::Place;
use crate::vector::{cross, dot, unit};

/// Above this the normal counts as upright, and the plane's second axis is the frame's y.
const UPRIGHT: f64 = 0.95;

/// The places p with `normal . p = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: [f64; 3],
    offset: f64,
    axes: [[f64; 3]; 2],
}

impl Plane {
    /// The plane through `place` (metres) across `normal`, of any length; `None` unless these make one.
    pub fn through(place: [f64; 3], normal: [f64; 3]) -> Option<Self> {
        let normal = unit(normal, 1e-12)?;
        let offset = dot(normal, place);
        let up = if normal[2].abs() > UPRIGHT { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let first = unit(cross(up, normal), 1e-6)?;
        offset.is_finite().then(|| Self { normal, offset, axes: [first, cross(normal, first)] })
    }

    /// Unit normal.
    pub fn normal(&self) -> [f64; 3] {
        self.normal
    }

    /// Distance from the origin along the normal, metres.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Unit vectors along the plane: seen from where the normal points, the first is to the right and the second up (z, or y where
    /// the normal is upright).
    pub fn axes(&self) -> [[f64; 3]; 2] {
        self.axes
    }

    /// How far a place lies beyond the plane along the normal, metres.
    pub fn height(&self, place: [f64; 3]) -> f64 {
        dot(self.normal, place) - self.offset
    }

    /// The foot of a place, on the plane: metres along its axes from the foot of the origin.
    pub fn drop(&self, place: [f64; 3]) -> Place {
        self.axes.map(|axis| dot(axis, place))
    }

    /// A place on the plane as a place in space, metres.
    pub fn lift(&self, [along, up]: Place) -> [f64; 3] {
        let [first, second] = self.axes;
        [0, 1, 2].map(|k| self.normal[k] * self.offset + first[k] * along + second[k] * up)
    }

    /// Where a ray from `from` (metres) in the direction `toward` meets the plane; `None` where it does not.
    pub fn hit(&self, from: [f64; 3], toward: [f64; 3]) -> Option<Place> {
        let way = -self.height(from) / dot(self.normal, toward);
        let place = [0, 1, 2].map(|k| from[k] + way * toward[k]);
        (way > 0.0 && place.iter().all(|c| c.is_finite())).then(|| self.drop(place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_those_of_the_frame() {
        let axes = |normal| Plane::through([0.0; 3], normal).expect("a plane").axes();
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(axes([0.0, 0.0, 3.0]), [x, y]);
        assert_eq!(axes(x), [y, z]);
        assert_eq!(axes(y), [[-1.0, 0.0, 0.0], z]);
    }

    #[test]
    fn a_ray_hits_what_is_in_front_of_it() {
        let plane = Plane::through([0.0, 0.0, 0.1], [0.0, 0.0, 1.0]).expect("a plane");
        assert_eq!(plane.hit([0.2, 0.3, 1.1], [0.5, 0.0, -1.0]), Some([0.7, 0.3]));
        assert_eq!(plane.hit([0.2, 0.3, 1.1], [0.0, 0.0, 1.0]), None);
        assert_eq!(plane.hit([0.2, 0.3, 1.1], [1.0, 0.0, 0.0]), None);
        assert!(Plane::through([0.0; 3], [0.0; 3]).is_none() && Plane::through([f64::NAN; 3], [1.0; 3]).is_none());
    }
}
