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
    fn a_tilted_plane_measures_its_true_area() {
        // Voxels of 1 cm whose corners lie on both sides of a plane through the middle of a 1 m cube of them.
        for normal in [[0.0, 0.0, 1.0], [0.0, -0.5, 0.866_025_4], [0.267_261_24, 0.534_522_5, 0.801_783_7]] {
            let (voxel, edge) = (0.01_f32, 100);
            let side = |x: i32, y: i32, z: i32| {
                let p = [x, y, z].map(|c| (c as f32 - 50.37) * voxel);
                p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2] > 0.0
            };
            let mut area = 0.0;
            for x in 0..edge {
                for y in 0..edge {
                    // Far enough above and below that the plane stays inside.
                    for z in -edge..2 * edge {
                        let first = side(x, y, z);
                        let crossed = (1..8).any(|c| side(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) != first);
                        area += if crossed { surfel_area(normal, voxel) } else { 0.0 };
                    }
                }
            }
            // The square that the plane covers, seen along z, is 1 m2.
            let truth = 1.0 / normal[2];
            assert!((area / truth - 1.0).abs() < 0.03, "{normal:?}: {area} for {truth}");
        }
    }
}
