//! Units of length: what a number in a file, on the command line or in a configuration stands for. Everything inside is
//! in metres.

use serde::{Deserialize, Serialize};

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum LengthUnit {
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetres,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetres,
    /// Metres.
    #[serde(rename = "m")]
    Metres,
    /// Inches of 25.4 mm.
    #[serde(rename = "inch")]
    Inches,
}

impl LengthUnit {
    /// Every unit.
    pub const ALL: [Self; 4] = [Self::Millimetres, Self::Centimetres, Self::Metres, Self::Inches];

    /// The unit called `mm`, `cm`, `m` or `inch`.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetres => "mm",
            Self::Centimetres => "cm",
            Self::Metres => "m",
            Self::Inches => "inch",
        }
    }

    /// One of it in metres.
    pub fn in_metres(self) -> f64 {
        match self {
            Self::Millimetres => 1e-3,
            Self::Centimetres => 1e-2,
            Self::Metres => 1.0,
            Self::Inches => 25.4e-3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_has_one_name_everywhere() {
        for unit in LengthUnit::ALL {
            assert_eq!(LengthUnit::parse(unit.name()), Some(unit));
            let text = serde_json::to_string(&unit).expect("plain data");
            assert_eq!(text, format!("{:?}", unit.name()));
            assert_eq!(serde_json::from_str::<LengthUnit>(&text).expect("its own"), unit);
        }
        assert_eq!(LengthUnit::parse("metre"), None);
        assert_eq!(LengthUnit::ALL.map(LengthUnit::in_metres), [0.001, 0.01, 1.0, 0.0254]);
    }
}
