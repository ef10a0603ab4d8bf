//! Map stitching ([Eye-in-hand 2020], section 3.3): the object's points of each view join its cloud if the
//! gravity-centre test takes them for the same object, with voxel filtering.

use semascan_perception::fuse::{GravityCentre, ObjectCloud, by_gravity_centre};
use semascan_perception::segment::geometric::{ColoredPoints, VoxelGrid};

/// Voxel of the filter, metres.
const VOXEL: f32 = 1e-3;

/// An object's cloud as it grows.
#[derive(Clone, Debug, Default)]
pub(super) struct Stitched {
    cloud: Vec<[f32; 3]>,
    /// Views that were not taken for the object.
    pub(super) misidentified: u32,
}

impl Stitched {
    /// Adds the object's points of a view, or counts it as misidentified.
    pub(super) fn add(&mut self, points: &[[f32; 3]]) {
        let object = |points: &[[f32; 3]]| ObjectCloud { instance: 1, class: 1, points: points.to_vec() };
        let model: Vec<_> = if self.cloud.is_empty() { Vec::new() } else { vec![object(&self.cloud)] };
        let association = by_gravity_centre(&[object(points)], &model, 1, &GravityCentre::default());
        if association.misidentified.is_empty() {
            self.cloud.extend(points);
            self.cloud = filtered(std::mem::take(&mut self.cloud));
        } else {
            self.misidentified += 1;
        }
    }

    /// The cloud.
    pub(super) fn into_points(self) -> Vec<[f32; 3]> {
        self.cloud
    }
}

/// One point, the mean, a voxel.
fn filtered(positions: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
    VoxelGrid::new(&ColoredPoints { positions, colors: Vec::new() }, VOXEL).positions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_join_unless_they_lie_elsewhere() {
        let sheet = |z: f32| -> Vec<[f32; 3]> {
            (0..3600).map(|i| [(i % 60) as f32 * 5e-4, (i / 60) as f32 * 5e-4, z]).collect()
        };
        let mut stitched = Stitched::default();
        stitched.add(&sheet(0.0));
        let once = stitched.cloud.len();
        assert!((850..1100).contains(&once), "{once}");
        // However many views show it, a surface is at most two voxels thick.
        for k in 1..6 {
            stitched.add(&sheet(k as f32 * 1e-4));
        }
        assert!(stitched.cloud.len() <= 2 * once + once / 4, "{} after {once}", stitched.cloud.len());
        assert_eq!(stitched.misidentified, 0);
        stitched.add(&sheet(0.01));
        assert_eq!(stitched.misidentified, 1);
        assert!(stitched.into_points().iter().all(|p| p[2] < 5e-3));
    }
}
