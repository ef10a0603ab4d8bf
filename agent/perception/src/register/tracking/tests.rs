//! A camera in a small room whose walls and ball are known exactly.

use super::*;
use crate::view::{DepthImage, Intrinsics, PoseEvidence};
use image::{Rgb, RgbImage};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::sync::Arc;

const CAMERA: Intrinsics = Intrinsics { width: 160, height: 120, fx: 140.0, fy: 140.0, cx: 79.5, cy: 59.5 };

/// What the camera is in.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// A room of 2.4 x 2 x 1.6 m with balls in its corners, printed all over.
    Room,
    /// A wall, 1 m ahead, printed.
    Wall,
    /// The same without any print.
    BlankWall,
}

const BALLS: [([f64; 3], f64); 4] =
    [([0.8, 0.5, -0.4], 0.3), ([-0.9, 0.3, 0.5], 0.35), ([0.7, -0.6, 0.6], 0.25), ([-0.6, -0.7, -0.6], 0.3)];

impl Place {
    /// Depth along a ray from `eye` whose direction has unit length along the optical axis.
    fn hit(self, eye: &Point3<f64>, ray: &Vector3<f64>) -> f64 {
        if self != Self::Room {
            return if ray.z > 0.05 { (1.0 - eye.z) / ray.z } else { 0.0 };
        }
        let half = [1.2, 1.0, 0.8];
        let wall = |i: usize| if ray[i] == 0.0 { f64::INFINITY } else { (half[i] * ray[i].signum() - eye[i]) / ray[i] };
        let walls = (0..3).map(wall).fold(f64::INFINITY, f64::min);
        let ball = |(centre, radius): &([f64; 3], f64)| {
            let to = Point3::from(*centre) - eye;
            let (a, b) = (ray.norm_squared(), ray.dot(&to));
            let root = b * b - a * (to.norm_squared() - radius * radius);
            if root > 0.0 && b > root.sqrt() { (b - root.sqrt()) / a } else { f64::INFINITY }
        };
        BALLS.iter().map(ball).fold(walls, f64::min)
    }

    fn view(self, pose: &Isometry3<f64>) -> View {
        let (width, height) = (CAMERA.width, CAMERA.height);
        let eye = Point3::from(pose.translation.vector);
        let ray = |i: u32| pose.rotation * CAMERA.unproject((i % width).into(), (i / width).into(), 1.0).coords;
        let metres: Vec<f32> = (0..width * height).map(|i| self.hit(&eye, &ray(i)) as f32).collect();
        let rgb = RgbImage::from_fn(width, height, |u, v| {
            let i = v * width + u;
            let p = eye + ray(i) * f64::from(metres[i as usize]);
            let print = (p.x * 21.0 + p.z * 5.0).sin() * (p.y * 17.0 - p.z * 13.0).cos()
                + 0.5 * (p.x * 9.0 + p.y * 33.0 + p.z * 27.0).sin();
            Rgb([if self == Self::BlankWall { 90 } else { (110.0 + 60.0 * print) as u8 }; 3])
        });
        View {
            index: 0,
            stamp: None,
            intrinsics: CAMERA,
            rgb: Arc::new(rgb),
            depth: Arc::new(DepthImage { width, height, metres }),
            pose: PoseEvidence::None,
            labels: None,
            truth: None,
        }
    }
}

/// A hand that turns the camera all around, sways, and ends where it began.
fn handheld(share: f64) -> Isometry3<f64> {
    let turn = std::f64::consts::TAU * share;
    let sway = Vector3::new(0.1 * (turn).sin(), 0.06 * (2.0 * turn).sin(), 0.1 * (turn).cos() - 0.1);
    let tilt = UnitQuaternion::from_euler_angles(0.1 * (3.0 * turn).sin(), 0.0, 0.05 * (2.0 * turn).sin());
    Isometry3::from_parts(sway.into(), UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn) * tilt)
}

/// Metres between the camera's places, both seen from the first view's camera.
fn error(first: &Isometry3<f64>, truth: &Isometry3<f64>, found: &Isometry3<f64>) -> f64 {
    ((first.inverse() * truth).translation.vector - found.translation.vector).norm()
}

#[test]
fn a_camera_that_turns_all_around_comes_back_to_where_it_was_on_any_number_of_threads() {
    let frames = 72;
    let turn = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut tracker = Tracker::default();
            let loops: usize = (0..=frames)
                .map(|i| tracker.track(&Place::Room.view(&handheld(f64::from(i) / f64::from(frames)))).loops)
                .sum();
            (tracker.trajectory(), loops, tracker.keyframes())
        })
    };
    let (trajectory, loops, keyframes) = turn(1);
    assert!((8..50).contains(&keyframes) && loops > 0, "{keyframes} keyframes, {loops} loops");
    for (i, pose) in trajectory.iter().enumerate() {
        let pose = pose.unwrap_or_else(|| panic!("frame {i} is lost"));
        let off = error(&handheld(0.0), &handheld(i as f64 / f64::from(frames)), &pose);
        assert!(off < 8e-3, "frame {i}: {off} m");
    }
    assert_eq!(turn(3).0, trajectory);
}

#[test]
fn a_camera_that_saw_nothing_for_a_while_is_found_again_elsewhere() {
    let at = |i: u32| handheld(f64::from(i) / 200.0);
    let mut tracker = Tracker::default();
    let mut black = Place::Room.view(&at(0));
    black.rgb = Arc::new(RgbImage::new(160, 120));
    black.depth = Arc::new(DepthImage { width: 160, height: 120, metres: vec![0.0; 160 * 120] });
    for i in 0..40 {
        assert!(tracker.track(&Place::Room.view(&at(i))).world_from_camera.is_some(), "frame {i}");
    }
    for _ in 0..5 {
        assert_eq!(tracker.track(&black).health, Err(Lost::NoDepth));
    }
    // Half of the way back, where it had been long before.
    let tracked = tracker.track(&Place::Room.view(&at(17)));
    let pose = tracked.world_from_camera.expect("found again");
    assert!(tracked.found_again && error(&at(0), &at(17), &pose) < 8e-3, "{}", error(&at(0), &at(17), &pose));
    assert_eq!(tracker.trajectory().iter().filter(|pose| pose.is_none()).count(), 5);
}

#[test]
fn the_picture_holds_what_slides_along_a_wall_and_a_blank_one_is_said_to_leave_it_open() {
    let at = |i: u32| Isometry3::translation(0.006 * f64::from(i), -0.003 * f64::from(i), 0.0);
    for place in [Place::Wall, Place::BlankWall] {
        let mut tracker = Tracker::default();
        let mut last = tracker.track(&place.view(&at(0)));
        for i in 1..20 {
            last = tracker.track(&place.view(&at(i)));
        }
        let off = error(&at(0), &at(19), &last.world_from_camera.expect("tracked"));
        assert_eq!(last.health.map(|health| health.left_open), Ok(3));
        assert!((off < 4e-3) == (place == Place::Wall), "{off} m");
    }
}

#[test]
fn another_place_is_no_place() {
    let mut tracker = Tracker::default();
    for i in 0..4 {
        tracker.track(&Place::Room.view(&handheld(f64::from(i) / 200.0)));
    }
    let elsewhere = tracker.track(&Place::Room.view(&handheld(0.5)));
    assert!(elsewhere.world_from_camera.is_none() && elsewhere.health.is_err(), "{elsewhere:?}");
}
