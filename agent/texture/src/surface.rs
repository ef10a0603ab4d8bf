//! The faces of the mesh, and which lie side by side.

use nalgebra::{Point3, Vector3};
use semascan_model::SemanticMesh;

/// A side of a face without another face, or with several.
pub(crate) const NO_FACE: u32 = u32::MAX;

/// A surface, ready to be looked at face by face. Table frame, metres.
#[derive(Debug)]
pub(crate) struct Surface {
    /// The places of the mesh's vertices.
    pub(crate) positions: Vec<Point3<f64>>,
    /// Triangles whose vertices are there and finite, in the mesh's order.
    pub(crate) faces: Vec<[u32; 3]>,
    /// The face beyond the side from each corner to the next one, or [`NO_FACE`].
    pub(crate) neighbours: Vec<[u32; 3]>,
    /// Unit normal of each face; zero where it has no area.
    pub(crate) normals: Vec<Vector3<f64>>,
    /// Area of each face, square metres.
    pub(crate) areas: Vec<f64>,
}

impl Surface {
    pub(crate) fn of(mesh: &SemanticMesh) -> Self {
        let positions: Vec<Point3<f64>> =
            mesh.vertices.positions.iter().map(|p| Point3::from(p.map(f64::from))).collect();
        let is_finite = |v: &u32| positions[*v as usize].iter().all(|c| c.is_finite());
        let is_whole = |t: &&[u32; 3]| mesh.corners(**t).is_some() && t.iter().all(is_finite);
        let faces: Vec<[u32; 3]> = mesh.triangles.iter().filter(is_whole).copied().collect();
        let crosses = faces.iter().map(|face| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(&(c - a))
        });
        let (normals, areas) =
            crosses.map(|cross| (cross.try_normalize(0.0).unwrap_or_else(Vector3::zeros), 0.5 * cross.norm())).unzip();
        Self { neighbours: neighbours(&faces), positions, faces, normals, areas }
    }

    /// The corners of a face.
    pub(crate) fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        self.faces[face].map(|v| self.positions[v as usize])
    }

    /// Its middle.
    #[cfg(test)]
    pub(crate) fn middle(&self, face: usize) -> Point3<f64> {
        let [a, b, c] = self.corners(face);
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    /// Faces beside a face.
    pub(crate) fn beside(&self, face: usize) -> impl Iterator<Item = usize> {
        self.neighbours[face].into_iter().filter(|other| *other != NO_FACE).map(|other| other as usize)
    }
}

/// Where more than two faces share a side, none of them has a neighbour there.
fn neighbours(faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut sides: Vec<((u32, u32), u32, usize)> = Vec::with_capacity(3 * faces.len());
    for (number, face) in faces.iter().enumerate() {
        for side in 0..3 {
            let (a, b) = (face[side], face[(side + 1) % 3]);
            sides.push(((a.min(b), a.max(b)), number as u32, side));
        }
    }
    sides.sort_unstable();
    let mut neighbours = vec![[NO_FACE; 3]; faces.len()];
    for shared in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a, side_of_a), (_, b, side_of_b)] = *shared {
            neighbours[a as usize][side_of_a] = b;
            neighbours[b as usize][side_of_b] = a;
        }
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    #[test]
    fn faces_know_what_lies_beside_them() {
        let mut mesh = SemanticMesh::default();
        for position in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [f32::NAN; 3]] {
            mesh.push(SemanticPoint { position, ..SemanticPoint::UNKNOWN }, false);
        }
        mesh.triangles = vec![[0, 1, 2], [1, 3, 2], [0, 1, 5], [7, 1, 2]];
        let surface = Surface::of(&mesh);
        assert_eq!(surface.faces, [[0, 1, 2], [1, 3, 2]], "what names no place is left out");
        assert_eq!(surface.neighbours, [[NO_FACE, 1, NO_FACE], [NO_FACE, NO_FACE, 0]]);
        assert_eq!((surface.normals[0], surface.areas[0]), (Vector3::z(), 0.5));
        mesh.triangles = vec![[0, 1, 2], [1, 3, 2], [2, 1, 4]];
        assert!(Surface::of(&mesh).neighbours.iter().flatten().all(|other| *other == NO_FACE), "three share a side");
    }
}
