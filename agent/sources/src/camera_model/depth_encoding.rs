//! What the numbers of a depth picture are, by the device that measured them: the length of a 1, which numbers say that
//! nothing was measured, and how near and how far it measures at all.
//!
//! The figures are those of the vendors' documentation; the range is the widest of a device's modes, so that nothing is dropped
//! that one of them can measure. A device may be set otherwise (`depth_units` of a RealSense, the precision level of an Orbbec):
//! what a recording says of its unit goes before this table.

use std::fmt;

/// What the numbers of a depth picture are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthEncoding {
    /// Name of the device or data set, as an option would have it.
    pub name: &'static str,
    /// Metres of a 1.
    pub metres_per_unit: f64,
    /// Whole numbers that say that nothing was measured. Numbers that are no length (NaN, infinite, negative) always do.
    pub invalid: &'static [u32],
    /// Nearest and farthest that is measured, metres; `None` where that is not known.
    pub range: Option<(f32, f32)>,
    /// What it is, for people.
    pub description: &'static str,
}

/// Depth cameras as they come.
///
/// | name | a 1 is | nothing measured | range |
/// |---|---|---|---|
/// | `d400` | 1 mm | 0 | 0.1 to 16 m |
/// | `d405` | 0.1 mm | 0 | 0.04 to 6.5 m |
/// | `l515` | 0.25 mm | 0 | 0.25 to 9 m |
/// | `azure-kinect` | 1 mm | 0 | 0.25 to 6 m |
/// | `kinect` | 1 mm | 0, 65535 | 0.4 to 10 m |
/// | `orbbec` | 1 mm | 0, 65535 | 0.15 to 10 m |
/// | `zivid` | 1 mm, floating point | NaN | 0.2 to 5 m |
/// | `ros-float` | 1 m, floating point | NaN, 0 | |
pub const DEPTH_CAMERAS: &[DepthEncoding] = &[
    DepthEncoding {
        name: "d400",
        metres_per_unit: 1e-3,
        invalid: &[0],
        range: Some((0.1, 16.0)),
        description: "RealSense D400 series (D415 to D457): 16 bits, 1 mm unless depth_units was set",
    },
    DepthEncoding {
        name: "d405",
        metres_per_unit: 1e-4,
        invalid: &[0],
        range: Some((0.04, 6.5)),
        description: "RealSense D405: 16 bits, 0.1 mm unless depth_units was set",
    },
    DepthEncoding {
        name: "l515",
        metres_per_unit: 2.5e-4,
        invalid: &[0],
        range: Some((0.25, 9.0)),
        description: "RealSense L515: 16 bits, 0.25 mm",
    },
    DepthEncoding {
        name: "azure-kinect",
        metres_per_unit: 1e-3,
        invalid: &[0],
        range: Some((0.25, 6.0)),
        description: "Microsoft Azure Kinect DK, Orbbec Femto Bolt and Mega: 16 bits, 1 mm",
    },
    DepthEncoding {
        name: "kinect",
        metres_per_unit: 1e-3,
        invalid: &[0, 65535],
        range: Some((0.4, 10.0)),
        description: "Microsoft Kinect v1, PrimeSense: 16 bits, 1 mm; 65535 is out of range",
    },
    DepthEncoding {
        name: "orbbec",
        metres_per_unit: 1e-3,
        invalid: &[0, 65535],
        range: Some((0.15, 10.0)),
        description: "Orbbec Astra and Gemini: 16 bits, 1 mm at the default precision level",
    },
    DepthEncoding {
        name: "zivid",
        metres_per_unit: 1e-3,
        invalid: &[],
        range: Some((0.2, 5.0)),
        description: "Zivid: floating point millimetres, NaN where nothing was measured",
    },
    DepthEncoding {
        name: "ros-float",
        metres_per_unit: 1.0,
        invalid: &[0],
        range: None,
        description: "32FC1 of ROS: floating point metres, NaN where nothing was measured",
    },
];

/// Other names of devices in the table: models, as people and recordings call them.
const MODELS: &[(&str, &str)] = &[
    ("d415", "d400"),
    ("d421", "d400"),
    ("d430", "d400"),
    ("d435", "d400"),
    ("d435f", "d400"),
    ("d435i", "d400"),
    ("d435if", "d400"),
    ("d455", "d400"),
    ("d455f", "d400"),
    ("d456", "d400"),
    ("d457", "d400"),
    ("k4a", "azure-kinect"),
    ("femto-bolt", "azure-kinect"),
    ("femto-mega", "azure-kinect"),
    ("astra", "orbbec"),
    ("gemini", "orbbec"),
];

impl DepthEncoding {
    /// The device of this name, or of the series that the model of this name belongs to.
    pub fn of_device(name: &str) -> Option<&'static Self> {
        let series =
            MODELS.iter().find(|(model, _)| model.eq_ignore_ascii_case(name)).map_or(name, |(_, series)| series);
        DEPTH_CAMERAS.iter().find(|encoding| encoding.name.eq_ignore_ascii_case(series))
    }

    /// The device that a camera's own name means, as `Intel RealSense D435I`: one of its words is the name of a model.
    pub(crate) fn of_product(product: &str) -> Option<&'static Self> {
        product.split_whitespace().find_map(Self::of_device)
    }

    /// The device that an option names.
    ///
    /// # Errors
    /// The devices that there are.
    pub(crate) fn of_option(name: &str) -> Result<&'static Self, String> {
        Self::of_device(name).ok_or_else(|| {
            let known: Vec<&str> = DEPTH_CAMERAS.iter().map(|encoding| encoding.name).collect();
            format!("device={name}: is no depth camera that is known; there are {} and their models", known.join(", "))
        })
    }

    /// Metres of a stored number; 0 where nothing was measured.
    pub fn metres(&self, stored: f64) -> f32 {
        let metres = (stored * self.metres_per_unit) as f32;
        let is_length = metres.is_finite() && metres > 0.0;
        if is_length && self.measures(stored, metres) { metres } else { 0.0 }
    }

    /// Whether the device measures the length `metres` and does not mean by the number `stored` that nothing was measured.
    pub fn measures(&self, stored: f64, metres: f32) -> bool {
        let is_mark = self.invalid.iter().any(|invalid| f64::from(*invalid) == stored);
        !is_mark && self.range.is_none_or(|(nearest, farthest)| (nearest..=farthest).contains(&metres))
    }

    /// Metres of a floating point 1: those of the device if it stores such numbers, else of ROS [REP 118].
    pub(crate) fn metres_per_float(&self) -> f64 {
        let stores_floats = self.invalid.is_empty() || self.metres_per_unit == 1.0;
        if stores_floats { self.metres_per_unit } else { 1.0 }
    }
}

impl fmt::Display for DepthEncoding {
    /// What is taken of the device, for records and error texts.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (", self.description)?;
        match self.range {
            Some((nearest, farthest)) => write!(f, "measures {nearest} to {farthest} m)"),
            None => write!(f, "range not known)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_invalid_values_are_those_of_the_device() {
        let of = |name: &str, stored: f64| DepthEncoding::of_device(name).expect("a device").metres(stored);
        assert_eq!([of("d400", 500.0), of("d400", 0.0)], [0.5, 0.0]);
        assert_eq!([of("L515", 2000.0), of("l515", 1001.0)], [0.5, 0.25025]);
        assert_eq!([of("zivid", 512.5), of("zivid", f64::NAN), of("zivid", -1.0)], [0.5125, 0.0, 0.0]);
        assert_eq!([of("D435i", 99.0), of("d435i", 100.0), of("d405", 5000.0)], [0.0, 0.1, 0.5], "beside its range");
        assert_eq!([of("orbbec", 65535.0), of("ros-float", 0.75), of("ros-float", f64::INFINITY)], [0.0, 0.75, 0.0]);
        assert!(DepthEncoding::of_device("none").is_none());
        assert_eq!(DepthEncoding::of_product("Intel RealSense D435I").map(|device| device.name), Some("d400"));
        let unknown = DepthEncoding::of_option("d999").expect_err("no device");
        assert!(unknown.contains("d999") && unknown.contains("azure-kinect"), "{unknown}");
        for (model, series) in MODELS {
            assert!(DEPTH_CAMERAS.iter().any(|encoding| encoding.name == *series), "{model}");
        }
        for (place, encoding) in DEPTH_CAMERAS.iter().enumerate() {
            assert!(DEPTH_CAMERAS.iter().skip(place + 1).all(|other| other.name != encoding.name), "{encoding:?}");
        }
    }
}
