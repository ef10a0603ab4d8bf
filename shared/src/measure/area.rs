//! Surface area of a voxelised surface.
//!
//! A plane with unit normal n crosses `(|nx| + |ny| + |nz|) / v^2` voxels of edge v per unit of area (each axis-aligned
//! family of voxel faces is crossed once per projected cell), so one occupied voxel stands for the inverse of that.

/// Area in square metres that one occupied voxel of edge `voxel` (metres) stands for, given its unit `normal`.
///
/// A zero normal (unknown) counts as the mean over all directions (3/2).
pub fn surfel_area(normal: [f32; 3], voxel: f32) -> f32 {
    let crossing = normal[0].abs() + normal[1].abs() + normal[2].abs();
    voxel * voxel / if crossing > 0.5 { crossing } else { 1.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_square_measures_its_true_area() {
        // A unit square tilted by 30 deg about x, voxelised at 5 mm.
        let (voxel, tilt) = (0.005_f32, 30_f32.to_radians());
        let normal = [0.0, -tilt.sin(), tilt.cos()];
        let mut occupied = std::collections::HashSet::new();
        let steps = 2000;
        for i in 0..steps {
            for j in 0..steps {
                let (u, v) = (i as f32 / steps as f32, j as f32 / steps as f32);
                let p = [u, v * tilt.cos(), v * tilt.sin()];
                occupied.insert(p.map(|c| (c / voxel).floor() as i32));
            }
        }
        let area: f32 = occupied.iter().map(|_| surfel_area(normal, voxel)).sum();
        assert!((area - 1.0).abs() < 0.03, "{area}");
    }
}
