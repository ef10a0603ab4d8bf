//! Which vertices of the model lie in a patch of its surface.
//!
//! - `Points`: those nearer than the radius to one of the points.
//! - `Voxels`: those in one of the cells.
//! - `Outline`: those within the closed curve. The curve is seen along its mean normal (Newell's method), and a flood over the
//!   edges of the mesh begins at its inner side: so surface that only lies behind the curve, such as the back of a plate, is
//!   not within it. A curve that encloses more than half of a turn of a surface has no inside of this kind.

use super::NearestPoints;
use glam::{DVec2, DVec3};
use semascan_model::SemanticMesh;
use semascan_model::review::SurfacePatch;
use std::collections::HashSet;

/// Distance from a curve, in edges of the mesh, within which a flood begins.
const REACH: f64 = 2.0;
/// Least cosine between the normal of a vertex within an outline and the mean normal along the curve.
const LEAST_FACING: f64 = -0.2;

/// The surface that patches lie on.
pub struct PatchSurface<'a> {
    mesh: &'a SemanticMesh,
    nearest: NearestPoints,
    /// Vertices around each vertex: those of `v` are `around[first[v]..first[v + 1]]`.
    first: Vec<usize>,
    around: Vec<u32>,
    /// Mean length of an edge, metres.
    spacing: f64,
}

impl<'a> PatchSurface<'a> {
    /// Prepares `mesh`. Faces with a vertex that is not there are left out.
    pub fn new(mesh: &'a SemanticMesh) -> Self {
        let whole = || mesh.triangles.iter().filter(|t| mesh.corners(**t).is_some());
        let mut first = vec![0_usize; mesh.len() + 1];
        whole().flatten().for_each(|v| first[*v as usize + 1] += 2);
        for v in 0..mesh.len() {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut around = vec![0; first[mesh.len()]];
        let (mut edges, mut count) = (0.0, 0_u32);
        for t in whole() {
            for k in 0..3 {
                let (v, others) = (t[k] as usize, [t[(k + 1) % 3], t[(k + 2) % 3]]);
                around[next[v]..next[v] + 2].copy_from_slice(&others);
                next[v] += 2;
                edges += position(mesh, t[k]).distance(position(mesh, others[0]));
                count += 1;
            }
        }
        let nearest = NearestPoints::new(&mesh.vertices.positions);
        Self { mesh, nearest, first, around, spacing: edges / f64::from(count.max(1)) }
    }

    /// Whether one of the points lies on the surface, or as near to a vertex as its neighbours are.
    pub fn is_near(&self, points: &[[f64; 3]]) -> bool {
        let reach = self.spacing as f32;
        points.iter().any(|point| self.nearest.nearest_within(point.map(|c| c as f32), reach).is_some())
    }

    /// The vertices of `patch`, in order.
    pub fn vertices_of(&self, patch: &SurfacePatch) -> Vec<u32> {
        match patch {
            SurfacePatch::Points { points, radius } => {
                let mut is_in = vec![false; self.mesh.len()];
                for point in points {
                    self.nearest.within(point.map(|c| c as f32), *radius as f32, |n| is_in[n.index as usize] = true);
                }
                (0..).zip(is_in).filter_map(|(v, is_in)| is_in.then_some(v)).collect()
            }
            SurfacePatch::Voxels { edge, cells } => {
                let cells: HashSet<[i32; 3]> = cells.iter().copied().collect();
                let cell = |p: &[f32; 3]| p.map(|c| (f64::from(c) / edge).floor() as i32);
                let positions = (0..).zip(&self.mesh.vertices.positions);
                positions.filter(|(_, p)| cells.contains(&cell(p))).map(|(v, _)| v).collect()
            }
            SurfacePatch::Outline { outline } => self.within_curve(outline),
        }
    }

    /// The vertices within a closed curve (metres, table frame), in order; none where the curve has no area.
    pub fn within_curve(&self, curve: &[[f64; 3]]) -> Vec<u32> {
        let Some(frame) = CurveFrame::of(curve) else { return Vec::new() };
        let seeds = self.beside_curve(curve);
        let normals = seeds.iter().map(|v| normal(self.mesh, *v));
        let facing = normals.sum::<DVec3>().normalize_or_zero();
        let is_in = |v: u32| {
            let normal = normal(self.mesh, v);
            let faces = normal == DVec3::ZERO || facing == DVec3::ZERO || normal.dot(facing) >= LEAST_FACING;
            faces && frame.encloses(position(self.mesh, v))
        };
        let mut seen = vec![false; self.mesh.len()];
        let mut open: Vec<u32> = Vec::new();
        for v in seeds {
            if !seen[v as usize] && is_in(v) {
                seen[v as usize] = true;
                open.push(v);
            }
        }
        let mut within = Vec::new();
        while let Some(v) = open.pop() {
            within.push(v);
            for &next in &self.around[self.first[v as usize]..self.first[v as usize + 1]] {
                if !seen[next as usize] && is_in(next) {
                    seen[next as usize] = true;
                    open.push(next);
                }
            }
        }
        within.sort_unstable();
        within
    }

    /// Vertices near a curve.
    fn beside_curve(&self, curve: &[[f64; 3]]) -> Vec<u32> {
        const MOST_STEPS: f64 = 10_000.0;
        let mut is_beside = vec![false; self.mesh.len()];
        for (from, to) in curve.iter().zip(curve.iter().cycle().skip(1)) {
            let (from, to) = (DVec3::from_array(*from), DVec3::from_array(*to));
            let steps = (from.distance(to) / self.spacing.max(1e-9)).ceil().clamp(1.0, MOST_STEPS) as u32;
            for step in 0..steps {
                let point = from.lerp(to, f64::from(step) / f64::from(steps)).as_vec3().to_array();
                let reach = (REACH * self.spacing) as f32;
                self.nearest.within(point, reach, |n| is_beside[n.index as usize] = true);
            }
        }
        (0..).zip(is_beside).filter_map(|(v, is_beside)| is_beside.then_some(v)).collect()
    }
}

fn position(mesh: &SemanticMesh, v: u32) -> DVec3 {
    DVec3::from_array(mesh.vertices.positions[v as usize].map(f64::from))
}

fn normal(mesh: &SemanticMesh, v: u32) -> DVec3 {
    DVec3::from_array(mesh.vertices.normals[v as usize].map(f64::from))
}

/// A closed curve, seen along its mean normal.
struct CurveFrame {
    across: DVec3,
    down: DVec3,
    polygon: Vec<DVec2>,
}

impl CurveFrame {
    /// `None` where the curve has no area.
    fn of(curve: &[[f64; 3]]) -> Option<Self> {
        let points: Vec<DVec3> = curve.iter().map(|p| DVec3::from_array(*p)).collect();
        let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let pairs = points.iter().zip(points.iter().cycle().skip(1));
        let doubled: DVec3 = pairs.map(|(a, b)| (*a - middle).cross(*b - middle)).sum();
        let normal = doubled.try_normalize()?;
        let (across, down) = normal.any_orthonormal_pair();
        let polygon = points.iter().map(|p| DVec2::new(p.dot(across), p.dot(down))).collect();
        Some(Self { across, down, polygon })
    }

    /// Whether a point lies within the curve as it is seen (even-odd rule).
    fn encloses(&self, point: DVec3) -> bool {
        let p = DVec2::new(point.dot(self.across), point.dot(self.down));
        let mut is_in = false;
        for (a, b) in self.polygon.iter().zip(self.polygon.iter().cycle().skip(1)) {
            if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                is_in = !is_in;
            }
        }
        is_in
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    fn sheet(columns: u32, rows: u32, vertex: impl Fn(u32, u32) -> SemanticPoint) -> SemanticMesh {
        let mut mesh = SemanticMesh::default();
        for j in 0..=rows {
            for i in 0..=columns {
                mesh.push(vertex(i, j), false);
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let a = j * (columns + 1) + i;
                let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        mesh
    }

    /// A plate of component 1 in the plane z = 0 that faces upwards, 40 mm wide, its vertices 1 mm apart.
    fn plate() -> SemanticMesh {
        sheet(40, 40, |i, j| {
            let position = [i as f32 * 1e-3 - 0.02, j as f32 * 1e-3 - 0.02, 0.0];
            SemanticPoint { position, normal: [0.0, 0.0, 1.0], label: 1, confidence: 1.0, ..SemanticPoint::UNKNOWN }
        })
    }

    /// The side of an upright cylinder of component 1, 40 mm high; its vertices are 4 degrees and 1 mm apart.
    fn cylinder(radius: f32) -> SemanticMesh {
        sheet(90, 40, |i, j| {
            let (sine, cosine) = (i as f32 * 4.0).to_radians().sin_cos();
            let position = [radius * cosine, radius * sine, j as f32 * 1e-3];
            SemanticPoint { position, normal: [cosine, sine, 0.0], label: 1, confidence: 1.0, ..SemanticPoint::UNKNOWN }
        })
    }

    /// Indices of the vertices for which `keep` holds.
    fn those(mesh: &SemanticMesh, keep: impl Fn(DVec3) -> bool) -> Vec<u32> {
        (0..mesh.len() as u32).filter(|v| keep(position(mesh, *v))).collect()
    }

    #[test]
    fn points_and_cells_take_the_surface_that_they_name() {
        let mesh = plate();
        let surface = PatchSurface::new(&mesh);
        let points = vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]];
        let found = surface.vertices_of(&SurfacePatch::Points { points, radius: 4.3e-3 });
        let near = |p: DVec3| p.length() < 4.3e-3 || p.distance(DVec3::new(0.01, 0.0, 0.0)) < 4.3e-3;
        assert_eq!(found, those(&mesh, near));
        assert!(found.len() > 20);
        let cells = vec![[0, 0, 0], [-1, 2, 0]];
        let found = surface.vertices_of(&SurfacePatch::Voxels { edge: 5.5e-3, cells });
        let cell = |p: DVec3| (p / 5.5e-3).floor();
        let wanted = [DVec3::ZERO, DVec3::new(-1.0, 2.0, 0.0)];
        assert_eq!(found, those(&mesh, |p| wanted.contains(&cell(p))));
        assert!(found.len() > 20);
    }

    #[test]
    fn an_outline_takes_what_lies_within_it_and_not_what_lies_behind() {
        // Two sheets that lie behind each other and are not joined.
        let mut mesh = plate();
        let back = plate();
        let first = mesh.len() as u32;
        for v in 0..back.len() {
            let mut vertex = back.vertices.get(v).expect("there");
            vertex.position[2] = -0.004;
            vertex.normal = [0.0, 0.0, -1.0];
            mesh.push(vertex, false);
        }
        mesh.triangles.extend(back.triangles.iter().map(|t| [t[0] + first, t[2] + first, t[1] + first]));
        let surface = PatchSurface::new(&mesh);
        let outline =
            vec![[-0.0105, -0.0105, 0.0], [0.0105, -0.0105, 0.0], [0.0105, 0.0105, 0.0], [-0.0105, 0.0105, 0.0]];
        let square = |p: DVec3| p.x.abs() < 0.0105 && p.y.abs() < 0.0105 && p.z > -0.001;
        let found = surface.within_curve(&outline);
        assert_eq!(found, those(&mesh, square));
        assert!(found.len() > 300);
        // The same curve the other way round.
        let turned: Vec<[f64; 3]> = outline.iter().rev().copied().collect();
        assert_eq!(surface.within_curve(&turned), found);
        assert!(surface.within_curve(&[[0.0; 3], [0.01, 0.0, 0.0], [0.02, 0.0, 0.0]]).is_empty(), "no area");
    }

    #[test]
    fn an_outline_on_a_curved_surface_takes_its_side_alone() {
        let mesh = cylinder(0.01);
        let surface = PatchSurface::new(&mesh);
        // A rectangle of 120 degrees on the side that faces +x.
        let at = |degrees: f64, z: f64| {
            let angle = degrees.to_radians();
            [0.01 * angle.cos(), 0.01 * angle.sin(), z]
        };
        let mut outline: Vec<[f64; 3]> = (-6..=6).map(|k| at(10.3 * f64::from(k), 0.0103)).collect();
        outline.extend((-6..=6).rev().map(|k| at(10.3 * f64::from(k), 0.0297)));
        let found = surface.within_curve(&outline);
        let inside = |p: DVec3| p.y.atan2(p.x).to_degrees().abs() < 61.8 && p.z > 0.0103 && p.z < 0.0297;
        let wanted = those(&mesh, inside);
        // Chords between the points of the curve leave some of the rim out.
        let missing = wanted.iter().filter(|v| !found.contains(v)).count();
        assert!(found.iter().all(|v| wanted.contains(v)) && missing * 20 < wanted.len(), "{missing}");
    }
}
