//! A distortion together with the range in which it can be turned round.
//!
//! The polynomials are fitted inside of the picture and mean nothing far outside of it: past some radius they fall again,
//! and two rays would share a pixel. So the largest radius up to which the model rises in all directions is looked for once, and
//! rays beyond it have no pixel. To turn the model round, the radial part is solved by Newton's method between bounds, which
//! always converges as it rises, and the tangential part by Newton's method in two dimensions from there; the result is put
//! in again and must give back the pixel.

use super::{Distortion, UnusableCamera};
use std::f64::consts::TAU;

/// Farthest angle from the optical axis at which a ray is still projected: a pinhole picture cannot show more.
const WIDEST: f64 = 85.0 * std::f64::consts::PI / 180.0;
/// Steps in which the end of the range is looked for, and halvings of the step that holds it.
const STEPS: u32 = 2048;
const HALVINGS: u32 = 60;
/// Directions in which it is looked for, where the lens is not the same in all.
const DIRECTIONS: u32 = 64;
/// Least slope of the radial part: below it a pixel says next to nothing of the ray.
const LEAST_SLOPE: f64 = 1e-4;
/// Largest error of a ray that was turned round, on the plane z = 1: a ten thousandth of a pixel of any camera.
const CONVERGED: f64 = 1e-9;
/// Most steps of Newton's method.
const MOST_STEPS: u32 = 50;

/// A distortion and its range.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lens {
    distortion: Distortion,
    /// Largest argument of the radial part: a tangent, of a fisheye an angle.
    range: f64,
}

/// Values of the radial part.
struct Radial {
    /// Where the ray goes.
    value: f64,
    /// By how much more for a larger argument.
    slope: f64,
}

impl Lens {
    pub(super) fn new(distortion: Distortion) -> Result<Self, UnusableCamera> {
        if let Some(at) = distortion.coefficients().iter().position(|c| !c.is_finite()) {
            return Err(UnusableCamera::NotFinite(at));
        }
        let mut lens = Self { distortion, range: 0.0 };
        let widest = match distortion {
            Distortion::Fisheye { .. } => WIDEST,
            _ => WIDEST.tan(),
        };
        let (mut inside, mut outside) = (0.0, widest);
        for step in 1..=STEPS {
            let next = widest * f64::from(step) / f64::from(STEPS);
            if !lens.rises(next) {
                outside = next;
                break;
            }
            inside = next;
        }
        if inside < widest {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (inside + outside);
                if lens.rises(middle) {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
        }
        lens.range = inside;
        Ok(lens)
    }

    pub(super) fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Where a ray through `(x, y)` on the plane z = 1 goes; `None` outside of the range.
    pub(super) fn distort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let radius = x.hypot(y);
        let argument = match self.distortion {
            Distortion::None => return (radius <= self.range).then_some((x, y)),
            Distortion::Fisheye { .. } => radius.atan(),
            _ => radius,
        };
        // NaN is in no range either.
        if !(0.0..=self.range).contains(&argument) {
            return None;
        }
        let bent = self.distortion.bent(x, y);
        if self.tangential().is_none() {
            return (bent.0.is_finite() && bent.1.is_finite()).then_some(bent);
        }
        (self.jacobian(x, y)?.determinant() > 0.0).then_some(bent)
    }

    /// The ray that comes to `(x, y)`, on the plane z = 1; `None` if none in the range does.
    pub(super) fn undistort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        if self.distortion == Distortion::None {
            return self.distort(x, y);
        }
        let length = x.hypot(y);
        if !length.is_finite() {
            return None;
        }
        let argument = self.radial_argument(length)?;
        let radius = match self.distortion {
            Distortion::Fisheye { .. } => argument.tan(),
            _ => argument,
        };
        let scale = if length > 0.0 { radius / length } else { 1.0 };
        let (mut ray_x, mut ray_y) = (x * scale, y * scale);
        if self.tangential().is_some() {
            for _ in 0..MOST_STEPS {
                // A step that leaves the range is taken back by halves.
                let Some((found_x, found_y)) = self.distort(ray_x, ray_y) else {
                    (ray_x, ray_y) = (0.98 * ray_x, 0.98 * ray_y);
                    continue;
                };
                let (off_x, off_y) = (x - found_x, y - found_y);
                if off_x.hypot(off_y) < 1e-15 {
                    break;
                }
                let j = self.jacobian(ray_x, ray_y)?;
                let determinant = j.determinant();
                ray_x += (j.yy * off_x - j.xy * off_y) / determinant;
                ray_y += (j.xx * off_y - j.xy * off_x) / determinant;
            }
        }
        let (found_x, found_y) = self.distort(ray_x, ray_y)?;
        ((found_x - x).hypot(found_y - y) < CONVERGED).then_some((ray_x, ray_y))
    }

    /// The argument at which the radial part is `length`; the end of the range where it is nowhere so large and tangential
    /// parts may still lead there. Newton's method, by halves where it leaves what holds the solution.
    fn radial_argument(&self, length: f64) -> Option<f64> {
        let most = self.radial(self.range)?.value;
        if length >= most {
            return (length == most || self.tangential().is_some()).then_some(self.range);
        }
        let (mut low, mut high) = (0.0, self.range);
        let mut argument = length.min(self.range);
        for _ in 0..2 * MOST_STEPS {
            let Radial { value, slope } = self.radial(argument)?;
            let off = value - length;
            if off > 0.0 {
                high = argument;
            } else {
                low = argument;
            }
            let newton = argument - off / slope;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - argument).abs() <= f64::EPSILON * argument.abs() {
                break;
            }
            argument = next;
        }
        Some(argument)
    }

    /// Whether the model rises at `argument`, in all directions.
    fn rises(&self, argument: f64) -> bool {
        let Some(Radial { value, slope }) = self.radial(argument) else { return false };
        if !(value.is_finite() && slope > LEAST_SLOPE) {
            return false;
        }
        let (Some([p1, p2]), true) = (self.tangential(), argument > 0.0) else { return true };
        // The derivatives along and across a ray that lies at an angle to the tangential part's own direction. Where they form a
        // positive definite matrix on the whole of a disc, no two rays of the disc share a pixel.
        let strength = 2.0 * argument * p1.hypot(p2);
        (0..DIRECTIONS).all(|direction| {
            let (across, along) = (f64::from(direction) * TAU / f64::from(DIRECTIONS)).sin_cos();
            let radial = slope + 3.0 * strength * along;
            let lateral = value / argument + strength * along;
            radial > 0.0 && radial * lateral > (strength * across).powi(2)
        })
    }

    /// The radial part; `None` at and past a pole.
    fn radial(&self, argument: f64) -> Option<Radial> {
        let square = argument * argument;
        match self.distortion {
            Distortion::None => Some(Radial { value: argument, slope: 1.0 }),
            Distortion::Fisheye { radial: [k1, k2, k3, k4] } => Some(Radial {
                value: argument * (1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))),
                slope: 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + square * (7.0 * k3 + square * 9.0 * k4))),
            }),
            Distortion::BrownConrady { .. } | Distortion::Rational { .. } => {
                let (factor, by_square) = self.factor(square)?;
                Some(Radial { value: argument * factor, slope: factor + 2.0 * square * by_square })
            }
        }
    }

    /// The factor q of the radial part of a polynomial model, and its derivative by the squared radius; `None` at and past a
    /// pole.
    fn factor(&self, square: f64) -> Option<(f64, f64)> {
        let (above, below) = match self.distortion {
            Distortion::BrownConrady { radial, .. } => (radial, [0.0; 3]),
            Distortion::Rational { radial, divisor, .. } => (radial, divisor),
            Distortion::None | Distortion::Fisheye { .. } => return None,
        };
        let polynomial = |[a, b, c]: [f64; 3]| 1.0 + square * (a + square * (b + square * c));
        let derivative = |[a, b, c]: [f64; 3]| a + square * (2.0 * b + square * 3.0 * c);
        let (numerator, denominator) = (polynomial(above), polynomial(below));
        if denominator <= 1e-6 {
            return None;
        }
        let by_square = (derivative(above) * denominator - numerator * derivative(below)) / (denominator * denominator);
        Some((numerator / denominator, by_square))
    }

    /// The tangential part, where there is one.
    fn tangential(&self) -> Option<[f64; 2]> {
        match self.distortion {
            Distortion::BrownConrady { tangential, .. } | Distortion::Rational { tangential, .. } => {
                (tangential != [0.0; 2]).then_some(tangential)
            }
            Distortion::None | Distortion::Fisheye { .. } => None,
        }
    }

    /// Derivatives of a polynomial model's pixel by the ray.
    fn jacobian(&self, x: f64, y: f64) -> Option<Jacobian> {
        let (factor, by_square) = self.factor(x * x + y * y)?;
        let [p1, p2] = self.tangential()?;
        Some(Jacobian {
            xx: factor + 2.0 * x * x * by_square + 2.0 * p1 * y + 6.0 * p2 * x,
            xy: 2.0 * x * y * by_square + 2.0 * p1 * x + 2.0 * p2 * y,
            yy: factor + 2.0 * y * y * by_square + 6.0 * p1 * y + 2.0 * p2 * x,
        })
    }
}

/// A symmetric 2 x 2 matrix: both mixed derivatives of a polynomial model are equal.
struct Jacobian {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Jacobian {
    fn determinant(&self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }
}
