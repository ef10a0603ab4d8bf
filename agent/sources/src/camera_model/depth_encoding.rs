//! What the numbers of a depth picture are, by the device that measured them: the length of a 1, and which numbers say that
//! nothing was measured.
//!
//! The figures are those of the vendors' documentation. A device may be set otherwise (`depth_units` of a RealSense, the
//! precision level of an Orbbec): what a recording says of itself goes before this table.

/// What the numbers of a depth picture are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthEncoding {
    /// Name of the device or data set, as an option would have it.
    pub name: &'static str,
    /// Metres of a 1.
    pub metres_per_unit: f64,
    /// Whole numbers that say that nothing was measured. Numbers that are no length (NaN, infinite, negative) always do.
    pub invalid: &'static [u32],
    /// What it is, for people.
    pub description: &'static str,
}

/// Depth cameras as they come.
///
/// | name | a 1 is | nothing measured |
/// |---|---|---|
/// | `d400` | 1 mm | 0 |
/// | `l515` | 0.25 mm | 0 |
/// | `azure-kinect` | 1 mm | 0 |
/// | `kinect` | 1 mm | 0, 65535 |
/// | `orbbec` | 1 mm | 0, 65535 |
/// | `zivid` | 1 mm, floating point | NaN |
/// | `ros-float` | 1 m, floating point | NaN, 0 |
pub const DEPTH_CAMERAS: &[DepthEncoding] = &[
    DepthEncoding {
        name: "d400",
        metres_per_unit: 1e-3,
        invalid: &[0],
        description: "Intel RealSense D400 series (D405 to D457): 16 bits, 1 mm unless depth_units was set",
    },
    DepthEncoding {
        name: "l515",
        metres_per_unit: 2.5e-4,
        invalid: &[0],
        description: "Intel RealSense L515: 16 bits, 0.25 mm",
    },
    DepthEncoding {
        name: "azure-kinect",
        metres_per_unit: 1e-3,
        invalid: &[0],
        description: "Microsoft Azure Kinect DK, Orbbec Femto Bolt and Mega: 16 bits, 1 mm",
    },
    DepthEncoding {
        name: "kinect",
        metres_per_unit: 1e-3,
        invalid: &[0, 65535],
        description: "Microsoft Kinect v1, PrimeSense: 16 bits, 1 mm; 65535 is out of range",
    },
    DepthEncoding {
        name: "orbbec",
        metres_per_unit: 1e-3,
        invalid: &[0, 65535],
        description: "Orbbec Astra and Gemini: 16 bits, 1 mm at the default precision level",
    },
    DepthEncoding {
        name: "zivid",
        metres_per_unit: 1e-3,
        invalid: &[],
        description: "Zivid: floating point millimetres, NaN where nothing was measured",
    },
    DepthEncoding {
        name: "ros-float",
        metres_per_unit: 1.0,
        invalid: &[0],
        description: "32FC1 of ROS: floating point metres, NaN where nothing was measured",
    },
];

impl DepthEncoding {
    /// The device of this name.
    pub fn of_device(name: &str) -> Option<&'static Self> {
        DEPTH_CAMERAS.iter().find(|encoding| encoding.name.eq_ignore_ascii_case(name))
    }

    /// Metres of a stored number; 0 where nothing was measured.
    pub fn metres(&self, stored: f64) -> f32 {
        if self.invalid.iter().any(|invalid| f64::from(*invalid) == stored) {
            return 0.0;
        }
        let metres = (stored * self.metres_per_unit) as f32;
        if metres.is_finite() && metres > 0.0 { metres } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_invalid_values_are_those_of_the_device() {
        let of = |name: &str, stored: f64| DepthEncoding::of_device(name).expect("a device").metres(stored);
        assert_eq!([of("d400", 500.0), of("d400", 0.0)], [0.5, 0.0]);
        assert_eq!([of("L515", 2000.0), of("l515", 1.0)], [0.5, 0.00025]);
        assert_eq!([of("zivid", 512.5), of("zivid", f64::NAN), of("zivid", -1.0)], [0.5125, 0.0, 0.0]);
        assert_eq!([of("orbbec", 65535.0), of("ros-float", 0.75), of("ros-float", f64::INFINITY)], [0.0, 0.75, 0.0]);
        assert!(DepthEncoding::of_device("none").is_none());
        for (place, encoding) in DEPTH_CAMERAS.iter().enumerate() {
            assert!(DEPTH_CAMERAS.iter().skip(place + 1).all(|other| other.name != encoding.name), "{encoding:?}");
        }
    }
}
