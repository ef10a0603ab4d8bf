//! Small surfaces that tests draw.

use semascan_model::{SemanticMesh, SemanticPoint, Taxonomy};

/// Components 1 (blue) and 2 (orange), defects 1 (yellow) and 2.
pub(crate) fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["housing", "gear"], &["wear", "crack"])
}

/// Adds a square of 20 x 20 cells at height `z`, facing upwards, between two corners.
pub(crate) fn quad(
    mesh: &mut SemanticMesh,
    low: [f32; 2],
    high: [f32; 2],
    z: f32,
    label: u16,
    defect: impl Fn([f32; 2]) -> u16,
) {
    const CELLS: u32 = 20;
    let first = mesh.len() as u32;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let share = |axis: usize, n: u32| low[axis] + (high[axis] - low[axis]) * n as f32 / CELLS as f32;
            let (x, y) = (share(0, i), share(1, j));
            let vertex = SemanticPoint {
                position: [x, y, z],
                normal: [0.0, 0.0, 1.0],
                label,
                defect: defect([x, y]),
                confidence: 1.0,
                ..SemanticPoint::UNKNOWN
            };
            mesh.push(vertex, false);
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = first + j * (CELLS + 1) + i;
            let (b, c, d) = (a + 1, a + CELLS + 1, a + CELLS + 2);
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
}
