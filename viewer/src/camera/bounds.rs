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

    /// What both hold; empty if that is nothing.
    pub fn intersection(self, other: Self) -> Self {
        let both = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        if both.is_empty() { Self::EMPTY } else { both }
    }

    /// It with its radius to every side so many times over; empty if it is empty.
    pub fn grown(self, times: f32) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let margin = Vec3::splat(self.radius() * times);
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Its eight corners; none if it is empty.
    pub fn corners(self) -> impl Iterator<Item = Vec3> {
        let corner = move |i: u32| {
            let pick = |axis: u32| if i & (1 << axis) == 0 { self.min } else { self.max };
            Vec3::new(pick(0).x, pick(1).y, pick(2).z)
        };
        (0..if self.is_empty() { 0 } else { 8 }).map(corner)
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
    fn corners_intersections_and_margins() {
        let a = Bounds::from_corners(Vec3::ZERO, Vec3::ONE);
        let b = Bounds::from_corners(Vec3::splat(0.5), Vec3::splat(9.0));
        assert_eq!(a.intersection(b), Bounds::from_corners(Vec3::splat(0.5), Vec3::ONE));
        assert!(a.intersection(Bounds::from_corners(Vec3::splat(2.0), Vec3::splat(3.0))).is_empty());
        assert_eq!(
            a.corners().fold(Bounds::EMPTY, |mut all, c| {
                all.include(c);
                all
            }),
            a
        );
        assert_eq!(Bounds::EMPTY.corners().count(), 0);
        assert!(Bounds::EMPTY.grown(3.0).is_empty());
        assert!((a.grown(1.0).min.x + a.radius()).abs() < 1e-6);
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
