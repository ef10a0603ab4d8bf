//! Tests of the camera models: the way there and back, against OpenCV, and depth registration against a rendered truth.

mod by_opencv;
mod registered;

use super::{CameraModel, Distortion, Rectification};
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use proptest::prelude::*;
use semascan_perception::view::{DepthImage, Intrinsics};

const SIZE: (u32, u32) = (160, 120);
const K: Intrinsics = Intrinsics { width: 160, height: 120, fx: 130.0, fy: 131.0, cx: 81.5, cy: 58.2 };

/// Lenses of cameras that exist: freiburg1 of the TUM data set, the colour camera of an Azure Kinect, a fisheye of a T265.
const FREIBURG1: Distortion =
    Distortion::BrownConrady { radial: [0.2624, -0.9531, 1.1633], tangential: [-0.0054, 0.0026] };
const AZURE_KINECT: Distortion = Distortion::Rational {
    radial: [0.5130, -2.6374, 1.4957],
    divisor: [0.3916, -2.4645, 1.4237],
    tangential: [0.00085, -0.00030],
};
const T265: Distortion = Distortion::Fisheye { radial: [-0.0082, 0.0454, -0.0425, 0.0077] };

fn camera(distortion: Distortion) -> CameraModel {
    CameraModel::new(K, distortion).expect("a camera")
}

/// Any lens of ordinary strength.
fn any_distortion() -> impl Strategy<Value = Distortion> {
    let small = -0.01..0.01_f64;
    let tangential = [small.clone(), small];
    prop_oneof![
        ([-0.4..0.4_f64, -0.5..0.5, -0.5..0.5], tangential.clone())
            .prop_map(|(radial, tangential)| Distortion::BrownConrady { radial, tangential }),
        ([-0.5..1.0_f64, -3.0..3.0, -2.0..2.0], [-0.5..1.0_f64, -3.0..3.0, -2.0..2.0], tangential)
            .prop_map(|(radial, divisor, tangential)| Distortion::Rational { radial, divisor, tangential }),
        [-0.1..0.1_f64, -0.1..0.1, -0.1..0.1, -0.1..0.1].prop_map(|radial| Distortion::Fisheye { radial }),
    ]
}

/// A lens whose tangential part folds the picture before its radial part does.
#[test]
fn no_two_rays_share_a_pixel_where_the_tangential_part_folds() {
    let radial = [-0.303_594_690_218_789_04, -0.499_105_935_522_871_7, 0.377_956_661_973_557_2];
    let camera = camera(Distortion::BrownConrady { radial, tangential: [0.009_521_009_469_867_107, 0.0] });
    let pixel = |x: f64, y: f64| camera.pixel_of_point(&Point3::new(x, y, 1.0));
    assert!(pixel(0.249_728_724_482_139_7, -0.895_508_293_889_680_7).is_none());
    let (u, v) = pixel(0.2, -0.7).expect("in range");
    let ray = camera.ray_of_pixel(u, v).expect("in range");
    assert!((ray.x - 0.2).abs() < 1e-9 && (ray.y + 0.7).abs() < 1e-9, "{ray}");
}

proptest! {
    #[test]
    fn a_ray_that_has_a_pixel_is_the_ray_of_that_pixel(
        distortion in any_distortion(), x in -1.2..1.2_f64, y in -1.0..1.0_f64,
    ) {
        let camera = camera(distortion);
        let Some((u, v)) = camera.pixel_of_point(&Point3::new(2.0 * x, 2.0 * y, 2.0)) else { return Ok(()) };
        let Some(ray) = camera.ray_of_pixel(u, v) else {
            // Only at the very end of the range, where a pixel says nothing of the ray.
            let further = camera.pixel_of_point(&Point3::new(1.03 * x, 1.03 * y, 1.0));
            prop_assert!(further.is_none(), "{distortion:?}: no ray for ({u}, {v})");
            return Ok(());
        };
        let (back_u, back_v) = camera.pixel_of_point(&Point3::from(ray)).expect("in range");
        prop_assert!((back_u - u).abs() < 1e-6 && (back_v - v).abs() < 1e-6, "{distortion:?}");
        let inside = camera.pixel_of_point(&Point3::new(1.05 * x, 1.05 * y, 1.0)).is_some();
        if inside {
            prop_assert!((ray.x - x).abs() < 1e-5 && (ray.y - y).abs() < 1e-5, "{distortion:?}: {ray} for {x}, {y}");
        }
    }

    #[test]
    fn any_numbers_are_a_camera_or_refused(
        k in prop::array::uniform4(prop::num::f64::ANY), radial in prop::array::uniform4(prop::num::f64::ANY),
        u in prop::num::f64::ANY, v in prop::num::f64::ANY,
    ) {
        let intrinsics = Intrinsics { width: 4, height: 3, fx: k[0], fy: k[1], cx: k[2], cy: k[3] };
        let [a, b, c, d] = radial;
        for distortion in [
            Distortion::Fisheye { radial },
            Distortion::BrownConrady { radial: [a, b, c], tangential: [d, a] },
            Distortion::Rational { radial: [a, b, c], divisor: [d, c, b], tangential: [a, d] },
        ] {
            let Ok(camera) = CameraModel::new(intrinsics, distortion) else { continue };
            if let Some(ray) = camera.ray_of_pixel(u, v) {
                prop_assert!(ray.iter().all(|c| c.is_finite()));
            }
            camera.pixel_of_point(&Point3::new(u, v, 1.0));
            if let Some(rectification) = Rectification::of(&camera) {
                let depth = DepthImage { width: 4, height: 3, metres: vec![0.5; 12] };
                let depth = rectification.depth(&depth).expect("its size");
                prop_assert!(depth.metres.iter().all(|z| z.is_finite() && *z >= 0.0));
            }
        }
    }
}

#[test]
fn real_lenses_come_back_over_the_whole_picture() {
    for distortion in [FREIBURG1, AZURE_KINECT, T265] {
        let camera = camera(distortion);
        let mut seen = 0;
        for i in 0..SIZE.0 * SIZE.1 {
            let (u, v) = (f64::from(i % SIZE.0), f64::from(i / SIZE.0));
            let Some(ray) = camera.ray_of_pixel(u, v) else { continue };
            let (x, y) = camera.pixel_of_point(&Point3::from(ray)).expect("in range");
            assert!((x - u).abs() < 1e-6 && (y - v).abs() < 1e-6, "{distortion:?} at {u}, {v}");
            seen += 1;
        }
        assert!(seen > SIZE.0 * SIZE.1 * 95 / 100, "{distortion:?}: {seen} pixels");
    }
}

/// A barrel lens whose polynomial falls again inside of the picture: rays outside share pixels with rays inside.
#[test]
fn past_the_range_of_the_model_there_are_no_rays() {
    let folding = Distortion::BrownConrady { radial: [-0.8, 0.0, 0.0], tangential: [0.0; 2] };
    let camera = camera(folding);
    // r (1 - 0.8 r^2) has its maximum at r = sqrt(1 / 2.4), where it is 2/3 of that.
    let most = (1.0 / 2.4_f64).sqrt();
    let pixel = |r: f64| camera.pixel_of_point(&Point3::new(r, 0.0, 1.0));
    assert!(pixel(0.999 * most).is_some() && pixel(1.001 * most).is_none());
    let (last, _) = pixel(0.999 * most).expect("a pixel");
    assert!(camera.ray_of_pixel(last, K.cy).is_some());
    assert!(camera.ray_of_pixel(last + 1.0, K.cy).is_none(), "beyond the largest pixel");
    let rectification = Rectification::of(&camera).expect("a lens");
    let white = RgbImage::from_pixel(SIZE.0, SIZE.1, Rgb([255; 3]));
    let depth = DepthImage { width: SIZE.0, height: SIZE.1, metres: vec![0.5; 19_200] };
    let (white, depth) =
        (rectification.color(&white).expect("its size"), rectification.depth(&depth).expect("its size"));
    let corner_is_seen = |u: u32, v: u32| (white.get_pixel(u, v).0 != [0; 3], depth.at(u, v).is_some());
    assert_eq!(corner_is_seen(0, 0), (false, false));
    assert_eq!(corner_is_seen(80, 60), (true, true));
    assert!(rectification.unseen() > 0.01 && rectification.unseen() < 0.5);
}

/// A slanted wall with a step, as the lens takes it: after rectification each pixel shows the wall or the step, never between.
#[test]
fn depth_is_that_of_a_surface_and_never_between_two() {
    let wall = |ray: Point3<f64>| if ray.x < 0.05 { 1.0 / (1.6 - 0.8 * ray.x) } else { 1.0 / (2.4 - 0.8 * ray.x) };
    for distortion in [FREIBURG1, AZURE_KINECT, T265] {
        let camera = camera(distortion);
        let taken = (0..SIZE.0 * SIZE.1).map(|i| {
            let (u, v) = (f64::from(i % SIZE.0), f64::from(i / SIZE.0));
            camera.ray_of_pixel(u, v).map_or(0.0, |ray| wall(Point3::from(ray)) as f32)
        });
        let taken = DepthImage { width: SIZE.0, height: SIZE.1, metres: taken.collect() };
        let rectification = Rectification::of(&camera).expect("a lens");
        let depth = rectification.depth(&taken).expect("its size");
        let (mut seen, mut beside_the_step) = (0, 0);
        for i in 0..SIZE.0 * SIZE.1 {
            let (u, v) = (i % SIZE.0, i / SIZE.0);
            let Some(z) = depth.at(u, v) else { continue };
            let ray = K.unproject(u.into(), v.into(), 1.0);
            seen += 1;
            // At the rim of the picture that was taken there is no neighbour to tell a slope by.
            let (x, y) = camera.pixel_of_point(&ray).expect("it sees something");
            let is_inside = (1.0..f64::from(SIZE.0) - 2.0).contains(&x) && (1.0..f64::from(SIZE.1) - 2.0).contains(&y);
            if (ray.x - 0.05).abs() < 3.0 / K.fx {
                let sides = [1.6, 2.4].map(|at| (f64::from(z) * (at - 0.8 * ray.x) - 1.0).abs());
                assert!(sides[0].min(sides[1]) < 0.01, "{distortion:?}: {z} m at {u}, {v}");
                beside_the_step += 1;
            } else if !is_inside {
                assert!((f64::from(z) - wall(ray)).abs() < 5e-3, "{distortion:?}: {z} m at {u}, {v}");
            } else {
                assert!((f64::from(z) - wall(ray)).abs() < 2e-4, "{distortion:?}: {z} m at {u}, {v}");
            }
        }
        assert!(seen > 15_000 && beside_the_step > 100, "{seen} {beside_the_step}");
    }
}

#[test]
fn pictures_of_another_size_and_numbers_of_no_camera_are_refused() {
    let rectification = Rectification::of(&camera(FREIBURG1)).expect("a lens");
    assert!(rectification.color(&RgbImage::new(120, 160)).is_err());
    assert!(rectification.depth(&DepthImage { width: 160, height: 120, metres: vec![0.0; 7] }).is_err());
    assert!(Rectification::of(&camera(Distortion::None)).is_none());
    let refused = |k: Intrinsics| CameraModel::new(k, Distortion::None).expect_err("no camera").to_string();
    assert_eq!(refused(Intrinsics { fx: 0.0, ..K }), "fx is 0");
    assert_eq!(refused(Intrinsics { cy: f64::NAN, ..K }), "cy is NaN");
    assert_eq!(refused(Intrinsics { width: 0, ..K }), "a picture of 0 x 120 pixels");
}
