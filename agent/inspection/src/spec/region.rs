//! The region of interest: which of a view's pixels are inspected at all.

use super::SpecError;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Voxels that a pixel's footprint may be wide: beyond it a surface is a few stray voxels, which cost memory and mislead the
/// registration.
const FOOTPRINT_VOXELS: f64 = 4.0;

/// The corners of a box in metres, the smaller coordinates first.
pub type Corners = (Point3<f64>, Point3<f64>);

/// The region of interest; by default everything that the sensor can measure at the wanted voxel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegionSpec {
    /// Depths along the optical axis in metres: `0.2..1.5`, `..1.5` or `0.2..`.
    pub depth: Option<DepthRange>,
    /// A box in the table frame: x0, y0, z0, x1, y1, z1 in metres. Views need a pose.
    #[serde(rename = "box")]
    pub bounds: Option<[f64; 6]>,
    /// Only pixels that carry a component label.
    pub labelled: bool,
    /// Voxels that the footprint of a pixel may be wide; 4 if absent, `inf` for no limit.
    pub footprint_voxels: Option<f64>,
}

/// Depths along the optical axis, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct DepthRange {
    /// The nearest.
    pub min: f64,
    /// The farthest; infinite for no limit.
    pub max: f64,
}

impl RegionSpec {
    /// The box's corners, the smaller coordinates first.
    ///
    /// # Errors
    /// [`SpecError`] if it has no inside.
    pub fn corners(&self) -> Result<Option<Corners>, SpecError> {
        let Some([x0, y0, z0, x1, y1, z1]) = self.bounds else { return Ok(None) };
        let (low, high) = (Point3::new(x0, y0, z0), Point3::new(x1, y1, z1));
        if (0..3).all(|axis| low[axis] < high[axis]) {
            return Ok(Some((low, high)));
        }
        let reason = format!("{x0},{y0},{z0},{x1},{y1},{z1}: the second corner must be beyond the first on every axis");
        Err(SpecError { field: "box".into(), reason })
    }

    /// Voxels that the footprint of a pixel may be wide.
    ///
    /// # Errors
    /// [`SpecError`] if that is no positive number.
    pub fn footprint(&self) -> Result<f64, SpecError> {
        let voxels = self.footprint_voxels.unwrap_or(FOOTPRINT_VOXELS);
        if voxels > 0.0 {
            return Ok(voxels);
        }
        Err(SpecError { field: "region.footprint_voxels".into(), reason: format!("{voxels} is not positive") })
    }
}

impl FromStr for DepthRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (min, max) = text.split_once("..").ok_or_else(|| format!("{text}: two depths in metres, as 0.2..1.5"))?;
        let metres = |text: &str, open: f64| match text.trim() {
            "" => Ok(open),
            text => text.parse::<f64>().map_err(|_| format!("{text} is no depth in metres")),
        };
        let range = Self { min: metres(min, 0.0)?, max: metres(max, f64::INFINITY)? };
        if range.min >= 0.0 && range.min < range.max {
            Ok(range)
        } else {
            Err(format!("{text}: the first depth must be the smaller, and not negative"))
        }
    }
}

impl fmt::Display for DepthRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.max.is_finite() {
            true => write!(f, "{}..{}", self.min, self.max),
            false => write!(f, "{}..", self.min),
        }
    }
}

impl TryFrom<String> for DepthRange {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<DepthRange> for String {
    fn from(range: DepthRange) -> Self {
        range.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_written() {
        for (text, min, max) in [("0.2..1.5", 0.2, 1.5), ("..2", 0.0, 2.0), ("0.3..", 0.3, f64::INFINITY)] {
            let range: DepthRange = text.parse().expect(text);
            assert_eq!(range, DepthRange { min, max });
            assert_eq!(range.to_string().parse(), Ok(range));
        }
        for wrong in ["1.5", "2..1", "-1..2", "a..2", "1..nan", ".."] {
            assert_eq!(wrong.parse::<DepthRange>().is_err(), wrong != "..", "{wrong}");
        }
    }

    #[test]
    fn a_box_without_an_inside_is_refused() {
        let region = |bounds| RegionSpec { bounds: Some(bounds), ..RegionSpec::default() };
        assert!(region([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]).corners().is_ok_and(|c| c.is_some()));
        assert!(region([0.0, 0.0, 0.0, 1.0, 1.0, 0.0]).corners().is_err_and(|e| e.field == "box"));
        assert!(region([f64::NAN; 6]).corners().is_err());
        let footprint = |voxels| RegionSpec { footprint_voxels: Some(voxels), ..RegionSpec::default() }.footprint();
        assert!(footprint(f64::INFINITY).is_ok() && footprint(0.0).is_err() && footprint(f64::NAN).is_err());
    }
}
