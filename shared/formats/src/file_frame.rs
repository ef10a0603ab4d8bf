//! Unit and upward axis of files whose format names neither: OBJ and STL.
//!
//! CAD programs and slicers take their numbers for millimetres with z up, so that is the default; programs for pictures
//! and games expect y up.

use semascan_model::LengthUnit;

/// The axis of a file that points upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// As in the table frame.
    #[default]
    Z,
    /// As in glTF: table y points away from the viewer, to -z.
    Y,
}

/// In which unit, and with which axis upwards, a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileFrame {
    /// What the file's numbers are.
    pub unit: LengthUnit,
    /// Its upward axis.
    pub up: UpAxis,
}

impl Default for FileFrame {
    fn default() -> Self {
        Self { unit: LengthUnit::Millimetres, up: UpAxis::Z }
    }
}

impl FileFrame {
    /// Metres with z up: the table frame as it is.
    pub const TABLE: Self = Self { unit: LengthUnit::Metres, up: UpAxis::Z };

    /// A place in the table frame, metres, as the file has it.
    pub fn position(self, table: [f64; 3]) -> [f64; 3] {
        let metre = self.unit.in_metres();
        self.turned(table).map(|c| c / metre)
    }

    /// A direction in the table frame as the file has it.
    pub fn direction(self, table: [f32; 3]) -> [f32; 3] {
        self.turned(table)
    }

    fn turned<T: Copy + std::ops::Neg<Output = T>>(self, [x, y, z]: [T; 3]) -> [T; 3] {
        match self.up {
            UpAxis::Z => [x, y, z],
            UpAxis::Y => [x, z, -y],
        }
    }

    /// `mm, z up`, for headers and messages.
    pub fn name(self) -> String {
        let up = match self.up {
            UpAxis::Z => "z up",
            UpAxis::Y => "y up",
        };
        format!("{}, {up}", self.unit.name())
    }
}

/// The unit that the text of a header names as [`FileFrame::name`] does, after the word `semascan`.
pub(crate) fn noted_unit(header: &str) -> Option<LengthUnit> {
    let (_, rest) = header.split_once("semascan")?;
    let (_, rest) = rest.split_once("unit ")?;
    LengthUnit::parse(rest.split(',').next()?.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_scaled_and_turned() {
        assert_eq!(FileFrame::default().position([0.001, 0.5, -0.25]), [1.0, 500.0, -250.0]);
        let inches = FileFrame { unit: LengthUnit::Inches, up: UpAxis::Y }.position([0.0254, 0.0508, 0.0762]);
        assert!([1.0, 3.0, -2.0].into_iter().zip(inches).all(|(a, b)| f64::abs(a - b) < 1e-12), "{inches:?}");
        assert_eq!(FileFrame { up: UpAxis::Y, ..FileFrame::TABLE }.direction([0.0, 0.0, 1.0]), [0.0, 1.0, -0.0]);
        assert_eq!(FileFrame::TABLE.position([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn what_a_header_notes_is_read_back() {
        for unit in LengthUnit::ALL {
            let frame = FileFrame { unit, up: UpAxis::Y };
            assert_eq!(noted_unit(&format!("# semascan 0.1.0: unit {}", frame.name())), Some(unit));
        }
        for other in ["# Blender unit mm, z up", "semascan 0.1.0", "semascan: unit furlong, z up"] {
            assert_eq!(noted_unit(other), None, "{other}");
        }
    }
}
