//! An axis-aligned box, empty until it has seen a point.

use glam::Vec3;

/// Axis-aligned box in metres, table frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

impl Bounds {
    /// Holds nothing; the neutral element of [`Bounds::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box between two corners given in any order.
    pub fn from_corners(a: Vec3, b: Vec3) -> Self {
        Self { min: a.min(b), max: a.max(b) }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Grows to hold `p`; a point that is not finite is passed over.
    pub fn include(&mut self, p: Vec3) {
        if p.is_finite() {
            self.min = self.min.min(p);
            self.max = self.max.max(p);
        }
    }

    /// The box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Its middle; the origin if it is empty.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { (self.min + self.max) / 2.0 }
    }

    /// Radius of the sphere around it, metres; 0 if it is empty.
    pub fn radius(&self) -> f32 {
        if self.is_empty() { 0.0 } else { (self.max - self.min).length() / 2.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_is_neutral_and_has_no_size() {
        let one = Bounds::from_corners(Vec3::ONE, Vec3::NEG_ONE);
        assert_eq!(Bounds::EMPTY.union(one), one);
        assert!(Bounds::EMPTY.is_empty());
        assert_eq!(Bounds::EMPTY.radius(), 0.0);
        assert_eq!(one.center(), Vec3::ZERO);
    }

    #[test]
    fn what_is_not_finite_does_not_stretch_it() {
        let mut bounds = Bounds::EMPTY;
        bounds.include(Vec3::new(f32::NAN, 0.0, 0.0));
        bounds.include(Vec3::new(0.0, f32::INFINITY, 0.0));
        assert!(bounds.is_empty());
        bounds.include(Vec3::X);
        assert_eq!(bounds, Bounds { min: Vec3::X, max: Vec3::X });
    }
}
