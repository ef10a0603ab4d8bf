//! Boards in pictures: the corners of ChArUco boards and chessboards.
//!
//! | file | what |
//! |---|---|
//! | `detect.rs` | the corners of a board in a picture |
//! | `charuco.rs`, `chessboard.rs` | the same for each kind of board |
//! | `print.rs` | what is printed on a board |
//! | `rendered.rs` | a picture of a board, whose truth is known |
//!
//! Places where a chessboard pattern crosses are found, brought into a grid and read by the library calib-targets; crossings are
//! placed by the saddle point of the grey values. A board is described by [`semascan_calibration::Board`], which also says
//! where its frame is, and corners that were taken for others are kept out there ([`semascan_calibration::board_view`]).

mod charuco;
mod chessboard;
mod detect;
mod print;
mod rendered;
#[cfg(test)]
mod tests;

pub use detect::{DetectError, detect};
pub use print::{Print, UnknownDictionary};
pub use rendered::{Exposure, Renderer};
