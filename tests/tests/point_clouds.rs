//! Real point clouds: Kinect captures and laser scans in PCD files.

use semascan_agent::acquire::pcd;
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
        let cloud = pcd::read(&folder.join(file)).expect("reads");
        assert_eq!(cloud.positions.len(), points, "{file}");
        let usable: Vec<_> = cloud.positions.iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
        assert_eq!(usable.len(), finite, "{file}");
        let labelled = cloud.labels.iter().flatten().filter(|l| **l == 1).count();
        assert_eq!(labelled, table, "{file}");
        assert_eq!(cloud.colors.is_some(), table > 0, "{file}");
        for axis in 0..3 {
            let found = usable.iter().map(|p| f64::from(p[axis])).sum::<f64>() / finite as f64;
            assert!((found - mean[axis]).abs() < 1e-5, "{file}: axis {axis}: {found}");
        }
    }
}
