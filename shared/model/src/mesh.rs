//! The semantic mesh: a surface whose every vertex knows its component, its defects and how sure the system is.

use super::{PointFlags, SemanticCloud, SemanticPoint};

/// A triangle mesh with a value of every column for every vertex. Metres, table frame unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SemanticMesh {
    /// The vertices as points: position, normal, colour, labels, confidence and the rest. A vertex's `views` is the mean
    /// number of views of the points it was made from; of its flags only `UNLABELLED` is used.
    pub vertices: SemanticCloud,
    /// Whether what lies beyond a vertex was not observed: it is on an open edge, or where a hole was filled.
    pub boundary: Vec<bool>,
    /// Vertex indices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl SemanticMesh {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// Component class of a triangle: that of two of its corners, else that of the first.
    pub fn triangle_label(&self, triangle: [u32; 3]) -> u16 {
        let [a, b, c] = triangle.map(|v| self.vertices.labels.get(v as usize).copied().unwrap_or(0));
        if b == c { b } else { a }
    }

    /// Corners of a triangle in metres; `None` if it names a vertex that is not there.
    pub fn corners(&self, triangle: [u32; 3]) -> Option<[[f32; 3]; 3]> {
        let at = |v: u32| self.vertices.positions.get(v as usize).copied();
        Some([at(triangle[0])?, at(triangle[1])?, at(triangle[2])?])
    }

    /// Area in square metres.
    pub fn area(&self) -> f64 {
        self.triangles.iter().filter_map(|t| self.corners(*t)).map(triangle_area).sum()
    }

    /// The part of the mesh whose triangles `keep` accepts, without vertices that no triangle names. The marks of the
    /// boundary stay: a cut is not an edge of the observed.
    pub fn select(&self, mut keep: impl FnMut([u32; 3]) -> bool) -> Self {
        let kept = self.triangles.iter().copied().filter(|t| self.corners(*t).is_some());
        let kept: Vec<[u32; 3]> = kept.filter(|t| keep(*t)).collect();
        self.compacted(&kept)
    }

    /// Vertices that `triangles` name, renumbered in order, and these triangles.
    pub fn compacted(&self, triangles: &[[u32; 3]]) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut number = vec![UNUSED; self.len()];
        for &v in triangles.iter().flatten() {
            number[v as usize] = 0;
        }
        let mut mesh = Self::default();
        for (old, new) in number.iter_mut().enumerate().filter(|(_, n)| **n != UNUSED) {
            *new = mesh.len() as u32;
            mesh.vertices.extend(self.vertices.get(old));
            mesh.boundary.push(self.boundary.get(old).copied().unwrap_or(false));
        }
        mesh.triangles = triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
        mesh
    }

    /// Appends a vertex and returns its index.
    pub fn push(&mut self, vertex: SemanticPoint, boundary: bool) -> u32 {
        let index = self.len() as u32;
        self.vertices.push(vertex);
        self.boundary.push(boundary);
        index
    }
}

/// Area of a triangle in square units.
pub fn triangle_area([a, b, c]: [[f32; 3]; 3]) -> f64 {
    let edge = |p: [f32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k]));
    let (u, v) = (edge(b), edge(c));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    0.5 * cross.iter().map(|c| c * c).sum::<f64>().sqrt()
}

impl SemanticMesh {
    /// Marks of a vertex that a file carries beside its classes: the boundary as [`PointFlags::BOUNDARY`].
    pub fn flags(&self, vertex: usize) -> PointFlags {
        let flags = self.vertices.flags.get(vertex).copied().unwrap_or_default();
        let edge = self.boundary.get(vertex).copied().unwrap_or(false);
        PointFlags(flags.0 | if edge { PointFlags::BOUNDARY } else { 0 })
    }
}
