//! A simulated cell for the tests: a robot looks at a board from many sides, or a table turns it, and corners are found with noise.

use crate::board_pose::{BoardPose, board_pose};
use crate::capture::Capture;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_perception::view::Intrinsics;

/// 1280x960, focal length 1200 pixels: about that of an industrial RGB-D camera.
pub(crate) const CAMERA: Intrinsics =
    Intrinsics { width: 1280, height: 960, fx: 1200.0, fy: 1200.0, cx: 639.5, cy: 479.5 };
/// Corners of the board, and their distance in metres.
const CORNERS: (usize, usize) = (9, 6);
const SQUARE: f64 = 0.02;

/// The truth.
pub(crate) struct Simulated {
    pub(crate) ee_from_camera: Isometry3<f64>,
    pub(crate) base_from_tablebase: Isometry3<f64>,
    pub(crate) tablebase_from_board: Isometry3<f64>,
    /// Standard deviation of a corner, pixels.
    pub(crate) noise: f64,
    pub(crate) rng: Pcg64,
}

impl Simulated {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            ee_from_camera: Isometry3::new(Vector3::new(0.03, -0.05, 0.08), Vector3::new(0.05, -0.1, 1.2)),
            base_from_tablebase: Isometry3::new(Vector3::new(0.6, 0.1, 0.2), Vector3::new(0.02, -0.03, 0.7)),
            tablebase_from_board: Isometry3::new(Vector3::new(-0.08, -0.05, 0.01), Vector3::new(0.01, 0.02, 0.3)),
            noise: 0.05,
            rng: Pcg64::seed_from_u64(seed),
        }
    }

    /// A normal deviate: the sum of twelve uniform ones is one, nearly.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Board corners, metres.
    pub(crate) fn corners() -> Vec<[f64; 2]> {
        let rows = 0..CORNERS.1;
        rows.flat_map(|row| (0..CORNERS.0).map(move |column| [column as f64 * SQUARE, row as f64 * SQUARE])).collect()
    }

    /// Where the corners are seen.
    pub(crate) fn pixels(&mut self, camera_from_board: &Isometry3<f64>) -> Vec<[f64; 2]> {
        let mut pixels = Vec::new();
        for [x, y] in Self::corners() {
            let p = camera_from_board * Point3::new(x, y, 0.0);
            let (u, v) = CAMERA.project(&p).expect("before the camera");
            pixels.push([u + self.noise * self.normal(), v + self.noise * self.normal()]);
        }
        pixels
    }

    /// A capture with the board as its picture has it.
    pub(crate) fn capture(&mut self, base_from_ee: Isometry3<f64>, table_angle: f64) -> (Capture, BoardPose) {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), table_angle);
        let base_from_board = self.base_from_tablebase * turned * self.tablebase_from_board;
        let camera_from_board = (base_from_ee * self.ee_from_camera).inverse() * base_from_board;
        let pixels = self.pixels(&camera_from_board);
        let found = board_pose(&Self::corners(), &pixels, &CAMERA).expect("the board is seen");
        let capture = Capture {
            base_from_ee: Some(base_from_ee),
            table_angle: Some(table_angle),
            camera_from_board: found.camera_from_board,
            covariance: Some(found.covariance),
        };
        (capture, found)
    }

    /// A pose of the robot from which the camera sees the board: from up to `tilt` radians off its normal, 0.4 to 0.6 m away.
    pub(crate) fn robot_pose(&mut self, tilt: f64) -> Isometry3<f64> {
        let middle = self.base_from_tablebase * self.tablebase_from_board * Point3::new(0.08, 0.05, 0.0);
        let mut between = |low: f64, high: f64| low + (high - low) * self.rng.random::<f64>();
        let (azimuth, polar) = (between(0.0, std::f64::consts::TAU), between(0.2 * tilt, tilt));
        let (distance, roll) = (between(0.4, 0.6), between(-0.6, 0.6));
        let from = Vector3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
        let eye = middle + from * distance;
        let looking = UnitQuaternion::face_towards(&(middle - eye), &Vector3::new(0.1, 1.0, 0.0));
        let rotation = looking * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        Isometry3::from_parts(Translation3::from(eye), rotation) * self.ee_from_camera.inverse()
    }
}
