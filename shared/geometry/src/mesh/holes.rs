//! Small holes closed, where that is asked for.
//!
//! A hole is a loop of open edges. It gets a vertex at its middle and a fan of triangles around that. The new vertex has the
//! mean colour and normal of the rim, the class that most of the rim has, no confidence at all, and, as the rim, keeps the
//! mark of the unobserved: whoever judges the surface can still tell it from what was measured.

use super::adjacency::open_edges;
use crate::vector::{squared_distance, unit};
use crate::vote::most_frequent;
use semascan_model::{PointFlags, SemanticMesh, SemanticPoint};
use std::collections::BTreeMap;

/// Closes every hole whose rim is at most `longest` metres around; returns how many it closed.
pub fn fill_holes(mesh: &mut SemanticMesh, longest: f32) -> usize {
    // A rim runs against its triangles' edges. Vertices with two rims are left alone.
    let mut next: BTreeMap<u32, Option<u32>> = BTreeMap::new();
    for [a, b] in open_edges(&mesh.triangles) {
        next.entry(b).and_modify(|to| *to = None).or_insert(Some(a));
    }
    let mut filled = 0;
    let starts: Vec<u32> = next.keys().copied().collect();
    for start in starts {
        let Some(rim) = take_loop(&mut next, start) else { continue };
        let at = |v: u32| mesh.vertices.positions[v as usize];
        let length: f32 =
            (0..rim.len()).map(|i| squared_distance(at(rim[i]), at(rim[(i + 1) % rim.len()])).sqrt()).sum();
        if rim.len() < 3 || length > longest {
            continue;
        }
        if let [a, b, c] = rim[..] {
            mesh.triangles.push([a, b, c]);
        } else {
            let centre = middle(mesh, &rim);
            let centre = mesh.push(centre, true);
            mesh.triangles.extend((0..rim.len()).map(|i| [rim[i], rim[(i + 1) % rim.len()], centre]));
        }
        filled += 1;
    }
    filled
}

/// Takes the loop through `start` out of `next`; `None` where it is no simple loop.
fn take_loop(next: &mut BTreeMap<u32, Option<u32>>, start: u32) -> Option<Vec<u32>> {
    let (mut rim, mut at) = (Vec::new(), start);
    loop {
        let to = next.remove(&at)??;
        rim.push(at);
        if to == start {
            return Some(rim);
        }
        at = to;
    }
}

/// The vertex in the middle of a rim.
fn middle(mesh: &SemanticMesh, rim: &[u32]) -> SemanticPoint {
    let share = 1.0 / rim.len() as f32;
    let (mut position, mut normal, mut color) = ([0.0_f32; 3], [0.0_f32; 3], [0.0_f32; 3]);
    let on_rim = || rim.iter().filter_map(|&v| mesh.vertices.get(v as usize));
    for p in on_rim() {
        for a in 0..3 {
            position[a] += share * p.position[a];
            normal[a] += p.normal[a];
            color[a] += share * f32::from(p.color[a]);
        }
    }
    SemanticPoint {
        position,
        normal: unit(normal, 1e-6).unwrap_or_default(),
        color: color.map(|c| c.round() as u8),
        label: most_frequent(on_rim().map(|p| p.label)).unwrap_or(0),
        confidence: 0.0,
        defect: 0,
        defect_confidence: 0.0,
        sigma: 1.0,
        defect_sigma: 1.0,
        instance: 0,
        views: 0,
        flags: PointFlags(PointFlags::UNLABELLED),
    }
}
