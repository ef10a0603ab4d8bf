//! The corners of a ChArUco board.

use crate::detect::{DetectError, crossings, view};
use crate::print::dictionary;
use calib_targets_charuco::{CharucoBoardSpec, CharucoDetector, CharucoParams};
use image::GrayImage;
use semascan_calibration::{Board, Corner};

pub(crate) fn detect(board: &Board, picture: &GrayImage) -> Result<Vec<Corner>, DetectError> {
    let Board::Charuco { columns, rows, square_mm, marker_mm, dictionary: name } = board else {
        return Err(DetectError::Board("it is no ChArUco board".into()));
    };
    let relative = (marker_mm / square_mm) as f32;
    // In squares: single precision is for pictures, not for boards.
    let spec = CharucoBoardSpec::new(*rows, *columns, 1.0, relative, dictionary(name)?);
    let mut unseen = String::new();
    // Presets from the strictest to those for blurred and small pictures.
    for mut params in std::iter::once(CharucoParams::for_board(spec)).chain(CharucoParams::sweep_for_board(&spec)) {
        params.chess = params
            .chess
            .with_refiner(crossings().refiner.unwrap_or_else(calib_targets_core::ImageRefiner::saddle_point));
        let detector = CharucoDetector::new(params).map_err(|error| DetectError::Board(error.to_string()))?;
        match detector.detect(&view(picture)) {
            Ok(found) => {
                let corners = found.corners.iter().map(|corner| {
                    let inner = columns - 1;
                    let place = [corner.id % inner + 1, corner.id / inner + 1];
                    Corner {
                        board_mm: place.map(|k| f64::from(k) * square_mm),
                        pixel: [f64::from(corner.position.x), f64::from(corner.position.y)],
                    }
                });
                return Ok(corners.collect());
            }
            Err(error) => unseen = error.to_string(),
        }
    }
    Err(DetectError::Unseen(unseen))
}
