//! Ray casting on triangle meshes.
//!
//! Rays use the eight-wide compressed hierarchy of the `obvhs` crate [Ylitie 2017]. Hierarchies are built on one
//! thread, so that ties at shared edges fall the same way every time.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

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
        let hierarchy =
            on_one_thread(|| build_cwbvh(&corners, BvhBuildParams::medium_build(), &mut Default::default()));
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

#[cfg(test)]
pub(super) mod tests {
    use super::super::noise::{hash, unit};
    use super::*;
    use semascan_inspection::source::TrueMesh;

    /// A crumpled sheet.
    pub(in super::super) fn sheet() -> TrueMesh {
        let n = 24_u32;
        let height = |i: u32| unit(hash(i)) * 0.02;
        let vertices = (0..n * n).map(|i| [(i % n) as f32 * 0.01, (i / n) as f32 * 0.01, height(i)]).collect();
        let quads = (0..(n - 1) * (n - 1)).map(|i| i % (n - 1) + i / (n - 1) * n);
        let triangles = quads.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect();
        TrueMesh { vertices, triangles, ..TrueMesh::default() }
    }

    pub(in super::super) fn random_point(i: u32) -> Vec3 {
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
}
