//! Boards that calibrations are made with, as people describe them. The frame of a board: the origin at the outer corner of its
//! first square, x along its rows, y down its columns, so that z points into the board as seen from before it.

use serde::Deserialize;

/// Fewest squares along an edge, and the most: nobody prints more.
const SIZES: std::ops::RangeInclusive<u32> = 2..=200;

/// A flat board.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum Board {
    /// A chessboard with markers in its white squares, as OpenCV prints it since 4.6: the first square is black.
    ///
    /// The markers may be ArUco's or AprilTags.
    Charuco {
        /// Squares along a row.
        columns: u32,
        /// Rows of squares.
        rows: u32,
        /// Edge of a square, millimetres.
        square_mm: f64,
        /// Edge of a marker with its black border, millimetres.
        marker_mm: f64,
        /// The markers' dictionary, by OpenCV's name, such as `DICT_4X4_50` or `DICT_APRILTAG_36h11`.
        dictionary: String,
    },
    /// A chessboard; the first square is black. It must look different when it is turned by half, so one of its sizes is odd and the other is even.
    Chessboard {
        /// Squares along a row.
        columns: u32,
        /// Rows of squares.
        rows: u32,
        /// Edge of a square, millimetres.
        square_mm: f64,
    },
}

impl Board {
    /// Whether numbers describe a board.
    ///
    /// # Errors
    /// The field's name and what is wrong with it.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        let (columns, rows) = self.sizes();
        for (field, size) in [("columns", columns), ("rows", rows)] {
            if !SIZES.contains(&size) {
                return Err((field, format!("is {size}: boards have {} to {}", SIZES.start(), SIZES.end())));
            }
        }
        let length = |field, length: f64| match length.is_finite() && length > 0.0 {
            true => Ok(()),
            false => Err((field, format!("is {length}: a length is positive"))),
        };
        match self {
            Self::Charuco { square_mm, marker_mm, .. } => {
                length("square_mm", *square_mm)?;
                length("marker_mm", *marker_mm)?;
                if marker_mm >= square_mm {
                    return Err(("marker_mm", format!("is {marker_mm}: markers are smaller than squares")));
                }
            }
            Self::Chessboard { square_mm, .. } => {
                length("square_mm", *square_mm)?;
                if (columns + rows) % 2 == 0 {
                    let reason = format!(
                        "{columns} x {rows} squares look the same when the board is turned by half: one size must be odd and the other even"
                    );
                    return Err(("rows", reason));
                }
            }
        }
        Ok(())
    }

    /// Squares along a row, and rows.
    pub fn sizes(&self) -> (u32, u32) {
        match self {
            Self::Charuco { columns, rows, .. } | Self::Chessboard { columns, rows, .. } => (*columns, *rows),
        }
    }

    /// Edge of a square, millimetres.
    pub fn square_mm(&self) -> f64 {
        match self {
            Self::Charuco { square_mm, .. } | Self::Chessboard { square_mm, .. } => *square_mm,
        }
    }

    /// Width and height of what is printed, millimetres.
    pub fn extent_mm(&self) -> [f64; 2] {
        let (columns, rows) = self.sizes();
        [columns, rows].map(|count| f64::from(count) * self.square_mm())
    }

    /// All corners that a detector can find, millimetres: those inside of the board, row by row.
    pub fn corners_mm(&self) -> Vec<[f64; 2]> {
        let ((columns, rows), square) = (self.sizes(), self.square_mm());
        let place = |k: u32| f64::from(k) * square;
        (1..rows).flat_map(|row| (1..columns).map(move |column| [place(column), place(row)])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(json: &str) -> Board {
        serde_json::from_str(json).expect("a board")
    }

    #[test]
    fn corners_are_where_they_are_printed() {
        let charuco = board(
            r#"{"type":"charuco","columns":4,"rows":3,"square_mm":20,"marker_mm":15,"dictionary":"DICT_4X4_50"}"#,
        );
        assert_eq!(charuco.check(), Ok(()));
        assert_eq!(charuco.extent_mm(), [80.0, 60.0]);
        let corners = charuco.corners_mm();
        assert_eq!((corners.len(), corners[0], corners[5]), (6, [20.0, 20.0], [60.0, 40.0]));
    }

    #[test]
    fn what_is_no_board_is_named() {
        let fault = |json: &str| board(json).check().expect_err("no board");
        assert_eq!(fault(r#"{"type":"chessboard","columns":8,"rows":6,"square_mm":20}"#).0, "rows");
        assert_eq!(fault(r#"{"type":"chessboard","columns":1,"rows":6,"square_mm":20}"#).0, "columns");
        assert_eq!(fault(r#"{"type":"chessboard","columns":9,"rows":6,"square_mm":0}"#).0, "square_mm");
        let large = r#"{"type":"charuco","columns":4,"rows":3,"square_mm":20,"marker_mm":20,"dictionary":"x"}"#;
        assert_eq!(fault(large).0, "marker_mm");
    }
}
