//! Calibration of a cell: where the camera sits on the robot's end effector (hand-eye) and where the turntable's axis lies, from
//! captures of a board whose pose was measured in each.
//!
//! | file | what |
//! |---|---|
//! | `capture.rs` | one capture: the readings of robot and table, and the board that was seen |
//! | `board_pose.rs` | the pose of a board from its corners in a picture, with covariance |
//! | `hand_eye.rs` | camera on the end effector, in closed form |
//! | `turntable.rs` | axis of the table, in closed form |
//! | `cell.rs` | what is estimated, and where it says that the board is seen |
//! | `refine.rs` | maximum likelihood of all of it together, robust, with covariance |
//! | `calibrate.rs` | the steps in their order, and what they found |
//! | `diversity.rs` | whether the poses can tell at all, and what is weak about them |
//! | `file.rs` | captures as JSON |
//!
//! Lengths are metres, angles radians unless a name says otherwise. Poses are named by their frames: `ee_from_camera` takes
//! coordinates of the camera to the end effector. Covariances are of twists (rotation vector, translation) in the frame that a
//! pose maps from, as in [`semascan_perception::register::se3`].

mod board_pose;
mod calibrate;
mod capture;
mod cell;
mod diversity;
mod file;
mod hand_eye;
mod refine;
#[cfg(test)]
mod simulated;
#[cfg(test)]
mod tests;
mod turntable;

pub use board_pose::{BoardPose, BoardPoseError, board_pose};
pub use calibrate::{Calibration, CalibrationError, CaptureResidual, HandEye, TurntableAxis, calibrate};
pub use capture::Capture;
pub use diversity::Warning;
pub use file::{CaptureFile, FileError};
