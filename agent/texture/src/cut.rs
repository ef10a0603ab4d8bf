//! The mesh cut along its charts, so that each vertex has one place in the atlas.

use crate::atlas::UNSEEN_EDGE;
use crate::charts::Chart;
use crate::pack::Packing;
use crate::surface::Surface;
use semascan_model::SemanticMesh;
use std::collections::HashMap;

/// The mesh cut along the charts, in the order of its faces, and the places of its vertices in the atlas.
pub(crate) fn cut(
    mesh: &SemanticMesh,
    surface: &Surface,
    charts: &[Chart],
    packing: &Packing,
    texel: f64,
) -> (SemanticMesh, Vec<[f32; 2]>) {
    let (mut cut, mut places) = (SemanticMesh::default(), Vec::new());
    let in_atlas = |corner: [u32; 2], texel: [f64; 2]| {
        let [x, y] = [0, 1].map(|k| f64::from(corner[k]) + texel[k]);
        [(x / f64::from(packing.width)) as f32, (y / f64::from(packing.height)) as f32]
    };
    let push = |cut: &mut SemanticMesh, vertex: u32| {
        let vertex = vertex as usize;
        cut.vertices.extend(mesh.vertices.get(vertex));
        cut.boundary.push(mesh.boundary.get(vertex).copied().unwrap_or(false));
        cut.len() as u32 - 1
    };
    let mut triangles: Vec<Option<[u32; 3]>> = vec![None; surface.faces.len()];
    for (chart, corner) in charts.iter().zip(&packing.places) {
        for (local, vertex) in chart.vertices.iter().enumerate() {
            push(&mut cut, *vertex);
            places.push(in_atlas(*corner, chart.texel(local, texel)));
        }
        for face in &chart.faces {
            let corners = chart.corners(surface, *face).map(|(corners, _)| corners);
            triangles[*face] = corners.map(|corners| corners.map(|local| (chart.first_node + local) as u32));
        }
    }
    // All faces that no photograph shows have the middle of the one square.
    let unseen = packing.places.last().copied().unwrap_or_default();
    let mut of_unseen: HashMap<u32, u32> = HashMap::new();
    cut.triangles = Vec::with_capacity(triangles.len());
    for (face, triangle) in surface.faces.iter().zip(triangles) {
        let triangle = triangle.unwrap_or_else(|| {
            face.map(|vertex| {
                *of_unseen.entry(vertex).or_insert_with(|| {
                    places.push(in_atlas(unseen, [f64::from(UNSEEN_EDGE) / 2.0; 2]));
                    push(&mut cut, vertex)
                })
            })
        });
        cut.triangles.push(triangle);
    }
    (cut, places)
}
