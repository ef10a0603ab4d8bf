//! The measurements as a table of comma-separated values [RFC 4180]: a line each, figures with a decimal point, lengths in the
//! chosen unit, coordinates of the table frame in it, too.

use super::Measurement;
use semascan_model::LengthUnit;
use std::fmt::Write;

const HEAD: &str = "number,kind,value,unit,expanded_uncertainty_k2,along_x,along_y,along_z,length_unit,\
                    x1,y1,z1,x2,y2,z2,x3,y3,z3,direction_x,direction_y,direction_z,\
                    residual_rms,residual_largest,points_used,points_left_out,between,of_earlier_model";

/// The table, its lines ended as the standard has it.
pub fn csv(measurements: &[Measurement], unit: LengthUnit) -> String {
    let mut table = format!("{HEAD}\r\n");
    for measurement in measurements {
        let figure = |value: Option<f64>| value.map(|v| format!("{v:.6}")).unwrap_or_default();
        let length = |metres: Option<f64>| figure(metres.map(|v| v / unit.in_metres()));
        let one = measurement.dimension().one(unit);
        let estimate = measurement.estimate();
        let axes = measurement.along_axes();
        let along = (0..3).map(|k| length(axes.map(|axes| axes[k].value)));
        let coordinates =
            (0..9).map(|i| length(measurement.taken.get(i / 3).map(|taken| taken.feature.middle()[i % 3])));
        let fit = measurement.fit();
        let direction = (0..3).map(|k| figure(fit.and_then(|f| f.element.direction()).map(|d| d[k])));
        let count = |value: Option<usize>| value.map(|v| v.to_string()).unwrap_or_default();
        let between: Vec<String> = measurement.taken.iter().filter_map(|t| t.of).map(|n| n.to_string()).collect();
        // Writing to a string does not fail.
        let _ = write!(
            table,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\r\n",
            measurement.number,
            measurement.kind.key(),
            figure(estimate.map(|e| e.value / one)),
            measurement.dimension().name(unit),
            figure(estimate.map(|e| e.expanded() / one)),
            along.collect::<Vec<_>>().join(","),
            unit.name(),
            coordinates.collect::<Vec<_>>().join(","),
            direction.collect::<Vec<_>>().join(","),
            length(fit.map(|f| f.rms)),
            length(fit.map(|f| f.largest)),
            count(fit.map(|f| f.used)),
            count(fit.map(|f| f.left_out)),
            between.join(" "),
            if measurement.outdated { "yes" } else { "no" },
        );
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::Kind;
    use super::super::measurement::tests::{cylinder, measured, measurement};
    use super::*;

    #[test]
    fn every_line_has_a_field_for_every_column() {
        let list = [
            measurement(1, Kind::Distance, &[[0.0; 3], [0.0254, 0.0, 0.0]]),
            measurement(4, Kind::Angle, &[[0.1, 0.0, 0.0], [0.0; 3], [0.0, 0.1, 0.0]]),
            measurement(5, Kind::Angle, &[[0.0; 3], [0.0; 3], [0.0; 3]]),
            measured(6, Kind::Cylinder, vec![cylinder(0.0254, None)]),
            measured(7, Kind::Distance, vec![cylinder(0.0, Some(6)), cylinder(0.0508, Some(2))]),
        ];
        let table = csv(&list, LengthUnit::Inches);
        let lines: Vec<Vec<&str>> = table.trim_end().split("\r\n").map(|line| line.split(',').collect()).collect();
        assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{table}");
        let field = |line: usize, name: &str| lines[line][lines[0].iter().position(|n| *n == name).expect("a column")];
        assert_eq!((field(1, "value"), field(1, "unit"), field(1, "along_x")), ("1.000000", "inch", "1.000000"));
        assert_eq!((field(1, "x2"), field(1, "x3"), field(1, "expanded_uncertainty_k2")), ("1.000000", "", "0.045004"));
        assert_eq!((field(2, "value"), field(2, "unit"), field(2, "along_x")), ("90.000000", "deg", ""));
        assert_eq!((field(2, "number"), field(3, "value"), field(3, "of_earlier_model")), ("4", "", "no"));
        assert_eq!((field(4, "x1"), field(4, "direction_z"), field(4, "points_used")), ("1.000000", "1.000000", "812"));
        assert_eq!((field(4, "value"), field(4, "residual_rms")), ("0.472441", "0.001969"));
        assert_eq!((field(5, "value"), field(5, "between"), field(5, "residual_rms")), ("2.000000", "6 2", ""));
    }
}
