//! A mesh as the GPU reads it: 32 bytes a vertex, and indices in order of the triangles' components, so that a component is
//! hidden by not drawing its range.

use bytemuck::{Pod, Zeroable};
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;
use std::ops::Range;

/// One vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeshVertex {
    /// Metres, table frame.
    pub position: [f32; 3],
    /// Unit normal in 1/127, and 127 where what lies beyond was not observed.
    pub normal: [i8; 4],
    /// sRGB and confidence.
    pub color: [u8; 4],
    /// Label, defect, views, sigma in 1/255.
    pub classes: [u16; 4],
    /// Signed deviation from the reference in metres; [`NO_DEVIATION`] where there is none.
    pub deviation: f32,
}

/// A deviation that is not known: shaders cannot be trusted with NaN.
pub const NO_DEVIATION: f32 = 1e30;

/// The vertices of a mesh; `deviations` may be empty.
pub fn pack(mesh: &SemanticMesh, deviations: &[f32]) -> Vec<MeshVertex> {
    let mut vertices = Vec::with_capacity(mesh.len());
    for (i, p) in mesh.vertices.iter().enumerate() {
        let [x, y, z] = p.normal.map(|c| (c.clamp(-1.0, 1.0) * 127.0).round() as i8);
        let [r, g, b] = p.color;
        let rim = mesh.boundary.get(i).copied().unwrap_or(false);
        vertices.push(MeshVertex {
            position: p.position,
            normal: [x, y, z, if rim { 127 } else { 0 }],
            color: [r, g, b, (p.confidence.clamp(0.0, 1.0) * 255.0).round() as u8],
            classes: [p.label, p.defect, p.views, (p.sigma.clamp(0.0, 1.0) * 255.0).round() as u16],
            deviation: deviations.get(i).copied().filter(|d| d.is_finite()).unwrap_or(NO_DEVIATION),
        });
    }
    vertices
}

/// Indices, the triangles of each component class together, and where those of each class are.
pub fn by_component(mesh: &SemanticMesh) -> (Vec<u32>, Vec<(u16, Range<u32>)>) {
    let mut classes: BTreeMap<u16, Vec<u32>> = BTreeMap::new();
    for t in &mesh.triangles {
        classes.entry(mesh.triangle_label(*t)).or_default().extend_from_slice(t);
    }
    let mut indices = Vec::with_capacity(3 * mesh.triangles.len());
    let mut ranges = Vec::with_capacity(classes.len());
    for (label, mut of_class) in classes {
        let start = indices.len() as u32;
        indices.append(&mut of_class);
        ranges.push((label, start..indices.len() as u32));
    }
    (indices, ranges)
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::{PointFlags, SemanticPoint};

    fn mesh() -> SemanticMesh {
        let point = |label: u16| SemanticPoint {
            position: [f32::from(label), 0.0, 0.5],
            normal: [0.0, -1.0, 0.0],
            color: [1, 2, 3],
            label,
            confidence: 0.5,
            defect: 2,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 7,
            flags: PointFlags(0),
        };
        SemanticMesh {
            vertices: [2, 2, 1, 1].map(point).into_iter().collect(),
            boundary: vec![true, false, false, false],
            triangles: vec![[0, 1, 2], [1, 2, 3], [2, 3, 0], [0, 1, 3]],
        }
    }

    #[test]
    fn triangles_of_a_component_lie_together() {
        let (indices, ranges) = by_component(&mesh());
        assert_eq!(indices, [1, 2, 3, 2, 3, 0, 0, 1, 2, 0, 1, 3]);
        assert_eq!(ranges, [(1, 0..6), (2, 6..12)]);
    }

    #[test]
    fn a_vertex_says_what_its_point_does() {
        let packed = pack(&mesh(), &[0.25, f32::NAN]);
        let first = MeshVertex {
            position: [2.0, 0.0, 0.5],
            normal: [0, -127, 0, 127],
            color: [1, 2, 3, 128],
            classes: [2, 2, 7, 0],
            deviation: 0.25,
        };
        assert_eq!(packed[0], first);
        assert_eq!((packed[1].normal[3], packed[1].deviation), (0, NO_DEVIATION));
        assert_eq!(packed[3].deviation, NO_DEVIATION);
        assert_eq!(size_of::<MeshVertex>(), 32);
    }
}
