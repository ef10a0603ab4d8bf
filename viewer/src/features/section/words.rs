//! What the panel, the drawings and a screen reader say of a section.

use super::{Direction, Reading, Section};
use crate::features::mesh::Mesh;
use crate::state::units;
use crate::words::{decimal, t};
use semascan_model::LengthUnit;

/// Minus is a sign, not a hyphen.
const MINUS: &str = "\u{2212}";

/// A length in the unit that people read: hundredths of a millimetre, or as fine in inches.
pub fn length(metres: f64, unit: LengthUnit) -> String {
    let decimals = if unit == LengthUnit::Inches { 4 } else { 2 };
    format!("{}\u{a0}{}", decimal(metres / unit.in_metres(), decimals), units::unit_name(unit))
}

/// An area in it.
pub fn area(square_metres: f64, unit: LengthUnit) -> String {
    let value = square_metres / unit.in_metres().powi(2);
    let decimals = if unit == LengthUnit::Inches { 3 } else { 1 };
    format!("{}\u{a0}{}²", decimal(value, decimals), units::unit_name(unit))
}

/// Where the plane lies, in millimetres and English: for files.
pub fn plane_name(section: &Section) -> String {
    let offset = format!("{:.2}\u{a0}mm", section.offset * 1e3).replace('-', MINUS);
    match section.direction {
        Direction::X | Direction::Y | Direction::Z => format!("{} = {offset}", section.direction.key()),
        Direction::Camera { .. } => format!("{offset} from the middle, facing the camera"),
        Direction::Surface { .. } => format!("{offset} from the picked point along its normal"),
    }
}

/// What was cut.
///
/// * `mesh`: how the meshing stands.
/// * `hides`: whether components are hidden.
pub fn summary(section: &Section, mesh: &Mesh, hides: bool) -> String {
    if !section.is_on {
        return String::new();
    }
    let Some(shown) = &section.shown else {
        return match mesh.is_running() {
            true => t!("mesh.being_made"),
            false => t!("section.needs_mesh"),
        }
        .into();
    };
    let mut text = match (shown.closed, shown.open, shown.section.outlines.len()) {
        (_, _, 0) => t!("section.meets_nothing").to_owned(),
        (closed, 0, all) if closed == all => t!("section.closed", count = closed),
        (closed, open, all) => {
            let by_box = all - closed - open;
            match by_box {
                0 => t!("section.outlines", closed, open),
                by_box => t!("section.outlines.box", closed, open, by_box),
            }
        }
    };
    if shown.open > 0 {
        text.push_str(t!("section.open_ends"));
    }
    if hides {
        text.push_str(t!("section.hidden"));
    }
    if mesh.outdated {
        text.push_str(t!("section.outdated"));
    }
    text
}

/// What to do while thicknesses are read.
pub fn prompt(section: &Section) -> &'static str {
    match (section.reads(), section.first.is_some()) {
        (false, _) => "",
        (true, true) => t!("section.prompt.second"),
        (true, false) if section.missed => t!("section.prompt.missed"),
        (true, false) => t!("section.prompt"),
    }
}

/// A reading with its expanded uncertainty (k = 2).
pub fn reading(reading: &Reading, unit: LengthUnit) -> String {
    let estimate = reading.estimate();
    let decimals = if unit == LengthUnit::Inches { 3 } else { 2 };
    let [value, uncertainty] = [estimate.value, estimate.expanded()].map(|v| v / unit.in_metres());
    format!("{} ± {}\u{a0}{}", decimal(value, decimals), decimal(uncertainty, decimals), units::unit_name(unit))
}

/// A length as a field for numbers has it: without unit, and no longer than needed.
pub fn number(metres: f64, unit: LengthUnit) -> String {
    let scale = if unit == LengthUnit::Inches { 1e5 } else { 1e3 };
    // Not minus nothing.
    let value = (metres / unit.in_metres() * scale).round() / scale + 0.0;
    value.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_in_the_unit_of_the_page() {
        assert_eq!(length(-0.0254, LengthUnit::Millimetres), "\u{2212}25.40\u{a0}mm");
        assert_eq!(length(0.0254, LengthUnit::Inches), "1.0000\u{a0}inch");
        assert_eq!(area(6.4516e-4, LengthUnit::Millimetres), "645.2\u{a0}mm²");
        assert_eq!(area(6.4516e-4, LengthUnit::Inches), "1.000\u{a0}inch²");
        assert_eq!(
            (number(0.0123456, LengthUnit::Millimetres), number(-1e-9, LengthUnit::Inches)),
            ("12.346".into(), "0".into())
        );
    }

    #[test]
    fn the_plane_is_named_by_what_it_lies_across() {
        let mut section = Section::default();
        (section.offset, section.is_on) = (0.012, true);
        assert_eq!(plane_name(&section), "z = 12.00\u{a0}mm");
        section.direction = Direction::Camera { normal: [1.0, 0.0, 0.0], through: [0.0; 3] };
        assert!(plane_name(&section).contains("facing the camera"));
    }
}
