//! How far a point is from a surface: point-to-triangle distance, as the truth metrics need it.
//!
//! Walks the binary hierarchy of the `obvhs` crate, which offers rays but no nearest-point query.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::triangle::Triangle;

use super::raycast::{corners_of, on_one_thread};
use crate::acquire::TrueMesh;

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance in metres.
    pub distance: f32,
    /// The point on the surface.
    pub point: [f32; 3],
    /// Index of its triangle.
    pub triangle: u32,
    /// Index of the triangle's corner nearest to the point.
    pub vertex: u32,
}

/// A surface that answers how far a point is from it (point to triangle).
pub struct SurfaceIndex {
    hierarchy: Bvh2,
    corners: Vec<Triangle>,
    triangles: Vec<[u32; 3]>,
}

impl std::fmt::Debug for SurfaceIndex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SurfaceIndex({} triangles)", self.triangles.len())
    }
}

impl SurfaceIndex {
    /// Builds the index.
    pub fn new(mesh: &TrueMesh) -> Self {
        let corners = corners_of(&mesh.vertices, &mesh.triangles);
        let hierarchy = on_one_thread(|| build_bvh2(&corners, BvhBuildParams::medium_build(), &mut Default::default()));
        Self { hierarchy, corners, triangles: mesh.triangles.clone() }
    }

    /// The point of the surface nearest to `p`; `None` where the mesh has no triangle.
    pub fn closest(&self, p: [f32; 3]) -> Option<Nearest> {
        let p = Vec3A::from_array(p);
        let mut best: Option<(f32, u32, Vec3A)> = None;
        let mut pending = vec![(0.0_f32, 0_usize)];
        while let Some((bound, node)) = pending.pop() {
            let limit = best.map_or(f32::INFINITY, |b| b.0);
            let Some(node) = self.hierarchy.nodes.get(node).filter(|_| bound <= limit) else {
                continue;
            };
            let first = node.first_index as usize;
            if node.is_leaf() {
                for slot in first..first + node.prim_count as usize {
                    let id = self.hierarchy.primitive_indices[slot];
                    let q = closest_on_triangle(p, &self.corners[id as usize]);
                    let d = q.distance_squared(p);
                    // Equal distances go to the lower index, whatever the hierarchy's order.
                    if best.is_none_or(|b| d < b.0 || (d == b.0 && id < b.1)) {
                        best = Some((d, id, q));
                    }
                }
            } else {
                let bound = |i: usize| {
                    let b = self.hierarchy.nodes[i].aabb();
                    p.clamp(b.min, b.max).distance_squared(p)
                };
                let (left, right) = ((bound(first), first), (bound(first + 1), first + 1));
                let (near, far) = if left.0 <= right.0 { (left, right) } else { (right, left) };
                pending.extend([far, near]);
            }
        }
        best.map(|(d, triangle, q)| {
            let corners = &self.corners[triangle as usize];
            let ids = self.triangles[triangle as usize];
            let to = [corners.v0, corners.v1, corners.v2].map(|v| v.distance_squared(q));
            let vertex = if to[0] <= to[1] && to[0] <= to[2] {
                ids[0]
            } else if to[1] <= to[2] {
                ids[1]
            } else {
                ids[2]
            };
            Nearest { distance: d.sqrt(), point: q.to_array(), triangle, vertex }
        })
    }
}

/// C. Ericson, *Real-Time Collision Detection*, 5.1.5.
fn closest_on_triangle(p: Vec3A, t: &Triangle) -> Vec3A {
    let (ab, ac, ap) = (t.v1 - t.v0, t.v2 - t.v0, p - t.v0);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return t.v0;
    }
    let bp = p - t.v1;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return t.v1;
    }
    let cp = p - t.v2;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return t.v2;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return t.v0 + ab * (d1 / (d1 - d3));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return t.v0 + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return t.v1 + (t.v2 - t.v1) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let denominator = 1.0 / (va + vb + vc);
    t.v0 + ab * (vb * denominator) + ac * (vc * denominator)
}

#[cfg(test)]
mod tests {
    use super::super::raycast::tests::{random_point, sheet};
    use super::*;

    #[test]
    fn closest_agrees_with_brute_force() {
        let mesh = sheet();
        let index = SurfaceIndex::new(&mesh);
        let corners = corners_of(&mesh.vertices, &mesh.triangles);
        for i in 0..400 {
            let p = random_point(i);
            let all = corners.iter().map(|c| closest_on_triangle(p.into(), c).distance(p.into()));
            let expected = all.fold(f32::INFINITY, f32::min);
            let found = index.closest(p.to_array()).expect("the mesh has triangles");
            assert!((found.distance - expected).abs() < 1e-6, "{} against {expected}", found.distance);
            assert!(mesh.triangles[found.triangle as usize].contains(&found.vertex));
        }
        assert!(SurfaceIndex::new(&TrueMesh::default()).closest([0.0; 3]).is_none());
    }
}
