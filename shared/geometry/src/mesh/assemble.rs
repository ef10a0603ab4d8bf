//! Tiles joined into one mesh: vertices numbered through, quads split into triangles.
//!
//! A quad is split along the diagonal whose worse triangle, seen along the quad's normal, is larger: the vertices around a
//! grid edge lie in four different cells, so one of the two splits has no degenerate or folded triangle.

use super::threads::map;
use super::tile::{FOREIGN, TileMesh};
use crate::vector::{cross, dot, sub};
use semascan_model::{SemanticCloud, SemanticMesh};
use std::collections::BTreeMap;

/// Joins `tiles`, in order of their place.
pub(super) fn assemble(tiles: &BTreeMap<[i32; 3], TileMesh>) -> SemanticMesh {
    let mut mesh = SemanticMesh::default();
    let mut offsets = BTreeMap::new();
    mesh.vertices = SemanticCloud::with_capacity(tiles.values().map(|t| t.vertices.len()).sum());
    for (id, tile) in tiles {
        offsets.insert(*id, mesh.len() as u32);
        mesh.vertices.extend_from(&tile.vertices);
        mesh.boundary.extend_from_slice(&tile.boundary);
    }
    let all: Vec<_> = tiles.iter().collect();
    let positions = &mesh.vertices.positions;
    let parts = map(&all, |(id, tile)| {
        let mut triangles = Vec::with_capacity(2 * tile.quads.len());
        for quad in &tile.quads {
            let corners = quad.map(|v| resolve(tiles, &offsets, **id, v));
            // Tiles at a seam agree on its vertices; a tile that is not computed yet leaves a gap.
            if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                triangles.extend(split([a, b, c, d], [a, b, c, d].map(|v| positions[v as usize])));
            }
        }
        triangles
    });
    mesh.triangles = parts.concat();
    mesh
}

/// Index in the whole mesh of a quad's corner in the tile `id`.
fn resolve(
    tiles: &BTreeMap<[i32; 3], TileMesh>,
    offsets: &BTreeMap<[i32; 3], u32>,
    id: [i32; 3],
    corner: u32,
) -> Option<u32> {
    if corner & FOREIGN == 0 {
        return Some(offsets.get(&id)? + corner);
    }
    let before = std::array::from_fn(|axis| id[axis] - (corner >> (18 + axis) & 1) as i32);
    let at = tiles.get(&before)?.names.binary_search(&(corner & 0x3_ffff)).ok()?;
    Some(offsets.get(&before)? + at as u32)
}

/// Two triangles of a quad.
fn split([a, b, c, d]: [u32; 4], p: [[f32; 3]; 4]) -> [[u32; 3]; 2] {
    let p = p.map(|corner| corner.map(f64::from));
    let normal = cross(sub(p[2], p[0]), sub(p[3], p[1]));
    let area = |i: usize, j: usize, k: usize| {
        let n = cross(sub(p[j], p[i]), sub(p[k], p[i]));
        dot(n, normal)
    };
    if area(0, 1, 2).min(area(0, 2, 3)) >= area(1, 2, 3).min(area(1, 3, 0)) {
        [[a, b, c], [a, c, d]]
    } else {
        [[b, c, d], [b, d, a]]
    }
}
