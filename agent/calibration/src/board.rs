//! Boards that calibrations are made with, as people describe them. The frame of a board: the origin at the outer corner of its
//! first square (or tag), x along its rows, y down its columns, so that z points into the board as seen from before it.

use serde::Deserialize;

/// Fewest squares or tags along an edge, and the most: nobody prints more.
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
    /// A grid of AprilTags with small black squares between their corners, as Kalibr prints it.
    #[serde(rename = "aprilgrid")]
    AprilGrid {
        /// Tags along a row.
        columns: u32,
        /// Rows of tags.
        rows: u32,
        /// Edge of a tag with its black border, millimetres.
        tag_mm: f64,
        /// Gap between two tags, millimetres.
        gap_mm: f64,
        /// The tags' dictionary, by OpenCV's name: Kalibr's is `DICT_APRILTAG_36h11`.
        dictionary: String,
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
            Self::AprilGrid { tag_mm, gap_mm, .. } => {
                length("tag_mm", *tag_mm)?;
                length("gap_mm", *gap_mm)?;
            }
        }
        Ok(())
    }

    /// Squares or tags along a row, and rows.
    pub fn sizes(&self) -> (u32, u32) {
        match self {
            Self::Charuco { columns, rows, .. }
            | Self::Chessboard { columns, rows, .. }
            | Self::AprilGrid { columns, rows, .. } => (*columns, *rows),
        }
    }

    /// Width and height of what is printed, millimetres.
    pub fn extent_mm(&self) -> [f64; 2] {
        let (columns, rows) = self.sizes();
        let of = |count: u32| match self {
            Self::Charuco { square_mm, .. } | Self::Chessboard { square_mm, .. } => f64::from(count) * square_mm,
            Self::AprilGrid { tag_mm, gap_mm, .. } => f64::from(count) * tag_mm + f64::from(count - 1) * gap_mm,
        };
        [of(columns), of(rows)]
    }

    /// All corners that a detector can find, millimetres: those of squares inside of the board, of tags the four outer ones.
    pub fn corners_mm(&self) -> Vec<[f64; 2]> {
        let (columns, rows) = self.sizes();
        let grid = |xs: Vec<f64>, ys: Vec<f64>| ys.iter().flat_map(|y| xs.iter().map(|x| [*x, *y])).collect();
        match self {
            Self::Charuco { square_mm, .. } | Self::Chessboard { square_mm, .. } => {
                let inner = |count: u32| (1..count).map(|k| f64::from(k) * square_mm).collect();
                grid(inner(columns), inner(rows))
            }
            Self::AprilGrid { tag_mm, gap_mm, .. } => {
                let edges = |count: u32| {
                    (0..count)
                        .flat_map(|k| [0.0, *tag_mm].map(|edge| f64::from(k) * (tag_mm + gap_mm) + edge))
                        .collect()
                };
                grid(edges(columns), edges(rows))
            }
        }
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
        let tags = board(
            r#"{"type":"aprilgrid","columns":2,"rows":2,"tag_mm":10,"gap_mm":3,"dictionary":"DICT_APRILTAG_36h11"}"#,
        );
        assert_eq!(tags.extent_mm(), [23.0, 23.0]);
        assert_eq!((tags.corners_mm().len(), tags.corners_mm()[2]), (16, [13.0, 0.0]));
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
