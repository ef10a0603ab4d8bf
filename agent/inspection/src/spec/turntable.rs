//! Whether a recording is of a turntable before a fixed camera, and what is known of it.

use nalgebra::{Point3, Unit, Vector3};
use semascan_perception::register::turntable::{Axis, TurntableConfig};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A turntable before a fixed camera, as text: `auto`, `none`, `estimate`, or what is known: `step=DEG` and
/// `axis=X,Y,Z,NX,NY,NZ`, with a comma between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum TurntableSpec {
    /// A recording whose views have no poses and a background that stands still is taken for one; one with poses only has
    /// its background left out.
    #[default]
    Auto,
    /// It is none.
    None,
    /// It is one.
    Known {
        /// A point of the axis and its direction, in the camera's frame, metres; estimated if absent.
        axis: Option<[f64; 6]>,
        /// Degrees between two views; estimated if absent.
        step: Option<f64>,
    },
}

impl TurntableSpec {
    /// What is known of the turntable.
    pub(crate) fn config(&self) -> TurntableConfig {
        let Self::Known { axis, step } = self else { return TurntableConfig::default() };
        let axis = axis.map(|[x, y, z, nx, ny, nz]| Axis {
            point: Point3::new(x, y, z),
            direction: Unit::new_normalize(Vector3::new(nx, ny, nz)),
        });
        TurntableConfig { axis, step: step.map(f64::to_radians) }
    }
}

impl FromStr for TurntableSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "auto" => return Ok(Self::Auto),
            "none" => return Ok(Self::None),
            "estimate" => return Ok(Self::Known { axis: None, step: None }),
            _ => {}
        }
        let wrong = || format!("{text}: auto, none, estimate, step=DEG or axis=X,Y,Z,NX,NY,NZ are expected");
        let (mut axis, mut steps): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut in_axis = None;
        for word in text.split(',') {
            let number = match word.trim().split_once('=') {
                Some(("step", number)) => {
                    in_axis = Some(false);
                    number
                }
                Some(("axis", number)) => {
                    in_axis = Some(true);
                    number
                }
                Some(_) => return Err(wrong()),
                None => word.trim(),
            };
            let number: f64 = number.parse().map_err(|_| wrong())?;
            match in_axis {
                Some(true) => axis.push(number),
                Some(false) => steps.push(number),
                None => return Err(wrong()),
            }
        }
        let step = match steps.as_slice() {
            [] => None,
            [step] if step.is_finite() && *step != 0.0 && step.abs() <= 180.0 => Some(*step),
            _ => return Err(format!("{text}: the step is one number of degrees up to 180, and not 0")),
        };
        let axis = match <[f64; 6]>::try_from(axis) {
            Ok(axis) => {
                let length = Vector3::new(axis[3], axis[4], axis[5]).norm();
                if !axis.iter().all(|c| c.is_finite()) || length < 1e-6 {
                    return Err(format!("{text}: the axis is a point and a direction in the camera's frame"));
                }
                Some(axis)
            }
            Err(numbers) if numbers.is_empty() => None,
            Err(numbers) => return Err(format!("{text}: the axis has {} numbers in place of 6", numbers.len())),
        };
        Ok(Self::Known { axis, step })
    }
}

impl fmt::Display for TurntableSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |[x, y, z, nx, ny, nz]: [f64; 6]| format!("axis={x},{y},{z},{nx},{ny},{nz}");
        match *self {
            Self::Auto => f.write_str("auto"),
            Self::None => f.write_str("none"),
            Self::Known { axis: None, step: None } => f.write_str("estimate"),
            Self::Known { axis: None, step: Some(step) } => write!(f, "step={step}"),
            Self::Known { axis: Some(a), step: None } => f.write_str(&axis(a)),
            Self::Known { axis: Some(a), step: Some(step) } => write!(f, "{},step={step}", axis(a)),
        }
    }
}

impl TryFrom<String> for TurntableSpec {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<TurntableSpec> for String {
    fn from(spec: TurntableSpec) -> Self {
        spec.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_read_and_written() {
        for text in ["auto", "none", "estimate", "step=15", "step=-7.5", "axis=0,0.1,0.6,0,-0.7,-0.7,step=15"] {
            let spec: TurntableSpec = text.parse().expect(text);
            assert_eq!(spec.to_string(), text);
        }
        let known: TurntableSpec = "step=15,axis=0,0.1,0.6,0,-2,0".parse().expect("in any order");
        let config = known.config();
        assert!((config.step.expect("said") - 15_f64.to_radians()).abs() < 1e-12);
        assert_eq!(config.axis.expect("said").direction.into_inner(), -Vector3::y());
        for wrong in ["", "yes", "15", "step=", "step=0", "step=nan", "step=1,2", "step=500", "axis=1,2", "turn=3"] {
            assert!(wrong.parse::<TurntableSpec>().is_err(), "{wrong}");
        }
        assert!("axis=0,0,1,0,0,0".parse::<TurntableSpec>().is_err(), "no direction");
    }
}
