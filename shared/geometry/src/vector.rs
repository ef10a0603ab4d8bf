//! Vectors as plain arrays: the form in which points lie in clouds and meshes.
//!
//! Sums run from the first coordinate to the last, in the precision of the arguments: results are the same to the last
//! bit wherever these functions are used.

use std::ops::{Add, Div, Mul, Sub};

/// A real number: f32 or f64.
pub trait Real:
    Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
}

impl Real for f32 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Real for f64 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// Difference `a - b`.
#[inline(always)]
pub fn sub<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Scalar product.
#[inline(always)]
pub fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[inline(always)]
pub fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length.
#[inline(always)]
pub fn length<T: Real>(v: [T; 3]) -> T {
    dot(v, v).sqrt()
}

/// Squared distance of two points.
#[inline(always)]
pub fn squared_distance<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let d = sub(a, b);
    dot(d, d)
}

/// `v` at length 1, and the length it had; `None` unless that is above `least`.
#[inline(always)]
pub fn direction<T: Real>(v: [T; 3], least: T) -> Option<([T; 3], T)> {
    let length = length(v);
    (length > least).then(|| (v.map(|c| c / length), length))
}

/// `v` at length 1; `None` unless it is longer than `least`.
#[inline(always)]
pub fn unit<T: Real>(v: [T; 3], least: T) -> Option<[T; 3]> {
    direction(v, least).map(|(unit, _)| unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_the_axes() {
        let (x, y) = ([1.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        assert_eq!(cross(x, y), [0.0, 0.0, 2.0]);
        assert_eq!((dot(x, y), dot(y, y), squared_distance(x, y)), (0.0, 4.0, 5.0));
        assert_eq!(direction(y, 0.0), Some(([0.0, 1.0, 0.0], 2.0)));
        assert_eq!(unit(y, 2.0), None);
        assert_eq!(unit([f32::NAN, 0.0, 0.0], 0.0), None);
    }
}
