//! Units: OBJ, STL, PLY and PCD do not name theirs, and many GLB files are not in the metres that they should be in. So it is
//! guessed from the size, and whoever guesses says so.

use crate::Geometry;
use crate::offset::common_offset;
use semascan_model::LengthUnit;

/// Parts are not this long, in metres.
const LONGEST: f64 = 5.0;
/// Longest edges, in metres, of parts that the virtual cell can look at.
const INSPECTED: (f64, f64) = (1e-3, 1.0);
/// Middles of models from here on are places on a map, in metres: no cell is 50 m long, and no map begins nearer.
const ON_A_MAP: f64 = 50_000.0;
/// Depth cameras do not see this far, in metres.
const FARTHEST: f64 = 30.0;

/// The unit of a part whose longest edge is `extent` of it: a part longer than 5 m is one in millimetres.
pub fn of_part(extent: f64) -> LengthUnit {
    if extent > LONGEST { LengthUnit::Millimetres } else { LengthUnit::Metres }
}

/// The unit of a depth camera's points that are `distance` of it away at the median: it is in millimetres past 30 m.
pub fn of_distance(distance: f64) -> LengthUnit {
    if distance > FARTHEST { LengthUnit::Millimetres } else { LengthUnit::Metres }
}

impl Geometry {
    /// The unit that its numbers are taken for where nobody says it: that of its file if it notes one, metres if it lies on
    /// a map, else as [`of_part`] says.
    pub fn assumed_unit(&self) -> LengthUnit {
        let on_a_map = || common_offset(&self.positions, 1.0).iter().any(|c| c.abs() > ON_A_MAP);
        match self.unit {
            Some(unit) => unit,
            None if on_a_map() => LengthUnit::Metres,
            None => of_part(self.extent()),
        }
    }
}

/// Whether a part whose longest edge is `extent` metres can be inspected: from 1 mm to 1 m.
pub fn is_inspected_size(extent: f64) -> bool {
    (INSPECTED.0..=INSPECTED.1).contains(&extent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_many_metres_is_one_in_millimetres() {
        assert_eq!([0.2, 5.0, 5.1].map(of_part), [LengthUnit::Metres, LengthUnit::Metres, LengthUnit::Millimetres]);
        assert_eq!(
            [0.4, 9.0, 300.0].map(of_distance),
            [LengthUnit::Metres, LengthUnit::Metres, LengthUnit::Millimetres]
        );
        assert_eq!([9e-4, 1e-3, 1.0, 1.1, f64::NAN].map(is_inspected_size), [false, true, true, false, false]);
    }

    #[test]
    fn a_site_on_a_map_is_in_metres() {
        let cloud = |offset: f64| Geometry {
            positions: [0.0, 20.0, 60.0].map(|x| [offset + x, 2.0 * offset, 0.0]).to_vec(),
            ..Geometry::default()
        };
        assert_eq!(cloud(500_000.0).assumed_unit(), LengthUnit::Metres);
        // A part in the millimetres of its cell.
        assert_eq!(cloud(2_000.0).assumed_unit(), LengthUnit::Millimetres);
        assert_eq!(Geometry { unit: Some(LengthUnit::Metres), ..cloud(0.0) }.assumed_unit(), LengthUnit::Metres);
    }
}
