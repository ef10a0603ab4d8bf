//! Calibration of a cell: where the camera sits on the robot's end effector (hand-eye) and where the turntable's axis lies, from
//! captures of a board whose pose was measured in each.
//!
//! | file | what |
//! |---|---|
//! | `capture.rs` | one capture: the readings of robot and table, and the board that was seen |
//! | `board.rs` | boards, as people describe them |
//! | `board_view.rs` | the board in a picture: corners that agree, and its pose |
//! | `homography.rs` | between a board and its picture, and the corners that agree with it |
//! | `board_pose.rs` | the pose of a board from its corners in a picture, with covariance |
//! | `intrinsics/` | whether the camera's given numbers hold |
//! | `hand_eye.rs` | camera on the end effector, in closed form |
//! | `turntable.rs` | axis of the table, in closed form |
//! | `cell.rs` | what is estimated, and where it says that the board is seen |
//! | `refine.rs` | maximum likelihood of all of it together, robust, with covariance |
//! | `calibrate.rs` | the steps in their order, and what they found |
//! | `diversity.rs` | whether the poses can tell at all, and what is weak about them |
//! | `verification.rs` | captures that were not used, held against the result |
//! | `next_capture.rs` | which further capture would help most |
//! | `file.rs` | captures as JSON |
//!
//! Lengths are metres, angles radians unless a name says otherwise. Poses are named by their frames: `ee_from_camera` takes
//! coordinates of the camera to the end effector. Covariances are of twists (rotation vector, translation) in the frame that a
//! pose maps from, as in [`semascan_perception::register::se3`].

mod board;
mod board_pose;
mod board_view;
mod calibrate;
mod capture;
mod cell;
mod diversity;
mod file;
mod hand_eye;
mod homography;
mod intrinsics;
mod next_capture;
mod refine;
#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;
mod turntable;
mod verification;

pub use board::Board;
pub use board_pose::{BoardPose, BoardPoseError, board_pose};
pub use board_view::{BoardView, Corner, board_view};
pub use calibrate::{Calibration, CalibrationError, CaptureResidual, HandEye, TurntableAxis, calibrate};
pub use capture::Capture;
pub use diversity::Warning;
pub use file::{CaptureFile, FileError, ReadCaptures};
pub use homography::{agreeing, homography};
pub use intrinsics::{IntrinsicsCheck, IntrinsicsVerdict, OwnCamera, OwnNumber, Ring, check_intrinsics};
pub use next_capture::{BoardSight, NextCapture, next_captures};
pub use verification::{VerificationError, VerificationLimits, Verified, verify};
