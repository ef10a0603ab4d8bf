//! A cell whose pictures are rendered: a robot looks at a board on a turntable. What a calibration should find is known.

use image::GrayImage;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_boards::{Exposure, Renderer};
use semascan_calibration::{Board, Calibration, Capture, Corner};
use semascan_perception::register::se3::{exp, halves, log};
use semascan_perception::view::CameraModel;

/// The truth.
pub(crate) struct RenderedCell {
    pub(crate) board: Board,
    pub(crate) camera: CameraModel,
    pub(crate) ee_from_camera: Isometry3<f64>,
    pub(crate) base_from_tablebase: Isometry3<f64>,
    pub(crate) tablebase_from_board: Isometry3<f64>,
    /// Nearest and farthest distance of the camera, metres.
    pub(crate) distances: (f64, f64),
    /// Standard deviations of the robot along each axis: radians, metres.
    pub(crate) robot_error: (f64, f64),
    pub(crate) rng: Pcg64,
}

/// What is read and seen at one time.
pub(crate) struct Taken {
    /// As the robot says it.
    pub(crate) base_from_ee: Isometry3<f64>,
    pub(crate) table_angle: f64,
    /// Where the board is.
    pub(crate) camera_from_board: Isometry3<f64>,
    pub(crate) picture: GrayImage,
}

impl RenderedCell {
    pub(crate) fn new(board: Board, camera: CameraModel, distances: (f64, f64), seed: u64) -> Self {
        Self {
            board,
            camera,
            ee_from_camera: Isometry3::new(Vector3::new(0.03, -0.05, 0.08), Vector3::new(0.05, -0.1, 1.2)),
            base_from_tablebase: Isometry3::new(Vector3::new(0.6, 0.1, 0.2), Vector3::new(0.02, -0.03, 0.7)),
            // It lies on the table with its print upwards.
            tablebase_from_board: Isometry3::new(
                Vector3::new(-0.09, 0.06, 0.01),
                Vector3::new(std::f64::consts::PI - 0.02, 0.01, 0.0),
            ),
            distances,
            robot_error: (0.0, 0.0),
            rng: Pcg64::seed_from_u64(seed),
        }
    }

    /// `still` captures with the table at rest, then `turned` with the table all around; the robot looks from elsewhere each time.
    pub(crate) fn captures(&mut self, still: usize, turned: usize) -> Vec<Taken> {
        let renderer = Renderer::new(&self.camera);
        let mut taken = Vec::new();
        for k in 0..still + turned {
            let table_angle =
                if k < still { 0.0 } else { std::f64::consts::TAU * (k - still + 1) as f64 / turned as f64 };
            let seed = self.rng.random();
            let base_from_ee = self.robot_pose(table_angle);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), table_angle);
            let base_from_board = self.base_from_tablebase * turn * self.tablebase_from_board;
            let camera_from_board = (base_from_ee * self.ee_from_camera).inverse() * base_from_board;
            let exposure = Exposure { blur: 0.8, noise: 4.0, seed };
            let picture = renderer.picture(&self.board, &camera_from_board, exposure).expect("a known dictionary");
            let (w, t) = self.robot_error;
            let error = Vector6::from_fn(|k, _| self.normal() * if k < 3 { w } else { t });
            taken.push(Taken { base_from_ee: base_from_ee * exp(&error), table_angle, camera_from_board, picture });
        }
        taken
    }

    /// The camera before the board: 6 to 40 degrees off its normal, rolled by 35 at most.
    fn robot_pose(&mut self, table_angle: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), table_angle);
        let [w, h] = self.board.extent_mm().map(|mm| mm * 5e-4);
        let middle = self.base_from_tablebase * turn * self.tablebase_from_board * Point3::new(w, h, 0.0);
        let mut between = |low: f64, high: f64| low + (high - low) * self.rng.random::<f64>();
        let (azimuth, polar) = (between(0.0, std::f64::consts::TAU), between(0.1, 0.7));
        let (distance, roll) = (between(self.distances.0, self.distances.1), between(-0.6, 0.6));
        let from = Vector3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
        let eye = middle + from * distance;
        let looking = UnitQuaternion::face_towards(&(middle - eye), &Vector3::new(0.1, 1.0, 0.0));
        let rotation = looking * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        Isometry3::from_parts(Translation3::from(eye), rotation) * self.ee_from_camera.inverse()
    }

    /// A normal deviate: the sum of twelve uniform ones is one, nearly.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Where a corner is, pixels; `None` where that is not in the picture.
    pub(crate) fn corner(&self, board_mm: [f64; 2], camera_from_board: &Isometry3<f64>) -> Option<[f64; 2]> {
        let [x, y] = board_mm.map(|mm| mm * 1e-3);
        let (u, v) = self.camera.pixel_of_point(&(camera_from_board * Point3::new(x, y, 0.0)))?;
        let k = self.camera.intrinsics();
        let is_inside = |at: f64, size: u32| (6.0..f64::from(size) - 7.0).contains(&at);
        (is_inside(u, k.width) && is_inside(v, k.height)).then_some([u, v])
    }

    /// Distance of a corner from where it is, pixels.
    pub(crate) fn corner_error(&self, corner: &Corner, camera_from_board: &Isometry3<f64>) -> f64 {
        let [x, y] = corner.board_mm.map(|mm| mm * 1e-3);
        let there = self.camera.pixel_of_point(&(camera_from_board * Point3::new(x, y, 0.0)));
        there.map_or(f64::INFINITY, |(u, v)| (corner.pixel[0] - u).hypot(corner.pixel[1] - v))
    }

    /// Errors of the camera: degrees, millimetres.
    pub(crate) fn camera_error(&self, found: &Calibration) -> (f64, f64) {
        let (w, t) = halves(&log(&self.ee_from_camera, &found.hand_eye.expect("the robot moved").ee_from_camera));
        (w.norm().to_degrees(), t.norm() * 1e3)
    }

    /// Errors of the axis: degrees, millimetres.
    pub(crate) fn axis_error(&self, found: &Calibration) -> (f64, f64) {
        let found = found.turntable.expect("the table turned").base_from_tablebase;
        let found_from_true = found.inverse() * self.base_from_tablebase;
        let direction = found_from_true * Vector3::z();
        let point = found_from_true.translation.vector;
        // Where the true axis passes the found origin.
        let there = point - direction * (point.z / direction.z);
        (direction.x.hypot(direction.y).to_degrees(), there.x.hypot(there.y) * 1e3)
    }
}

impl Taken {
    /// With the board as its picture has it.
    pub(crate) fn capture(&self, view: &semascan_calibration::BoardView) -> Capture {
        Capture {
            base_from_ee: Some(self.base_from_ee),
            table_angle: Some(self.table_angle),
            camera_from_board: view.camera_from_board,
            covariance: Some(view.covariance),
        }
    }
}
