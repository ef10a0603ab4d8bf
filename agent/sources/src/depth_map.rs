//! Point cloud -> depth map, the way back from `OrganizedCloud`: the conversion of [Wang 2023] (its Fig. 4: each point
//! of the cloud goes to a pixel of the depth map), with the camera stated.
//!
//! `u = fx x/z + cx`, `v = fy y/z + cy`, rounded to the nearest pixel, whose centre has whole coordinates; of the points
//! of a pixel the nearest stays.

use nalgebra::{Isometry3, Point3};
use semascan_perception::view::{DepthImage, Intrinsics};

/// No point in this pixel.
pub const NO_POINT: u32 = u32::MAX;

/// A depth map and the point that each of its pixels shows.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    /// Depth along the optical axis.
    pub depth: DepthImage,
    /// Index of the point, row-major; [`NO_POINT`] where there is none.
    pub point: Vec<u32>,
}

impl DepthMap {
    /// The depth map of `points` for a camera `k`; `camera_from_points` brings them into its frame. Points behind the
    /// camera, outside the picture or not finite are left out.
    pub fn of_points(points: &[[f32; 3]], k: &Intrinsics, camera_from_points: &Isometry3<f64>) -> Self {
        let (width, height) = (k.width as usize, k.height as usize);
        let mut map = Self {
            depth: DepthImage { width: k.width, height: k.height, metres: vec![0.0; width * height] },
            point: vec![NO_POINT; width * height],
        };
        for (i, p) in points.iter().enumerate().take(NO_POINT as usize) {
            let [x, y, z] = p.map(f64::from);
            let p = camera_from_points * Point3::new(x, y, z);
            let Some((u, v)) = k.project(&p) else { continue };
            let (u, v) = (u.round(), v.round());
            if !(u >= 0.0 && v >= 0.0 && u < f64::from(k.width) && v < f64::from(k.height)) {
                continue;
            }
            let (at, z) = (v as usize * width + u as usize, p.z as f32);
            let nearest = &mut map.depth.metres[at];
            if z > 0.0 && z.is_finite() && (*nearest == 0.0 || z < *nearest) {
                *nearest = z;
                map.point[at] = i as u32;
            }
        }
        map
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use semascan_perception::organized::OrganizedCloud;

    const K: Intrinsics = Intrinsics { width: 40, height: 30, fx: 35.0, fy: 36.0, cx: 19.2, cy: 14.9 };

    #[test]
    fn a_depth_map_survives_the_way_through_a_cloud_in_another_frame() {
        let metres: Vec<f32> = (0..1200).map(|i| if i % 7 == 0 { 0.0 } else { 0.4 + (i % 13) as f32 * 0.01 }).collect();
        let depth = DepthImage { width: 40, height: 30, metres };
        let cloud = OrganizedCloud::new(K, &depth, None);
        let table_from_camera = Isometry3::new(Vector3::new(0.1, 0.3, -0.2), Vector3::new(0.4, -1.0, 0.2));
        let table: Vec<[f32; 3]> = (0..1200)
            .filter_map(|i| cloud.point(i))
            .map(|p| (table_from_camera * p).coords.cast::<f32>().into())
            .collect();
        let map = DepthMap::of_points(&table, &K, &table_from_camera.inverse());
        for (i, (&a, &b)) in depth.metres.iter().zip(&map.depth.metres).enumerate() {
            assert!((a - b).abs() < 1e-6, "pixel {i}: {a} became {b}");
            assert_eq!(map.point[i] == NO_POINT, a == 0.0);
        }
    }

    #[test]
    fn the_nearest_point_of_a_pixel_stays() {
        let along = |z: f64| K.unproject(7.0, 9.0, z).coords.cast::<f32>().into();
        let points = [along(0.8), along(0.5), along(0.9), [0.0, 0.0, -1.0], [f32::NAN; 3]];
        let map = DepthMap::of_points(&points, &K, &Isometry3::identity());
        assert_eq!(map.point[9 * 40 + 7], 1);
        assert_eq!(map.point.iter().filter(|&&p| p != NO_POINT).count(), 1);
    }

    proptest! {
        #[test]
        fn any_points_are_accepted(points in prop::collection::vec(prop::array::uniform3(prop::num::f32::ANY), 0..50)) {
            let map = DepthMap::of_points(&points, &K, &Isometry3::identity());
            prop_assert!(map.depth.metres.iter().all(|z| z.is_finite() && *z >= 0.0));
        }
    }
}
