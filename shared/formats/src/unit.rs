//! Units: OBJ, STL and PLY do not name theirs, so it is guessed from the size, or a size that no part has is refused.

/// Parts are not this long, in metres.
const LONGEST: f64 = 5.0;
/// Longest edges, in metres, of parts that the virtual cell can look at.
const INSPECTED: (f64, f64) = (1e-3, 1.0);

/// What a file's numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metres,
    /// Millimetres.
    Millimetres,
}

impl Unit {
    /// The unit of a part whose longest edge is `extent` of it: a part longer than 5 m is one in millimetres.
    pub fn guess(extent: f64) -> Self {
        if extent > LONGEST { Self::Millimetres } else { Self::Metres }
    }

    /// One of it in metres.
    pub fn in_metres(self) -> f64 {
        match self {
            Self::Metres => 1.0,
            Self::Millimetres => 1e-3,
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
        assert_eq!([0.2, 5.0, 5.1].map(Unit::guess), [Unit::Metres, Unit::Metres, Unit::Millimetres]);
        assert_eq!([9e-4, 1e-3, 1.0, 1.1, f64::NAN].map(is_inspected_size), [false, true, true, false, false]);
    }
}
