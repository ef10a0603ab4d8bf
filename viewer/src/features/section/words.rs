//! What the panel, the drawings and a screen reader say of a section.

use super::{Direction, Reading, Section};
use crate::features::mesh::Mesh;
use semascan_model::LengthUnit;

/// Minus is a sign, not a hyphen.
const MINUS: &str = "\u{2212}";

/// A length in the unit that people read: hundredths of a millimetre, or as fine in inches.
pub fn length(metres: f64, unit: LengthUnit) -> String {
    let decimals = if unit == LengthUnit::Inches { 4 } else { 2 };
    format!("{:.decimals$}\u{a0}{}", metres / unit.in_metres(), unit.name()).replace('-', MINUS)
}

/// An area in it.
pub fn area(square_metres: f64, unit: LengthUnit) -> String {
    let value = square_metres / unit.in_metres().powi(2);
    let decimals = if unit == LengthUnit::Inches { 3 } else { 1 };
    format!("{value:.decimals$}\u{a0}{}²", unit.name())
}

/// Where the plane lies.
pub fn plane_name(section: &Section, unit: LengthUnit) -> String {
    let offset = length(section.offset, unit);
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
            true => "The mesh is being made.",
            false => "Outlines need the surface as a mesh.",
        }
        .into();
    };
    let mut text = match (shown.closed, shown.open, shown.section.outlines.len()) {
        (_, _, 0) => "The plane meets no surface.".to_owned(),
        (1, 0, 1) => "One closed outline.".to_owned(),
        (closed, 0, all) if closed == all => format!("{closed} closed outlines."),
        (closed, open, all) => {
            let by_box = all - closed - open;
            let of_box = if by_box > 0 { format!(", {by_box} ended by the box") } else { String::new() };
            format!("{closed} closed, {open} open{of_box}.")
        }
    };
    if shown.open > 0 {
        text.push_str(" Open ends, marked by squares, are where the surface was not seen: nothing is filled there.");
    }
    if hides {
        text.push_str(" Hidden components are left out: where they were, outlines are open.");
    }
    if mesh.outdated {
        text.push_str(" It is of an earlier model: update the surface.");
    }
    text
}

/// What to do while thicknesses are read.
pub fn prompt(section: &Section) -> &'static str {
    match (section.reads(), section.first.is_some()) {
        (false, _) => "",
        (true, true) => "Click another place on an outline.",
        (true, false) if section.missed => "No line lies across from there. Click between two lines, or on one.",
        (true, false) => "Click between two lines for the thickness there, or on an outline for a distance.",
    }
}

/// A reading with its expanded uncertainty (k = 2).
pub fn reading(reading: &Reading, unit: LengthUnit) -> String {
    let estimate = reading.estimate();
    let decimals = if unit == LengthUnit::Inches { 3 } else { 2 };
    let [value, uncertainty] = [estimate.value, estimate.expanded()].map(|v| v / unit.in_metres());
    format!("{value:.decimals$} ± {uncertainty:.decimals$}\u{a0}{}", unit.name())
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
        assert_eq!(plane_name(&section, LengthUnit::Millimetres), "z = 12.00\u{a0}mm");
        section.direction = Direction::Camera { normal: [1.0, 0.0, 0.0], through: [0.0; 3] };
        assert!(plane_name(&section, LengthUnit::Millimetres).contains("facing the camera"));
    }
}
