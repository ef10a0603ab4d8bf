//! The shortest way along a mesh between two places on it.
//!
//! Noise makes a mesh rough and its edges too long: an edge counts by its projection on the planes that the normals at its
//! ends belong to ([`smooth_edge_length`]), as areas do. What is left is a share of the length.

use super::dimensions::{Estimate, grid_uncertainty};
use super::{Geodesics, NearestPoints};
use crate::mesh::adjacency::{Lists, neighbours};
use crate::vector::{dot, sub, unit};
use semascan_model::SemanticMesh;
use std::ops::Deref;

/// Least share of an edge's length that counts where the normals at its ends say that it is steep: noise makes it so.
const LEAST_SHARE: f64 = 0.5;
/// How far from a place its way begins or ends on the mesh, voxels.
const REACH: f32 = 1.5;
/// Standard uncertainty of lengths on a mesh, a share of the length.
const METRIC: f64 = 0.01;

/// Length of the edge between two vertices along the surface, metres.
pub fn smooth_edge_length(mesh: &SemanticMesh, a: u32, b: u32) -> f64 {
    let position = |v: u32| mesh.vertices.positions[v as usize].map(f64::from);
    let normal = |v: u32| unit(mesh.vertices.normals[v as usize].map(f64::from), 0.1);
    let edge = sub(position(b), position(a));
    let squared = dot(edge, edge);
    let (Some(n), Some(m)) = (normal(a), normal(b)) else { return squared.sqrt() };
    let Some(mean) = unit([0, 1, 2].map(|k| n[k] + m[k]), 0.1) else { return squared.sqrt() };
    let across = dot(edge, mean);
    (squared - across * across).max(LEAST_SHARE * LEAST_SHARE * squared).sqrt()
}

/// A mesh on which ways are looked for.
pub struct SurfaceWays<M> {
    mesh: M,
    geodesics: Geodesics,
    nearest: NearestPoints,
    voxel: f32,
}

/// A way along the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceWay {
    /// Its length, metres.
    pub length: Estimate,
    /// Its points, from the first place to the second, metres.
    pub points: Vec<[f32; 3]>,
}

impl<M: Deref<Target = SemanticMesh>> SurfaceWays<M> {
    /// Prepares `mesh`, which was made of voxels of edge `voxel` (metres). Faces with a vertex that is not there are left out.
    pub fn new(mesh: M, voxel: f32) -> Self {
        let whole: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| mesh.corners(**t).is_some()).copied().collect();
        let beside = neighbours(mesh.len(), &whole);
        let corners: Vec<(u32, u32)> = (0..).zip(&whole).flat_map(|(face, t)| t.map(|v| (v, face))).collect();
        let around = Lists::new(mesh.len(), &corners);
        let geodesics = Geodesics::new(
            mesh.len() as u32,
            |v| beside.of(v as usize).iter().copied(),
            |v| around.of(v as usize).iter().map(|face| whole[*face as usize]),
            |a, b| smooth_edge_length(&mesh, a, b),
        );
        let nearest = NearestPoints::new(&mesh.vertices.positions);
        Self { mesh, geodesics, nearest, voxel }
    }

    /// The shortest way between two places near the mesh, metres; `None` where none leads from one to the other.
    pub fn shortest(&self, from: [f32; 3], to: [f32; 3]) -> Option<SurfaceWay> {
        let found = self.geodesics.distances(&self.beside(from));
        let ends = self.beside(to).into_iter().map(|(v, away)| (v, found.metres[v as usize] + away));
        let (last, value) = ends.filter(|(_, length)| length.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut points = vec![to];
        points.extend(found.way_to(last).into_iter().map(|v| self.mesh.vertices.positions[v as usize]));
        points.push(from);
        points.reverse();
        let ends = 2.0_f64.sqrt() * grid_uncertainty(self.voxel.into());
        Some(SurfaceWay { length: Estimate { value, standard_uncertainty: ends.hypot(METRIC * value) }, points })
    }

    /// The vertices around a place and their distances from it, metres; at least the nearest one.
    fn beside(&self, place: [f32; 3]) -> Vec<(u32, f64)> {
        let mut beside = Vec::new();
        self.nearest.within(place, REACH * self.voxel, |n| beside.push((n.index, n.distance())));
        if beside.is_empty() {
            beside.extend(self.nearest.nearest(place).map(|n| (n.index, n.distance())));
        }
        beside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    /// A quarter pipe of radius 20 mm along x, its vertices a voxel of a millimetre apart, rough by a tenth of it.
    fn pipe() -> SemanticMesh {
        let (rows, columns) = (32_u32, 40_u32);
        let mut mesh = SemanticMesh::default();
        for (i, j) in (0..=columns).flat_map(|i| (0..=rows).map(move |j| (i, j))) {
            let (sine, cosine) = (j as f32 / rows as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
            let radius = 20e-3 + if (i + j) % 2 == 0 { 1e-4 } else { -1e-4 };
            let (position, normal) = ([i as f32 * 1e-3, radius * cosine, radius * sine], [0.0, cosine, sine]);
            mesh.push(SemanticPoint { position, normal, ..SemanticPoint::UNKNOWN }, false);
        }
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let a = i * (rows + 1) + j;
            mesh.triangles.extend([[a, a + rows + 1, a + rows + 2], [a, a + rows + 2, a + 1]]);
        }
        mesh
    }

    #[test]
    fn a_way_around_a_pipe_is_a_helix() {
        let mesh = pipe();
        let ways = SurfaceWays::new(&mesh, 1e-3);
        let place = |x: f32, degrees: f32| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            [x, 20e-3 * cosine, 20e-3 * sine]
        };
        let way = ways.shortest(place(2.3e-3, 8.0), place(36.6e-3, 83.0)).expect("a way");
        let truth = (34.3e-3_f64).hypot(75_f64.to_radians() * 20e-3);
        let error = (way.length.value - truth).abs();
        assert!(error < 0.3e-3 && error < way.length.expanded(), "{:?} for {truth}", way.length);
        assert_eq!((way.points[0], way.points[way.points.len() - 1]), (place(2.3e-3, 8.0), place(36.6e-3, 83.0)));
        let mut apart = mesh.clone();
        let far = SemanticPoint { position: [1.0, 0.0, 0.0], ..SemanticPoint::UNKNOWN };
        apart.push(far, false);
        assert_eq!(SurfaceWays::new(&apart, 1e-3).shortest(place(0.0, 0.0), [1.0, 0.0, 0.0]), None);
        assert_eq!(SurfaceWays::new(&SemanticMesh::default(), 1e-3).shortest([0.0; 3], [1.0; 3]), None);
    }
}
