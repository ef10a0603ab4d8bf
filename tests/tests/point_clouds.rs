//! Real point clouds: Kinect captures and laser scans in PCD files.

use nalgebra::{Isometry3, Point3, Vector3};
use semascan_formats::offset::single;
use semascan_formats::pcd;
use semascan_geometry::measure::{NearestPoints, percentile};
use semascan_perception::register::gicp::{self, GicpConfig};
use semascan_perception::register::global::{CloudInput, GlobalConfig, GlobalError, register_globally};
use semascan_perception::register::{Facing, SurfelCloud};
use semascan_tests::data;

/// File, points, finite points and their mean, points labelled 1, as Open3D 0.20 reads them.
const READ_BY_OPEN3D: [(&str, usize, usize, [f64; 3], usize); 4] = [
    ("pairwise/capture0001.pcd", 307_200, 249_647, [-0.025507, 0.000946, 2.244117], 0),
    ("room_scan1.pcd", 112_586, 112_586, [0.231358, 0.133906, 0.412378], 0),
    ("tabletop-labelled/learn0.pcd", 307_200, 182_292, [-0.051744, 0.095667, 0.850874], 153_323),
    ("tabletop-labelled/learn17.pcd", 307_200, 197_828, [0.002538, 0.03595, 0.838575], 176_558),
];

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn pcd_files_hold_what_open3d_finds_in_them() {
    let folder = data::folder("point-clouds").expect("real captures");
    for (file, points, finite, mean, table) in READ_BY_OPEN3D {
        let cloud = pcd::read_file(&folder.join(file)).expect("reads");
        assert_eq!(cloud.positions.len(), points, "{file}");
        let usable: Vec<_> = cloud.positions.iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
        assert_eq!(usable.len(), finite, "{file}");
        let labelled = cloud.labels.iter().flatten().filter(|l| **l == 1).count();
        assert_eq!(labelled, table, "{file}");
        assert_eq!(cloud.colors.is_some(), table > 0, "{file}");
        for axis in 0..3 {
            let found = usable.iter().map(|p| p[axis]).sum::<f64>() / finite as f64;
            assert!((found - mean[axis]).abs() < 1e-5, "{file}: axis {axis}: {found}");
        }
    }
}

/// Pose of each view in the one before it: rotation vector and translation in metres, by Open3D 0.20 (FPFH at 5 cm,
/// RANSAC, then point-to-plane ICP with Tukey weights at 1 cm; three seeds agree to a millimetre).
const BY_OPEN3D: [([f64; 3], [f64; 3]); 4] = [
    ([0.0031, 0.0190, -0.0091], [-0.1082, 0.0072, 0.0056]),
    ([-0.0030, -0.0369, -0.0069], [-0.1502, -0.0009, 0.0132]),
    ([-0.0040, -0.1039, -0.0012], [-0.2105, -0.0069, 0.0118]),
    ([0.0011, 0.0045, 0.0131], [-0.1719, -0.0025, 0.0248]),
];

/// Depth of the scene's middle, where poses are compared, metres.
const MIDDLE: f64 = 2.2;

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn five_views_without_poses_register_globally() {
    let folder = data::folder("point-clouds/pairwise").expect("real captures");
    let views: Vec<Vec<[f32; 3]>> = (1..=5)
        .map(|i| single(&pcd::read_file(&folder.join(format!("capture000{i}.pcd"))).expect("reads").positions))
        .collect();
    let fine = |points: &[[f32; 3]], eye| SurfelCloud::new(points, Facing::From(eye), 0.01, 16).expect("a surface");
    for (i, (rotation, translation)) in BY_OPEN3D.into_iter().enumerate() {
        let reference = Isometry3::new(translation.into(), rotation.into());
        // The views are taken from nearly one place: each is carried far away, so that no guess can be near.
        let away = Isometry3::new(Vector3::new(5.0, -3.0, 1.0), Vector3::new(0.5, 1.9, -1.2) * (i + 1) as f64);
        let source: Vec<[f32; 3]> = views[i + 1].iter().map(|p| moved(&away, *p)).collect();
        let (eye, origin) = (away * Point3::origin(), Point3::origin());
        let from = CloudInput { points: &source, facing: Facing::From(eye) };
        let to = CloudInput { points: &views[i], facing: Facing::From(origin) };
        let config = GlobalConfig { seed: 7 + i as u64, ..GlobalConfig::default() };
        let found = register_globally(&from, &to, &config).expect("a match");
        let (from, to) = (fine(&source, eye), fine(&views[i], origin));
        let fit = gicp::align(&from, &to, &found.target_from_source, &GicpConfig::within(0.05)).expect("aligned");
        let all = NearestPoints::new(&views[i]);
        let pose = fit.target_from_source * away;
        let (before, after) =
            (distances(&views[i + 1], &Isometry3::identity(), &all), distances(&source, &fit.target_from_source, &all));
        let by_open3d = distances(&views[i + 1], &reference, &all);
        let middle = Point3::new(0.0, 0.0, MIDDLE);
        let off = (pose * middle - reference * middle).norm();
        let turn = (pose.rotation.inverse() * reference.rotation).angle().to_degrees();
        eprintln!(
            "view {} in view {}: overlap {:.2} on the grid (next best {:.2}), {} pairs; GICP overlap {:.2}, planes' RMSE \
             {:.2} mm; median distance {:.1} -> {:.1} mm ({:.1} at Open3D's pose); from Open3D's pose {:.1} mm {:.2} deg",
            i + 2,
            i + 1,
            found.overlap,
            found.runner_up,
            found.support,
            fit.overlap,
            fit.rmse * 1e3,
            before * 1e3,
            after * 1e3,
            by_open3d * 1e3,
            off * 1e3,
            turn
        );
        assert!(off < 0.015 && turn < 0.3, "{off:.4} m, {turn:.3} deg from the reference");
        assert!(after < 0.5 * before && after < 1.03 * by_open3d, "median distance {before:.4} -> {after:.4} m");
    }
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn a_room_and_a_table_do_not_match() {
    let folder = data::folder("point-clouds").expect("real captures");
    let read = |file: &str| single(&pcd::read_file(&folder.join(file)).expect("reads").positions);
    let (room, table) = (read("pairwise/capture0001.pcd"), read("tabletop-labelled/learn0.pcd"));
    let input = |points| CloudInput { points, facing: Facing::From(Point3::origin()) };
    for seed in 0..3 {
        let found = register_globally(&input(&table), &input(&room), &GlobalConfig { seed, ..GlobalConfig::default() });
        eprintln!("{found:?}");
        assert!(matches!(found, Err(GlobalError::NoMatch { .. })), "{found:?}");
    }
}

/// Median distance of the points, placed by `pose`, to the nearest point of `cloud`; points farther than 5 cm lie
/// outside what both see.
fn distances(points: &[[f32; 3]], pose: &Isometry3<f64>, cloud: &NearestPoints) -> f64 {
    let placed: Vec<_> = points.iter().map(|p| moved(pose, *p)).collect();
    let nearest = cloud.nearest_of_all(&placed);
    let mut near: Vec<f64> = nearest.into_iter().flatten().map(|n| n.distance()).filter(|d| *d < 0.05).collect();
    percentile(&mut near, 0.5).expect("the views overlap")
}

fn moved(by: &Isometry3<f64>, p: [f32; 3]) -> [f32; 3] {
    let q = by * Point3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    [q.x as f32, q.y as f32, q.z as f32]
}
