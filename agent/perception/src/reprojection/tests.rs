//! The judge on pictures whose motion is known: a textured wall with a step, seen by a moving camera.
use super::*;
use crate::organized::OrganizedCloud;
use crate::view::{DepthImage, Intrinsics};
use image::{Rgb, RgbImage};
use nalgebra::{Translation3, UnitQuaternion};

const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 300.0, fy: 300.0, cx: 159.5, cy: 119.5 };

/// Smooth noise of the wall's plane, grey values; no two places look alike.
fn texture(x: f64, y: f64) -> f64 {
    let hash = |i: i64, j: i64| {
        let mut h = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        h = (h ^ h >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((h ^ h >> 32) & 255) as f64
    };
    let at = |scale: f64| {
        let (x, y) = (x * scale, y * scale);
        let (i, j, a, b) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
        let upper = hash(i, j) * (1.0 - a) + hash(i + 1, j) * a;
        upper * (1.0 - b) + (hash(i, j + 1) * (1.0 - a) + hash(i + 1, j + 1) * a) * b
    };
    0.6 * at(60.0) + 0.4 * at(140.0)
}

/// What a camera at `table_from_camera` sees of the plane z = 0.6 m.
fn seen(table_from_camera: &Isometry3<f64>, grey: impl Fn(f64, f64) -> f64) -> JudgedPicture {
    let (mut rgb, mut metres) = (RgbImage::new(CAMERA.width, CAMERA.height), Vec::new());
    for v in 0..CAMERA.height {
        for u in 0..CAMERA.width {
            let ray = table_from_camera.rotation * CAMERA.unproject(u.into(), v.into(), 1.0).coords;
            let centre = table_from_camera.translation.vector;
            let z = (0.6 - centre.z) / ray.z;
            metres.push(z as f32);
            let p = centre + ray * z;
            rgb.put_pixel(u, v, Rgb([grey(p.x, p.y).clamp(0.0, 255.0) as u8; 3]));
        }
    }
    let depth = DepthImage { width: CAMERA.width, height: CAMERA.height, metres };
    JudgedPicture::new(&rgb, &OrganizedCloud::new(CAMERA, &depth, None), None)
}

fn poses() -> Vec<Isometry3<f64>> {
    [(0.0, 0.0, 0.0), (0.05, -0.01, 0.06), (-0.04, 0.03, -0.1), (0.02, 0.05, 0.15)]
        .into_iter()
        .map(|(x, y, turn)| {
            Isometry3::from_parts(Translation3::new(x, y, y), UnitQuaternion::from_euler_angles(-y, -x, turn))
        })
        .collect()
}

/// The poses with each camera moved by some pixels on the wall.
fn off_by(pixels: f64) -> Vec<Isometry3<f64>> {
    let metres = pixels * 0.6 / CAMERA.fx;
    let shifted = |(i, pose): (usize, Isometry3<f64>)| {
        // Neighbouring views move in directions at right angles or opposite: pairs are off by sqrt 2 or 2 times as much.
        let turn = std::f64::consts::FRAC_PI_2 * i as f64;
        Isometry3::from_parts(Translation3::new(metres * turn.cos(), metres * turn.sin(), 0.0), pose.rotation.inverse())
            .translation
            * pose
    };
    poses().into_iter().enumerate().map(shifted).collect()
}

#[test]
fn true_poses_are_right_to_a_tenth_of_a_pixel_and_wrong_ones_by_what_they_are_off() {
    let truth = poses();
    let pictures: Vec<_> = truth.iter().map(|pose| seen(pose, texture)).collect();
    let pictures: Vec<&_> = pictures.iter().collect();
    let wrong = off_by(3.0);
    let report = judge(&pictures, &[&truth, &wrong]);
    assert_eq!((report.views, report.compared, report.pairs), (4, 6, 6));
    assert!(report.matches > report.searched / 2, "{report:?}");
    assert_eq!(report.still, 0);
    let [Some(right), Some(off)] = report.errors[..] else { panic!("{report:?}") };
    assert!(right < 0.1, "true poses: {right} px");
    // Four pairs at 3 sqrt 2, two at 6 pixels.
    let expected = (4.0 * 3.0 * 2.0_f64.sqrt() + 2.0 * 6.0) / 6.0;
    assert!((off - expected).abs() < 0.3, "{off} px, expected {expected}");
    // The wrong poses alone are judged alike, whatever they are compared with.
    let alone = judge(&pictures, &[&wrong]).errors[0].expect("known");
    assert!((alone - expected).abs() < 0.3, "{alone} px alone, expected {expected}");
}

#[test]
fn without_texture_nothing_is_known() {
    let truth = poses();
    let pictures: Vec<_> = truth.iter().map(|pose| seen(pose, |_, _| 120.0)).collect();
    let report = judge(&pictures.iter().collect::<Vec<_>>(), &[&truth]);
    assert_eq!((report.matches, &report.errors[..]), (0, &[None][..]));
    assert!(report.unknown().is_some_and(|why| why.contains("corners")));
    assert!(judge(&[], &[&[]]).unknown().is_some());
    let one = judge(&[&pictures[0]], &[&truth[..1]]);
    assert!(one.errors == [None] && one.unknown().is_some_and(|why| why.contains("two views")));
}

#[test]
fn what_looks_the_same_everywhere_is_no_match() {
    let truth = poses();
    // A board with squares of 8 mm: 4 pixels, so that several fit within the radius.
    let board =
        |x: f64, y: f64| if ((x / 8e-3).floor() as i64 + (y / 8e-3).floor() as i64) % 2 == 0 { 60.0 } else { 180.0 };
    let pictures: Vec<_> = truth.iter().map(|pose| seen(pose, board)).collect();
    let report = judge(&pictures.iter().collect::<Vec<_>>(), &[&off_by(3.0)]);
    assert!(report.searched > 100, "{report:?}");
    assert_eq!(report.errors, [None], "{report:?}");
}

#[test]
fn what_stands_still_with_the_camera_does_not_count() {
    // The same picture four times, as of a background behind a turntable, under poses that say that the camera moved.
    let picture = seen(&Isometry3::identity(), texture);
    let pictures = vec![&picture; 4];
    let report = judge(&pictures, &[&poses()]);
    assert!(report.still > report.searched / 2, "{report:?}");
    assert_eq!(report.errors, [None], "{report:?}");
    assert!(report.unknown().is_some_and(|why| why.contains("still")));
}

#[test]
fn poses_for_other_views_are_not_judged() {
    let truth = poses();
    let pictures: Vec<_> = truth.iter().map(|pose| seen(pose, texture)).collect();
    let report = judge(&pictures.iter().collect::<Vec<_>>(), &[&truth[..3], &truth]);
    assert!(report.errors[0].is_none() && report.errors[1].is_some());
}

#[test]
fn pictures_are_thinned_evenly() {
    let picture = seen(&Isometry3::identity(), texture);
    let mut pictures = Pictures::default();
    for place in 0..300 {
        if pictures.wants(place) {
            pictures.keep(place, picture.clone());
        }
    }
    let places = pictures.places();
    assert!(places.len() <= 32 && places.len() > 15, "{places:?}");
    assert!(places.windows(2).all(|w| w[1] - w[0] == places[1] - places[0]), "{places:?}");
}
