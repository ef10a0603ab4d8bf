//! Ray casting and nearest-surface queries on triangle meshes.
//!
//! Rays use the eight-wide compressed hierarchy of the `obvhs` crate (H. Ylitie et al., "Efficient incoherent ray
//! traversal on GPUs through compressed wide BVHs", 2017); the nearest-point query walks its binary hierarchy, as the
//! crate offers none. Hierarchies are built on one thread, so that ties at shared edges fall the same way every time.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use crate::acquire::TrueMesh;

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle.
    pub triangle: u32,
    /// Distance from the origin in units of the direction's length.
    pub t: f32,
    /// Weights of the triangle's second and third corner.
    pub barycentric: [f32; 2],
}

/// Triangles ready to be hit by rays.
pub struct RayScene {
    hierarchy: CwBvh,
    /// In the hierarchy's order.
    triangles: Vec<RtTriangle>,
}

impl std::fmt::Debug for RayScene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RayScene({} triangles)", self.triangles.len())
    }
}

impl RayScene {
    /// Builds the hierarchy. Triangles that name a vertex past the end are as good as absent: they collapse to a point.
    pub fn new(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let corners = corners_of(vertices, triangles);
        let hierarchy = on_one_thread(|| build_cwbvh(&corners, BvhBuildParams::medium_build(), &mut Default::default()));
        let triangles = hierarchy.primitive_indices.iter().map(|&i| (&corners[i as usize]).into()).collect();
        Self { hierarchy, triangles }
    }

    /// The first surface along a ray, from either side.
    #[inline]
    pub fn first_hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let ray = Ray::new_inf(origin.into(), direction.into());
        let mut hit = RayHit::none();
        if !self.hierarchy.ray_traverse(ray, &mut hit, |ray, i| self.triangles[i].intersect(ray)) {
            return None;
        }
        let uv = barycentric(&self.triangles[hit.primitive_id as usize], &ray);
        let triangle = self.hierarchy.primitive_indices[hit.primitive_id as usize];
        Some(Hit { triangle, t: hit.t, barycentric: uv })
    }

    /// Whether anything lies between `origin` and `origin + length * direction`.
    #[inline]
    pub fn is_blocked(&self, origin: Vec3, direction: Vec3, length: f32) -> bool {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, length);
        !self.hierarchy.ray_traverse_miss(ray, |ray, i| self.triangles[i].intersect(ray))
    }
}

/// Weights of the second and third corner where `ray` meets the plane of `t`.
fn barycentric(t: &RtTriangle, ray: &Ray) -> [f32; 2] {
    let c = t.v0 - ray.origin;
    let r = ray.direction.cross(c);
    let inverse = 1.0 / t.ng.dot(ray.direction);
    [r.dot(t.e2) * inverse, r.dot(t.e1) * inverse]
}

fn corners_of(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<Triangle> {
    let corner = |i: u32| vertices.get(i as usize).map_or(Vec3A::ZERO, |v| Vec3A::from_array(*v));
    triangles.iter().map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) }).collect()
}

fn on_one_thread<T: Send>(build: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(build),
        Err(_) => build(),
    }
}

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
            let Some(node) = self.hierarchy.nodes.get(node).filter(|_| bound <= limit) else { continue };
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
    use super::super::noise::{hash, unit};
    use super::*;

    /// A crumpled sheet.
    fn sheet() -> TrueMesh {
        let n = 24_u32;
        let height = |i: u32| unit(hash(i)) * 0.02;
        let vertices = (0..n * n).map(|i| [(i % n) as f32 * 0.01, (i / n) as f32 * 0.01, height(i)]).collect();
        let quads = (0..(n - 1) * (n - 1)).map(|i| i % (n - 1) + i / (n - 1) * n);
        let triangles = quads.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect();
        TrueMesh { vertices, triangles, ..TrueMesh::default() }
    }

    fn random_point(i: u32) -> Vec3 {
        let draw = |k| unit(hash(i * 3 + k + 9000));
        Vec3::new(draw(0) * 0.3 - 0.03, draw(1) * 0.3 - 0.03, draw(2) * 0.1 - 0.04)
    }

    #[test]
    fn hits_agree_with_brute_force() {
        let mesh = sheet();
        let scene = RayScene::new(&mesh.vertices, &mesh.triangles);
        let corners = corners_of(&mesh.vertices, &mesh.triangles);
        let mut met = 0;
        for i in 0..400 {
            let (origin, target) = (random_point(i) + Vec3::Z * 0.2, random_point(i + 5000));
            let ray = Ray::new_inf(origin.into(), (target - origin).into());
            let t = corners.iter().map(|c| RtTriangle::from(c).intersect(&ray)).fold(f32::INFINITY, f32::min);
            let hit = scene.first_hit(origin, target - origin);
            assert_eq!(hit.map_or(f32::INFINITY, |h| h.t), t);
            assert_eq!(scene.is_blocked(origin, target - origin, 1.0), t < 1.0);
            if let Some(hit) = hit {
                met += 1;
                let c = corners[hit.triangle as usize];
                let [u, v] = hit.barycentric;
                let on_triangle = Vec3::from(c.v0 * (1.0 - u - v) + c.v1 * u + c.v2 * v);
                assert!(on_triangle.distance(origin + (target - origin) * hit.t) < 1e-5);
            }
        }
        assert!(met > 100, "{met} hits");
    }

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
