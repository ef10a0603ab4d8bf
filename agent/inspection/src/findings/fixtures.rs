//! Surfaces that the tests of findings measure.

use semascan_model::{SemanticMesh, SemanticPoint};

/// A grid of `columns` x `rows` vertices, a millimetre apart, that faces +z, of component 1 and without defects. `height` in
/// metres by column and row; normals stay those of the plane.
pub(crate) fn grid(columns: u32, rows: u32, height: impl Fn(u32, u32) -> f32) -> SemanticMesh {
    let mut mesh = SemanticMesh::default();
    for y in 0..rows {
        for x in 0..columns {
            let rim = x == 0 || y == 0 || x + 1 == columns || y + 1 == rows;
            let vertex = SemanticPoint {
                position: [x as f32 * 1e-3, y as f32 * 1e-3, height(x, y)],
                normal: [0.0, 0.0, 1.0],
                label: 1,
                confidence: 1.0,
                defect_confidence: 1.0,
                ..SemanticPoint::UNKNOWN
            };
            mesh.push(vertex, rim);
        }
    }
    for y in 0..rows - 1 {
        for x in 0..columns - 1 {
            let (a, b) = (y * columns + x, (y + 1) * columns + x);
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

/// Gives the vertices that `inside` agrees to, by their x and y in millimetres, defect class 1.
pub(crate) fn with_defect(mut mesh: SemanticMesh, inside: impl Fn(f32, f32) -> bool) -> SemanticMesh {
    for (v, defect) in mesh.vertices.defects.iter_mut().enumerate() {
        let [x, y, _] = mesh.vertices.positions[v];
        *defect = u16::from(inside(x * 1e3, y * 1e3));
    }
    mesh
}
