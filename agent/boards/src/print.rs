//! What is printed on a board: black or white at each place.

use calib_targets_aruco::{Dictionary, resolve_dictionary};
use semascan_calibration::Board;

/// A dictionary of markers that is not known.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the dictionary {0:?} is not known: names are OpenCV's, such as DICT_4X4_50 or DICT_APRILTAG_36h11")]
pub struct UnknownDictionary(String);

pub(crate) fn dictionary(name: &str) -> Result<Dictionary, UnknownDictionary> {
    resolve_dictionary(name).ok_or_else(|| UnknownDictionary(name.to_owned()))
}

/// The print of a board.
pub struct Print<'a> {
    board: &'a Board,
    /// Of its markers, if it has any.
    dictionary: Option<Dictionary>,
}

impl<'a> Print<'a> {
    /// The print of `board`.
    ///
    /// # Errors
    /// [`UnknownDictionary`].
    pub fn new(board: &'a Board) -> Result<Self, UnknownDictionary> {
        let dictionary = match board {
            Board::Charuco { dictionary: name, .. } => Some(dictionary(name)?),
            Board::Chessboard { .. } => None,
        };
        Ok(Self { board, dictionary })
    }

    /// Whether it is black at a place of the board's frame, millimetres. Around what is printed it is white.
    pub fn is_black(&self, x: f64, y: f64) -> bool {
        let (columns, rows) = self.board.sizes();
        match self.board {
            Board::Chessboard { square_mm, .. } => {
                let (i, j) = ((x / square_mm).floor(), (y / square_mm).floor());
                let is_inside = i >= 0.0 && j >= 0.0 && i < f64::from(columns) && j < f64::from(rows);
                is_inside && (i + j) as i64 % 2 == 0
            }
            Board::Charuco { square_mm, marker_mm, .. } => {
                let (i, j) = ((x / square_mm).floor(), (y / square_mm).floor());
                if i < 0.0 || j < 0.0 || i >= f64::from(columns) || j >= f64::from(rows) {
                    return false;
                }
                let (i, j) = (i as u32, j as u32);
                if (i + j) % 2 == 0 {
                    return true;
                }
                // Markers are numbered along the rows; rows begin with a black square and a white one by turns.
                let before = j / 2 * columns + if j % 2 == 1 { columns / 2 } else { 0 };
                let margin = 0.5 * (square_mm - marker_mm);
                let inside = [x - f64::from(i) * square_mm - margin, y - f64::from(j) * square_mm - margin];
                self.is_marker_black(before + i / 2, inside.map(|at| at / marker_mm))
            }
        }
    }

    /// Whether a marker is black at a place of it, 0 to 1 along its edges with the border of one bit.
    fn is_marker_black(&self, id: u32, at: [f64; 2]) -> bool {
        let Some(dictionary) = &self.dictionary else { return false };
        let bits = dictionary.marker_size();
        let [column, row] = at.map(|at| (at * (bits + 2) as f64).floor());
        let edge = (bits + 1) as f64;
        if column < 0.0 || row < 0.0 || column > edge || row > edge {
            return false;
        }
        if column == 0.0 || row == 0.0 || column == edge || row == edge {
            return true;
        }
        let bit = (row as usize - 1) * bits + column as usize - 1;
        dictionary.codes().get(id as usize).is_some_and(|code| code >> bit & 1 == 1)
    }
}
