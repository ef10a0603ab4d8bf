//! Normals of voxels: the plane through a voxel and its first and second ring of neighbours.
//!
//! The second moments of a ring are sums of the first moments of its members, so two passes over the adjacency give
//! every voxel its two rings. A voxel counts as often as there are ways to it, which weights the middle, as PCL does.

use super::voxel_grid::VoxelGrid;
use semascan_geometry::vector::{cross, dot};

/// Zeroth to second moments of a set of points: count, sums, and sums of products xx, xy, xz, yy, yz, zz.
#[derive(Clone, Copy, Debug, Default)]
struct Moments([f64; 10]);

impl Moments {
    fn of(p: [f32; 3]) -> Self {
        let [x, y, z] = p.map(f64::from);
        Self([1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z])
    }

    fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a += b;
        }
    }

    /// Covariance xx, xy, xz, yy, yz, zz.
    fn covariance(&self) -> [f64; 6] {
        let [n, sx, sy, sz, xx, xy, xz, yy, yz, zz] = self.0;
        let (x, y, z) = (sx / n, sy / n, sz / n);
        [xx / n - x * x, xy / n - x * y, xz / n - x * z, yy / n - y * y, yz / n - y * z, zz / n - z * z]
    }
}

/// Unit normal of each voxel, towards the sensor at the origin; zero where its neighbourhood is no surface.
pub(super) fn voxel_normals(grid: &VoxelGrid) -> Vec<[f32; 3]> {
    let own: Vec<Moments> = grid.positions.iter().map(|&p| Moments::of(p)).collect();
    let ring = |of: &[Moments], i: usize| {
        let mut sum = of[i];
        grid.neighbours(i as u32).iter().for_each(|&j| sum.add(&of[j as usize]));
        sum
    };
    let first: Vec<Moments> = (0..own.len()).map(|i| ring(&own, i)).collect();
    (0..own.len())
        .map(|i| {
            let mut all = ring(&first, i);
            all.add(&first[i]);
            all.add(&own[i]);
            let Some(n) = flattest(all.covariance()) else { return [0.0; 3] };
            let p = grid.positions[i];
            let away = dot(n, p.map(f64::from)) > 0.0;
            n.map(|c| if away { -c } else { c } as f32)
        })
        .collect()
}

/// Unit eigenvector of the smallest eigenvalue of a symmetric matrix (xx, xy, xz, yy, yz, zz); `None` where the two
/// smallest cannot be distinguished. Closed form after [Smith 1961].
fn flattest([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Option<[f64; 3]> {
    let scale = [xx, xy, xz, yy, yz, zz].iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    if !(scale.is_finite() && scale > 1e-20) {
        return None;
    }
    let [xx, xy, xz, yy, yz, zz] = [xx, xy, xz, yy, yz, zz].map(|c| c / scale);
    let mean = (xx + yy + zz) / 3.0;
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let p = ((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let angle = (determinant / (2.0 * p * p * p)).clamp(-1.0, 1.0).acos() / 3.0;
    let smallest = mean + 2.0 * p * (angle + std::f64::consts::TAU / 3.0).cos();
    let rows = [[xx - smallest, xy, xz], [xy, yy - smallest, yz], [xz, yz, zz - smallest]];
    // The rows span a plane; the longest of their cross products is the most exact normal of it.
    let crosses = [cross(rows[0], rows[1]), cross(rows[0], rows[2]), cross(rows[1], rows[2])];
    let best = crosses.into_iter().fold(([0.0; 3], 0.0), |best, c| {
        let length = dot(c, c);
        if length > best.1 { (c, length) } else { best }
    });
    // On a line both smaller eigenvalues are nought: any cross product is what rounding left.
    (best.1 > 1e-12).then(|| best.0.map(|x| x / best.1.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::super::points::ColoredPoints;
    use super::*;
    use nalgebra::{Matrix3, SymmetricEigen, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn flattest_agrees_with_nalgebra(
            r in prop::array::uniform9((-1_000_000..1_000_000_i32).prop_map(|k| f64::from(k) / 1e6)),
        ) {
            let root = Matrix3::from_row_slice(&r);
            let m = root * root.transpose();
            let eigen = SymmetricEigen::new(m);
            let mut order = [0, 1, 2];
            order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
            prop_assume!(eigen.eigenvalues[order[1]] - eigen.eigenvalues[order[0]] > 1e-3);
            let expected = eigen.eigenvectors.column(order[0]).into_owned();
            let found = flattest([m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]).expect("separate eigenvalues");
            let found = Vector3::from(found);
            prop_assert!((found.norm() - 1.0).abs() < 1e-9);
            prop_assert!(found.dot(&expected).abs() > 1.0 - 1e-9, "{} against {}", found, expected);
        }
    }

    #[test]
    fn a_tilted_sheet_has_its_normal_towards_the_sensor() {
        let truth = Vector3::new(0.3, -0.2, -0.9).normalize();
        let (s, t) = (truth.cross(&Vector3::x()).normalize(), truth.cross(&truth.cross(&Vector3::x())).normalize());
        let positions = (0..1600).map(|i| {
            let p = Vector3::new(0.0, 0.0, 0.6) + (s * f64::from(i % 40) + t * f64::from(i / 40)) * 0.002;
            [p.x as f32, p.y as f32, p.z as f32]
        });
        let points = ColoredPoints { positions: positions.collect(), colors: Vec::new() };
        let grid = VoxelGrid::new(&points, 0.006);
        for n in voxel_normals(&grid) {
            let n = Vector3::new(n[0], n[1], n[2]).cast::<f64>();
            assert!(n.dot(&truth) > 1.0 - 1e-6, "{n:?}");
        }
    }

    #[test]
    fn a_line_or_a_point_has_none() {
        for step in [0.0, 0.004_f32] {
            let positions = (0..50).map(|i| [0.1 + i as f32 * step, 0.2, 0.5]).collect();
            let grid = VoxelGrid::new(&ColoredPoints { positions, colors: Vec::new() }, 0.005);
            assert!(!grid.is_empty());
            assert!(voxel_normals(&grid).iter().all(|n| *n == [0.0; 3]));
        }
    }
}
