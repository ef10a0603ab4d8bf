//! What a lens does to a ray, as OpenCV and ROS write it down.
//!
//! With x and y on the plane z = 1, r^2 = x^2 + y^2:
//!
//! - Brown-Conrady [Brown 1966]: x' = x q + 2 p1 x y + p2 (r^2 + 2 x^2), y' = y q + p1 (r^2 + 2 y^2) + 2 p2 x y, with
//!   q = 1 + k1 r^2 + k2 r^4 + k3 r^6.
//! - Rational: the same with q = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
//! - Fisheye [Kannala 2006]: the angle t from the optical axis becomes t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), the
//!   distance from the principal point.

use super::UnusableCamera;

/// What a lens does to a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// Nothing: the picture is that of a pinhole.
    None,
    /// Brown-Conrady, `plumb_bob` in ROS.
    BrownConrady {
        /// Radial: k1, k2, k3.
        radial: [f64; 3],
        /// Tangential: p1, p2.
        tangential: [f64; 2],
    },
    /// Rational polynomial, `rational_polynomial` in ROS.
    Rational {
        /// Radial, above the fraction line: k1, k2, k3.
        radial: [f64; 3],
        /// Radial, below it: k4, k5, k6.
        divisor: [f64; 3],
        /// Tangential: p1, p2.
        tangential: [f64; 2],
    },
    /// Equidistant fisheye, `equidistant` in ROS, `kannala_brandt` elsewhere.
    Fisheye {
        /// k1 to k4.
        radial: [f64; 4],
    },
}

/// Names that say there is no distortion.
const NONE: [&str; 3] = ["", "none", "pinhole"];
/// Names of each model.
const BROWN_CONRADY: [&str; 5] = ["plumb_bob", "brown_conrady", "radtan", "radial-tangential", "opencv"];
const RATIONAL: [&str; 3] = ["rational_polynomial", "rational", "full_opencv"];
const FISHEYE: [&str; 6] =
    ["equidistant", "fisheye", "kannala_brandt", "kannala_brandt4", "kannalabrandt4", "opencv_fisheye"];

impl Distortion {
    /// The model that `name` means, with coefficients in OpenCV's order (k1, k2, p1, p2, k3, k4, k5, k6; of a fisheye k1 to
    /// k4). No coefficients, or zeros alone, are no distortion, whatever the model is called.
    ///
    /// # Errors
    /// [`UnusableCamera`] if there is no such model, or it has another number of coefficients.
    pub fn named(name: &str, coefficients: &[f64]) -> Result<Self, UnusableCamera> {
        if let Some(at) = coefficients.iter().position(|c| !c.is_finite()) {
            return Err(UnusableCamera::NotFinite(at));
        }
        let plain = name.trim().to_ascii_lowercase();
        let is = |names: &[&str]| names.contains(&plain.as_str());
        let refuse = |expected: &'static str| {
            Err(UnusableCamera::Coefficients { model: name.to_owned(), found: coefficients.len(), expected })
        };
        // Equal angles are not equal tangents: a fisheye with zeros still bends.
        if is(&FISHEYE) {
            return match *coefficients {
                [k1, k2, k3, k4] => Ok(Self::Fisheye { radial: [k1, k2, k3, k4] }),
                _ => refuse("4"),
            };
        }
        if coefficients.iter().all(|c| *c == 0.0) && (is(&NONE) || is(&BROWN_CONRADY) || is(&RATIONAL)) {
            return Ok(Self::None);
        }
        if is(&NONE) {
            return refuse("none");
        }
        if is(&BROWN_CONRADY) {
            return match *coefficients {
                [k1, k2, p1, p2] => Ok(Self::BrownConrady { radial: [k1, k2, 0.0], tangential: [p1, p2] }),
                [k1, k2, p1, p2, k3] => Ok(Self::BrownConrady { radial: [k1, k2, k3], tangential: [p1, p2] }),
                _ => refuse("4 or 5"),
            };
        }
        if is(&RATIONAL) {
            // OpenCV appends thin prism and tilt, which are zero where they are not calibrated.
            let (first, rest) = coefficients.split_at(coefficients.len().min(8));
            return match *first {
                [k1, k2, p1, p2, k3, k4, k5, k6] if rest.iter().all(|c| *c == 0.0) => {
                    Ok(Self::Rational { radial: [k1, k2, k3], divisor: [k4, k5, k6], tangential: [p1, p2] })
                }
                _ => refuse("8 (thin prism and tilt are not known)"),
            };
        }
        // What some drivers call their model matters only if it does something.
        if !coefficients.is_empty() && coefficients.iter().all(|c| *c == 0.0) {
            return Ok(Self::None);
        }
        Err(UnusableCamera::Model(name.to_owned()))
    }

    /// Where a ray through `(x, y)` on the plane z = 1 goes by the model's equations, also where these mean nothing any more:
    /// [`super::CameraModel`] knows how far they do.
    pub fn bent(&self, x: f64, y: f64) -> (f64, f64) {
        let square = x * x + y * y;
        let (scale, tangential) = match self {
            Self::None => return (x, y),
            Self::BrownConrady { radial, tangential } => (even(radial, square), tangential),
            Self::Rational { radial, divisor, tangential } => {
                (even(radial, square) / even(divisor, square), tangential)
            }
            Self::Fisheye { radial } => {
                let radius = square.sqrt();
                let angle = radius.atan();
                let scale = if radius > 0.0 { angle * even(radial, angle * angle) / radius } else { 1.0 };
                return (x * scale, y * scale);
            }
        };
        let [p1, p2] = *tangential;
        (
            x * scale + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * scale + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// All numbers of the model, in no particular order.
    pub(super) fn coefficients(&self) -> Vec<f64> {
        match self {
            Self::None => Vec::new(),
            Self::BrownConrady { radial, tangential } => radial.iter().chain(tangential).copied().collect(),
            Self::Rational { radial, divisor, tangential } => {
                radial.iter().chain(divisor).chain(tangential).copied().collect()
            }
            Self::Fisheye { radial } => radial.to_vec(),
        }
    }
}

/// 1 + c1 s + c2 s^2 + ...
fn even(coefficients: &[f64], square: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| (sum + coefficient) * square) + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_known_by_the_names_that_drivers_write() {
        let five = [0.1, -0.2, 0.001, 0.002, 0.3];
        let brown = Distortion::BrownConrady { radial: [0.1, -0.2, 0.3], tangential: [0.001, 0.002] };
        assert_eq!(Distortion::named("plumb_bob", &five), Ok(brown));
        assert_eq!(Distortion::named("Plumb_Bob ", &five), Ok(brown));
        assert_eq!(Distortion::named("plumb_bob", &[0.0; 5]), Ok(Distortion::None));
        assert_eq!(Distortion::named("", &[]), Ok(Distortion::None));
        assert_eq!(Distortion::named("inverse_brown_conrady", &[0.0; 5]), Ok(Distortion::None));
        let eight = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let rational =
            Distortion::Rational { radial: [1.0, 2.0, 5.0], divisor: [6.0, 7.0, 8.0], tangential: [3.0, 4.0] };
        assert_eq!(Distortion::named("rational_polynomial", &eight), Ok(rational));
        let fourteen: Vec<f64> = eight.iter().copied().chain([0.0; 6]).collect();
        assert_eq!(Distortion::named("rational_polynomial", &fourteen), Ok(rational));
        assert_eq!(Distortion::named("equidistant", &[0.0; 4]), Ok(Distortion::Fisheye { radial: [0.0; 4] }));
    }

    #[test]
    fn what_is_not_known_is_named() {
        let message = |name: &str, numbers: &[f64]| Distortion::named(name, numbers).expect_err("unknown").to_string();
        assert!(message("inverse_brown_conrady", &[0.1; 5]).contains("inverse_brown_conrady"));
        assert!(message("plumb_bob", &[0.1; 3]).contains("3 coefficients"));
        assert!(message("equidistant", &[]).contains("0 coefficients"));
        assert!(message("plumb_bob", &[0.1, f64::NAN]).contains("coefficient 1"));
        assert!(message("rational_polynomial", &[0.1; 12]).contains("thin prism"));
    }
}
