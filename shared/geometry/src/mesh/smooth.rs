//! Smoothing that keeps size: alternating steps inwards and outwards [Taubin 1995].
//!
//! Open edges stay where they are, and vertices at the border of two components move along their normal only, so that
//! neither the rim of what was observed nor a component's outline is drawn in.

use super::adjacency::{neighbours, open_edges};
use super::threads::map;
use crate::vector::dot;
use semascan_model::SemanticMesh;

/// Step inwards.
const LAMBDA: f32 = 0.5;
/// Step outwards: the pass band ends at 1 / LAMBDA + 1 / MU = 0.1.
const MU: f32 = -1.0 / (1.0 / LAMBDA - 0.1);

/// How a vertex may move.
#[derive(Clone, Copy, PartialEq)]
enum Freedom {
    Free,
    AlongNormal,
    None,
}

/// Smooths `mesh` in place with `rounds` pairs of steps.
pub fn smooth(mesh: &mut SemanticMesh, rounds: u32) {
    if rounds == 0 || mesh.is_empty() {
        return;
    }
    let around = neighbours(mesh.len(), &mesh.triangles);
    let mut freedom = vec![Freedom::Free; mesh.len()];
    for (v, free) in freedom.iter_mut().enumerate() {
        let label = mesh.vertices.labels[v];
        if around.of(v).iter().any(|&u| mesh.vertices.labels[u as usize] != label) {
            *free = Freedom::AlongNormal;
        }
    }
    for v in open_edges(&mesh.triangles).into_iter().flatten() {
        freedom[v as usize] = Freedom::None;
    }
    let indices: Vec<u32> = (0..mesh.len() as u32).collect();
    for _ in 0..rounds {
        for factor in [LAMBDA, MU] {
            let (positions, normals) = (&mesh.vertices.positions, &mesh.vertices.normals);
            let moved = map(&indices, |&v| {
                let (at, list) = (positions[v as usize], around.of(v as usize));
                if freedom[v as usize] == Freedom::None || list.is_empty() {
                    return at;
                }
                let mut mean = [0.0_f32; 3];
                for &u in list {
                    for a in 0..3 {
                        mean[a] += positions[u as usize][a] - at[a];
                    }
                }
                let mut step = mean.map(|m| factor * m / list.len() as f32);
                if freedom[v as usize] == Freedom::AlongNormal {
                    let n = normals[v as usize];
                    let height = dot(step, n);
                    step = n.map(|c| c * height);
                }
                std::array::from_fn(|a| at[a] + step[a])
            });
            mesh.vertices.positions = moved;
        }
    }
}
