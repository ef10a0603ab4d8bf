//! On which side of a surface a point lies: the sign of its distance.
//!
//! The normal at the nearest point decides, where edges and corners have angle-weighted normals [Baerentzen 2005]:
//! exact for closed surfaces whose triangles turn the same way. Beside an open border the sign is that of the side seen
//! from there.

use super::surface_index::{Feature, Nearest};
use glam::Vec3;
use std::collections::HashMap;

/// Normals of a mesh's faces, edges and corners.
#[derive(Clone, Debug)]
pub struct PseudoNormals {
    /// By triangle: the face, its three edges (from corner k to the next), its three corners. Not of unit length.
    normals: Vec<Normals>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Normals {
    face: Vec3,
    edges: [Vec3; 3],
    corners: [Vec3; 3],
}

impl PseudoNormals {
    /// Normals of triangles of `positions`, counter-clockwise seen from outside. Vertices at the same place count as one.
    pub fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let mut places: HashMap<[u32; 3], u32> = HashMap::new();
        // Adding zero makes -0.0 the same place as 0.0.
        let mut place = |p: &[f32; 3]| -> u32 {
            let next = places.len() as u32;
            *places.entry(p.map(|c| (c + 0.0).to_bits())).or_insert(next)
        };
        let welded: Vec<u32> = positions.iter().map(&mut place).collect();
        let usable = |t: &[u32; 3]| t.iter().all(|&i| (i as usize) < positions.len());
        let mut corner_sums = vec![Vec3::ZERO; places.len()];
        let mut edge_sums: HashMap<(u32, u32), Vec3> = HashMap::new();
        let mut faces = Vec::with_capacity(triangles.len());
        for t in triangles {
            let mut face = Vec3::ZERO;
            if usable(t) {
                let at = t.map(|i| Vec3::from_array(positions[i as usize]));
                let ids = t.map(|i| welded[i as usize]);
                face = (at[1] - at[0]).cross(at[2] - at[0]).normalize_or_zero();
                for k in 0..3 {
                    let (to_next, to_last) = (at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]);
                    let angle = to_next.angle_between(to_last);
                    corner_sums[ids[k] as usize] += face * if angle.is_finite() { angle } else { 0.0 };
                    *edge_sums.entry(key(ids[k], ids[(k + 1) % 3])).or_default() += face;
                }
            }
            faces.push(face);
        }
        Self {
            normals: triangles
                .iter()
                .zip(faces)
                .map(|(t, face)| {
                    if !usable(t) {
                        return Normals::default();
                    }
                    let ids = t.map(|i| welded[i as usize]);
                    Normals {
                        face,
                        edges: [0, 1, 2]
                            .map(|k| edge_sums.get(&key(ids[k], ids[(k + 1) % 3])).copied().unwrap_or(face)),
                        corners: ids.map(|i| corner_sums[i as usize]),
                    }
                })
                .collect(),
        }
    }

    /// The outward normal at the point that `nearest` found; zero where there is none. Not of unit length.
    pub fn at(&self, nearest: &Nearest) -> [f32; 3] {
        let Some(n) = self.normals.get(nearest.triangle as usize) else { return [0.0; 3] };
        match nearest.feature {
            Feature::Face => n.face,
            Feature::Edge(k) => n.edges.get(usize::from(k)).copied().unwrap_or(n.face),
            Feature::Corner(k) => n.corners.get(usize::from(k)).copied().unwrap_or(n.face),
        }
        .to_array()
    }

    /// The distance from `p` to the surface, negative inside; `nearest` is what [`super::SurfaceIndex`] found for it.
    pub fn signed_distance(&self, p: [f32; 3], nearest: &Nearest) -> f32 {
        let away = Vec3::from_array(p) - Vec3::from_array(nearest.point);
        let outside = away.dot(Vec3::from_array(self.at(nearest))) >= 0.0;
        if outside { nearest.distance } else { -nearest.distance }
    }
}

fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

#[cfg(test)]
mod tests {
    use super::super::SurfaceIndex;
    use super::*;

    /// An L of two unit cubes in a row and one on top: convex and concave edges. Every triangle has vertices of its own.
    fn ell() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let solid = |x: i32, y: i32, z: i32| y == 0 && ((z == 0 && (0..2).contains(&x)) || (z == 1 && x == 0));
        let mut positions = Vec::new();
        for (x, z) in [(0, 0), (1, 0), (0, 1)] {
            for (axis, side) in [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)] {
                let mut step = [0, 0, 0];
                step[axis] = side;
                if solid(x + step[0], step[1], z + step[2]) {
                    continue;
                }
                let corner = |u: i32, v: i32| {
                    let mut c = [x as f32, 0.0, z as f32];
                    c[axis] += (side + 1) as f32 / 2.0;
                    c[(axis + 1) % 3] += u as f32;
                    c[(axis + 2) % 3] += v as f32;
                    c
                };
                let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let order = if side > 0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                positions.extend(order.map(|k: usize| quad[k]));
            }
        }
        let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        (positions, triangles)
    }

    #[test]
    fn the_sign_is_right_everywhere_around_edges_and_corners() {
        let (positions, triangles) = ell();
        let index = SurfaceIndex::new(&positions, &triangles);
        let normals = PseudoNormals::new(&positions, &triangles);
        let (mut inside, mut features) = (0, [0; 3]);
        for i in 0..24 * 24 * 24 {
            // No point lies on the surface itself.
            let p = [i % 24, i / 24 % 24, i / 576].map(|k| k as f32 * 0.131 - 0.513);
            let within = |x: f32, z: f32| {
                (x..x + 1.0).contains(&p[0]) && (0.0..1.0).contains(&p[1]) && (z..z + 1.0).contains(&p[2])
            };
            let truth = within(0.0, 0.0) || within(1.0, 0.0) || within(0.0, 1.0);
            let nearest = index.closest(p).expect("a surface");
            let signed = normals.signed_distance(p, &nearest);
            assert_eq!(signed < 0.0, truth, "{p:?}: {nearest:?}");
            assert_eq!(signed.abs(), nearest.distance);
            inside += u32::from(truth);
            match nearest.feature {
                Feature::Face => features[0] += 1,
                Feature::Edge(_) => features[1] += 1,
                Feature::Corner(_) => features[2] += 1,
            }
        }
        assert!(inside > 500 && features.iter().all(|f| *f > 200), "{inside}, {features:?}");
    }

    #[test]
    fn broken_triangles_have_no_side() {
        let normals = PseudoNormals::new(&[[0.0; 3]; 3], &[[0, 1, 2], [0, 1, 9]]);
        for triangle in 0..3 {
            let nearest = Nearest { distance: 1.0, point: [0.0; 3], triangle, vertex: 0, feature: Feature::Corner(1) };
            assert_eq!(normals.at(&nearest), [0.0; 3]);
            assert_eq!(normals.signed_distance([1.0, 0.0, 0.0], &nearest), 1.0);
        }
    }
}
