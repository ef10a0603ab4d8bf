//! What a camera sees of maps whose surface is known in closed form.

use super::*;
use crate::fuse::{LabelledView, MapConfig, SemanticMap};
use crate::organized::OrganizedCloud;
use crate::segment::{ClassField, Segmentation};
use crate::view::DepthImage;
use image::RgbImage;
use nalgebra::{Point3, Vector3};

const K: Intrinsics = Intrinsics { width: 160, height: 120, fx: 180.0, fy: 180.0, cx: 79.5, cy: 59.5 };
const VOXEL: f64 = 0.004;

/// Sees `depth(u, v)`; class 1 nearer than 0.45 m, else 2.
fn view(index: u32, pose: Isometry3<f64>, depth: impl Fn(usize, usize) -> f32) -> LabelledView {
    let metres: Vec<f32> = (0..160 * 120).map(|i| depth(i % 160, i / 160)).collect();
    let labels = metres.iter().map(|&z| if z < 0.45 { 1 } else { 2 }).collect();
    LabelledView {
        index,
        cloud: OrganizedCloud::new(K, &DepthImage { width: 160, height: 120, metres }, None),
        rgb: std::sync::Arc::new(RgbImage::new(160, 120)),
        segmentation: Segmentation {
            components: ClassField::Hard(labels),
            defects: ClassField::Hard(vec![0; 160 * 120]),
            instances: vec![3; 160 * 120],
            network: None,
        },
        table_from_camera: pose,
    }
}

fn map(views: &[LabelledView]) -> SemanticMap {
    let mut map = SemanticMap::new(MapConfig::new(VOXEL, 3, 1)).expect("valid settings");
    for view in views {
        map.integrate(view).expect("integrates");
    }
    map
}

/// Two walls one behind the other, both facing the camera: what a look into a housing shows.
fn walls() -> SemanticMap {
    let pose = Isometry3::identity();
    map(&[view(0, pose, |_, _| 0.5), view(1, pose, |_, _| 0.4)])
}

#[test]
fn the_far_wall_does_not_shine_through_the_near_one() {
    let map = walls();
    // A picture finer than the voxels is the hard case.
    for k in [map.model_camera(&K, 0.4), K, K.scaled(2.0)] {
        let view = map.render(k, &Isometry3::identity());
        let (w, h) = (k.width as usize, k.height as usize);
        let margin = (w / 16).max(3);
        for v in margin..h - margin {
            for u in margin..w - margin {
                let i = v * w + u;
                assert!((view.points[i][2] - 0.4).abs() < 1e-4, "({u}, {v}) of {w}x{h}: {:?}", view.points[i]);
                assert_eq!((view.labels[i], view.instances[i]), (1, 3));
                assert!(view.normals[i][2] < -0.999);
            }
        }
    }
}

#[test]
fn points_lie_on_the_surface_near_their_pixel() {
    let map = walls();
    let pose = Isometry3::new(Vector3::new(0.03, 0.0, -0.01), Vector3::new(0.05, -0.1, 0.2));
    let view = map.render(K, &pose);
    let mut seen = 0;
    for (i, p) in view.points.iter().enumerate().filter(|(_, p)| p[2] > 0.0) {
        let p = Point3::from(*p).cast::<f64>();
        let (u, v) = K.project(&p).expect("ahead");
        let reach = K.fx * VOXEL / p.z + 1e-3;
        assert!((u - (i % 160) as f64).abs() <= reach && (v - (i / 160) as f64).abs() <= reach);
        let q = pose * p;
        assert!((q.z - 0.4).abs() < 1e-4 || (q.z - 0.5).abs() < 1e-4, "{q} is on no wall");
        seen += 1;
    }
    assert!(seen > 160 * 120 / 2, "{seen} pixels");
}

#[test]
fn noise_does_not_bring_the_surface_nearer() {
    // A noise of three quarters of a voxel makes a shell some five voxels thick.
    let noise = |index: u32, u: usize, v: usize| {
        let word = |k: u32| {
            let mut x = (index * 40_503 + (v * 160 + u) as u32).wrapping_mul(2_654_435_761).wrapping_add(k * 977);
            x = (x ^ (x >> 15)).wrapping_mul(2_246_822_519);
            f64::from((x ^ (x >> 13)).wrapping_mul(3_266_489_917) >> 8) / f64::from(1_u32 << 24)
        };
        (0..12).map(word).sum::<f64>() - 6.0
    };
    let pose = Isometry3::identity();
    let views: Vec<_> = (0..6).map(|n| view(n, pose, |u, v| (0.4 + 0.75 * VOXEL * noise(n, u, v)) as f32)).collect();
    let map = map(&views);
    let shown = map.render(map.model_camera(&K, 0.4), &pose);
    let z: Vec<f64> = shown.points.iter().map(|p| f64::from(p[2])).filter(|z| *z > 0.0).collect();
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    assert!((mean - 0.4).abs() < 0.15 * VOXEL, "{} voxels off", (mean - 0.4) / VOXEL);
}

/// Mean distance of the picture's points from a sphere of 60 mm that the map was made of, outwards, millimetres.
fn outside_of_a_sphere(pixel: f64, hollow: bool) -> f64 {
    let (radius, centre) = (0.06, Point3::new(0.0, 0.0, 0.4));
    let depth = |u: usize, v: usize| {
        let ray = K.unproject(u as f64, v as f64, 1.0).coords;
        let (b, a, c) = (ray.dot(&centre.coords), ray.norm_squared(), centre.coords.norm_squared() - radius * radius);
        let root = b * b - a * c;
        let side = if hollow { 1.0 } else { -1.0 };
        if root > 0.0 { ((b + side * root.sqrt()) / a) as f32 } else { 0.0 }
    };
    let map = map(&[view(0, Isometry3::identity(), depth)]);
    let k = K.scaled(K.footprint(0.4) / (pixel * VOXEL));
    let picture = map.render(k, &Isometry3::identity());
    // Away from the outline, where pixels are seen at a slant.
    let off: Vec<f64> = picture
        .points
        .iter()
        .map(|p| Point3::from(*p).cast::<f64>() - centre)
        .filter(|p| p.z.abs() > 0.7 * radius && p.norm() < 2.0 * radius)
        .map(|p| p.norm() - radius)
        .collect();
    assert!(off.len() > 20, "{}", off.len());
    1e3 * off.iter().sum::<f64>() / off.len() as f64
}

#[test]
fn a_curved_surface_stays_where_it_is_however_coarse_the_picture() {
    for hollow in [false, true] {
        let [fine, coarse] = [1.0, 3.0].map(|pixel| outside_of_a_sphere(pixel, hollow));
        // The mean over a pixel of 12 mm lies 144 / (12 * 60) = 0.2 mm off.
        assert!((coarse - fine).abs() < 0.03, "hollow {hollow}: {fine} mm, {coarse} mm");
    }
}

#[test]
fn from_behind_nothing_is_seen_and_outliers_never_are() {
    let mut map = walls();
    let behind = Isometry3::new(Vector3::new(0.0, 0.0, 1.0), Vector3::y() * std::f64::consts::PI);
    assert!(map.render(K, &behind).points.iter().all(|p| *p == [0.0; 3]));
    for brick in &mut map.bricks {
        for voxel in &mut brick.voxels {
            voxel.flags = PointFlags(PointFlags::RADIUS_OUTLIER);
        }
    }
    assert!(map.render(K, &Isometry3::identity()).points.iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn a_camera_within_the_model_and_an_empty_map_give_a_picture() {
    let inside = Isometry3::translation(0.0, 0.0, 0.398);
    let view = walls().render(K, &inside);
    assert!(view.points.iter().flatten().all(|c| c.is_finite()));
    let empty = SemanticMap::new(MapConfig::new(VOXEL, 3, 1)).expect("valid settings");
    assert!(empty.render(K, &inside).points.iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn one_and_many_threads_draw_the_same_picture() {
    let map = walls();
    let pose = Isometry3::new(Vector3::new(0.05, 0.02, 0.0), Vector3::new(0.2, -0.3, 0.0));
    let draw = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| map.render(K, &pose))
    };
    let (one, four) = (draw(1), draw(4));
    assert_eq!((one.points, one.normals, one.labels), (four.points, four.normals, four.labels));
}
