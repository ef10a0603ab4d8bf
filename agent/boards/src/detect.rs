//! The corners of a board in a picture.

use crate::print::UnknownDictionary;
use crate::{charuco, chessboard};
use calib_targets_core::{DetectorConfig, GrayImageView, ImageRefiner, default_chess_config};
use image::GrayImage;
use semascan_calibration::{Board, Corner};

/// Why no board was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DetectError {
    /// The picture shows no such board, or too little of it.
    #[error("no board was found: {0}")]
    Unseen(String),
    /// The board's description is wrong.
    #[error("the board cannot be read: {0}")]
    Board(String),
    /// The markers' dictionary is not known.
    #[error(transparent)]
    Dictionary(#[from] UnknownDictionary),
}

/// The corners of the board, in no particular order. A few may be taken for others: [`semascan_calibration::board_view`] tells.
///
/// # Errors
/// [`DetectError`].
pub fn detect(board: &Board, picture: &GrayImage) -> Result<Vec<Corner>, DetectError> {
    match board {
        Board::Charuco { .. } => charuco::detect(board, picture),
        Board::Chessboard { columns, rows, square_mm } => chessboard::detect((*columns, *rows), *square_mm, picture),
    }
}

/// How crossings are found and placed.
pub(crate) fn crossings() -> DetectorConfig {
    default_chess_config().with_refiner(ImageRefiner::saddle_point())
}

pub(crate) fn view(picture: &GrayImage) -> GrayImageView<'_> {
    GrayImageView { width: picture.width() as usize, height: picture.height() as usize, data: picture.as_raw() }
}
