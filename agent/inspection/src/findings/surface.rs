//! The model's surface as findings are looked for and measured on it: the mesh, what each vertex stands for, and which
//! vertices and faces lie beside each other.
//!
//! Every vertex stands for the area that the figures of the model give it ([`seen_vertex_areas`]): the areas of findings
//! and those of components and defects are sums of the same numbers.

use semascan_geometry::measure::{seen_vertex_areas, smooth_edge_length};
use semascan_geometry::vector::unit;
use semascan_model::SemanticMesh;

/// A mesh in the table frame, ready to be measured.
pub(crate) struct Surface<'a> {
    /// The mesh, as it was made: not smoothed, filled or simplified.
    pub(crate) mesh: &'a SemanticMesh,
    /// Edge of the voxels that it was made of, metres.
    pub(crate) voxel: f64,
    /// Area that each vertex stands for, square metres.
    pub(crate) areas: Vec<f64>,
    neighbours: Lists,
    faces: Lists,
}

impl<'a> Surface<'a> {
    /// Prepares `mesh`, which was made of voxels of edge `voxel` (metres). Faces with a vertex that is not there are left out.
    pub(crate) fn new(mesh: &'a SemanticMesh, voxel: f64) -> Self {
        let whole = || (0_u32..).zip(&mesh.triangles).filter(|(_, t)| mesh.corners(**t).is_some());
        let pairs = || whole().flat_map(|(_, &[a, b, c])| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]);
        let faces_of_corners = || whole().flat_map(|(face, t)| t.map(|v| (v, face)));
        let (areas, (neighbours, faces)) = rayon::join(
            || seen_vertex_areas(mesh, voxel as f32),
            || rayon::join(|| Lists::new(mesh.len(), pairs), || Lists::new(mesh.len(), faces_of_corners)),
        );
        Self { mesh, voxel, areas, neighbours, faces }
    }

    /// Vertices that share an edge with `v`, in order.
    pub(crate) fn neighbours(&self, v: u32) -> &[u32] {
        self.neighbours.of(v)
    }

    /// Faces with the corner `v`, in order.
    pub(crate) fn faces(&self, v: u32) -> &[u32] {
        self.faces.of(v)
    }

    /// Corners of a face, those of the mesh.
    pub(crate) fn corners(&self, face: u32) -> [u32; 3] {
        self.mesh.triangles[face as usize]
    }

    /// Position of a vertex, metres.
    pub(crate) fn position(&self, v: u32) -> [f64; 3] {
        self.mesh.vertices.positions[v as usize].map(f64::from)
    }

    /// Unit normal of a vertex; `None` where it is not known.
    pub(crate) fn normal(&self, v: u32) -> Option<[f64; 3]> {
        unit(self.mesh.vertices.normals[v as usize].map(f64::from), 0.1)
    }

    /// Component class of a vertex.
    pub(crate) fn component(&self, v: u32) -> u16 {
        self.mesh.vertices.labels[v as usize]
    }

    /// Defect class of a vertex; 0 is none.
    pub(crate) fn defect(&self, v: u32) -> u16 {
        self.mesh.vertices.defects[v as usize]
    }

    /// Length of the edge between two vertices along the surface, metres.
    pub(crate) fn edge_length(&self, a: u32, b: u32) -> f64 {
        smooth_edge_length(self.mesh, a, b)
    }
}

/// A list of numbers for each vertex.
struct Lists {
    starts: Vec<u32>,
    values: Vec<u32>,
}

impl Lists {
    /// Lists of the values of `pairs` (vertex, value) for `n` vertices, in order and each once.
    fn new<I: Iterator<Item = (u32, u32)>>(n: usize, pairs: impl Fn() -> I) -> Self {
        // Where each list begins, were nothing there twice.
        let mut starts = vec![0_u32; n + 1];
        pairs().for_each(|(v, _)| starts[v as usize + 1] += 1);
        (0..n).for_each(|v| starts[v + 1] += starts[v]);
        let mut ends = starts.clone();
        let mut values = vec![0; starts[n] as usize];
        for (v, value) in pairs() {
            values[ends[v as usize] as usize] = value;
            ends[v as usize] += 1;
        }
        // Each list in order, moved up to the end of the one before.
        let mut kept = 0;
        for v in 0..n {
            let list = starts[v] as usize..starts[v + 1] as usize;
            values[list.clone()].sort_unstable();
            starts[v] = kept as u32;
            for k in list {
                if kept == starts[v] as usize || values[kept - 1] != values[k] {
                    values[kept] = values[k];
                    kept += 1;
                }
            }
        }
        starts[n] = kept as u32;
        values.truncate(kept);
        Self { starts, values }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.values[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::grid;
    use super::*;

    #[test]
    fn what_lies_beside_a_vertex_is_known() {
        let mut mesh = grid(4, 3, |_, _| 0.0);
        mesh.triangles.push([0, 1, 999]);
        let surface = Surface::new(&mesh, 1e-3);
        // Vertices by row: 0 1 2 3 / 4 5 6 7 / 8 9 10 11; quads are split from their lower left to their upper right.
        assert_eq!(surface.neighbours(5), [0, 1, 4, 6, 9, 10]);
        assert_eq!((surface.faces(0).len(), surface.faces(5).len()), (2, 6));
        assert_eq!(surface.corners(surface.faces(0)[0]), [0, 1, 5]);
    }

    #[test]
    fn roughness_makes_no_edge_longer() {
        let mesh = grid(4, 4, |x, y| if (x + y) % 2 == 0 { 3e-4 } else { 0.0 });
        let surface = Surface::new(&mesh, 1e-3);
        assert!((surface.edge_length(5, 6) - 1e-3).abs() < 1e-8, "{}", surface.edge_length(5, 6));
        let mut bare = mesh.clone();
        bare.vertices.normals.fill([0.0; 3]);
        assert!(Surface::new(&bare, 1e-3).edge_length(5, 6) > 1.04e-3);
    }
}
