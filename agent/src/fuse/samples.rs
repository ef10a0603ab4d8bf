//! A view's pixels sorted by the voxel they fall into: the order that makes fusion independent of thread count.

use super::LabelledView;
use super::keys::pack;
use rayon::prelude::*;

/// One pixel in its voxel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Packed voxel address.
    pub(super) key: u64,
    /// Pixel index in the view.
    pub(super) pixel: u32,
    /// Position in voxel edges from the voxel's lowest corner.
    pub(super) offset: [f32; 3],
}

/// Every pixel with depth as a sample, sorted by (voxel, pixel). Points outside the addressable space are left out.
pub(super) fn sorted_samples(view: &LabelledView, edge: f64) -> Vec<Sample> {
    let transform = view.table_from_camera.to_matrix();
    let scale = 1.0 / edge;
    let rotation = transform.fixed_view::<3, 3>(0, 0) * scale;
    let translation = view.table_from_camera.translation.vector * scale;
    let place = |pixel: usize| {
        let p = rotation * view.cloud.point(pixel)?.coords + translation;
        let lowest = [p.x.floor(), p.y.floor(), p.z.floor()];
        if lowest.iter().any(|c| !c.is_finite() || c.abs() > f64::from(i32::MAX / 2)) {
            return None;
        }
        let offset = [(p.x - lowest[0]) as f32, (p.y - lowest[1]) as f32, (p.z - lowest[2]) as f32];
        Some(Sample { key: pack(lowest.map(|c| c as i32))?, pixel: pixel as u32, offset })
    };
    let mut samples: Vec<Sample> = (0..view.cloud.depth.len()).into_par_iter().filter_map(place).collect();
    samples.par_sort_unstable_by_key(|s| (s.key, s.pixel));
    samples
}
