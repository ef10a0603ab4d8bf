//! Meshing of a [`Solid`]: dual contouring on a sparse grid [Ju 2002]. Where the surface is smooth the vertex goes to
//! the field's zero by Newton steps; where faces meet it goes to the point that lies on all of them, so that edges come
//! out straight.
//!
//! Only blocks of the grid that the surface can pass are sampled (a distance field tells by one evaluation), each with
//! the few steps of the solid that reach it. Blocks are meshed in parallel and joined in grid order, so the mesh does
//! not depend on the number of threads.

use std::collections::HashMap;

use glam::{IVec3, Mat3, Vec3};
use rayon::prelude::*;

use super::solid::Solid;

/// Cells along the edge of a block.
const BLOCK: i32 = 8;

/// A triangle mesh with a normal and a material slot at every vertex; units as the solid's.
#[derive(Clone, Debug, Default)]
pub(super) struct NetMesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) slots: Vec<u8>,
    /// Counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

struct BlockNet {
    cells: Vec<(IVec3, Vec3, Vec3, u8)>,
    quads: Vec<[IVec3; 4]>,
}

/// Meshes the surface of `solid` within `min`..`max` with cells of edge `cell`.
pub(super) fn mesh(solid: &Solid, min: Vec3, max: Vec3, cell: f32) -> NetMesh {
    let origin = min - Vec3::splat(2.0 * cell);
    let blocks = ((max - min) / cell + Vec3::splat(4.0)).ceil().as_ivec3() / BLOCK + IVec3::ONE;
    let nets: Vec<BlockNet> = (0..blocks.x * blocks.y * blocks.z)
        .into_par_iter()
        .filter_map(|i| {
            let block = IVec3::new(i % blocks.x, i / blocks.x % blocks.y, i / (blocks.x * blocks.y));
            mesh_block(solid, origin, cell, block * BLOCK)
        })
        .collect();
    join(&nets)
}

fn join(nets: &[BlockNet]) -> NetMesh {
    let mut out = NetMesh::default();
    let mut index: HashMap<IVec3, u32> = HashMap::new();
    for (key, position, normal, slot) in nets.iter().flat_map(|n| n.cells.iter().copied()) {
        index.insert(key, out.positions.len() as u32);
        out.positions.push(position);
        out.normals.push(normal);
        out.slots.push(slot);
    }
    for quad in nets.iter().flat_map(|n| &n.quads) {
        let corners = quad.map(|key| index.get(&key).copied());
        if let [Some(a), Some(b), Some(c), Some(d)] = corners {
            let p = |i: u32| out.positions[i as usize];
            // The shorter diagonal gives the rounder pair of triangles.
            if p(a).distance_squared(p(c)) <= p(b).distance_squared(p(d)) {
                out.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                out.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    out
}

/// The field at the corners of one block's cells.
struct Samples {
    values: Vec<f32>,
}

impl Samples {
    const SIDE: i32 = BLOCK + 1;

    fn at(&self, c: IVec3) -> f32 {
        self.values[(c.x + Self::SIDE * (c.y + Self::SIDE * c.z)) as usize]
    }
}

fn mesh_block(solid: &Solid, origin: Vec3, cell: f32, first: IVec3) -> Option<BlockNet> {
    let corner = |c: IVec3| origin + (first + c).as_vec3() * cell;
    let centre = corner(IVec3::splat(BLOCK / 2));
    let radius = (BLOCK / 2 + 1) as f32 * cell * 3.0_f32.sqrt();
    let local = solid.near(centre, radius);
    if local.distance(centre).abs() > radius {
        return None;
    }
    let side = Samples::SIDE;
    let values = (0..side * side * side)
        .map(|i| local.distance(corner(IVec3::new(i % side, i / side % side, i / (side * side)))))
        .collect();
    let samples = Samples { values };
    let mut net = BlockNet { cells: Vec::new(), quads: Vec::new() };
    for i in 0..BLOCK * BLOCK * BLOCK {
        let c = IVec3::new(i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK));
        let crossings = edge_crossings(&samples, c);
        if !crossings.is_empty() {
            let crossings: Vec<Vec3> = crossings.into_iter().map(|x| corner(c) + x * cell).collect();
            let p = vertex(&local, &crossings, corner(c), corner(c + IVec3::ONE));
            net.cells.push((first + c, p, local.normal(p), local.sample(p).1));
        }
        net.quads.extend(owned_quads(&samples, first, c));
    }
    (!net.cells.is_empty()).then_some(net)
}

/// Where the surface crosses the edges of a cell, in units of the cell.
fn edge_crossings(samples: &Samples, c: IVec3) -> Vec<Vec3> {
    let offset = |i: usize| IVec3::new((i & 1) as i32, (i >> 1 & 1) as i32, (i >> 2) as i32);
    let d: [f32; 8] = std::array::from_fn(|i| samples.at(c + offset(i)));
    let mut crossings = Vec::new();
    for i in 0..8_usize {
        for axis in 0..3 {
            let j = i | 1 << axis;
            if j != i && (d[i] < 0.0) != (d[j] < 0.0) {
                crossings.push(offset(i).as_vec3().lerp(offset(j).as_vec3(), d[i] / (d[i] - d[j])));
            }
        }
    }
    crossings
}

/// The cell's vertex from the crossings of its edges, within `low`..`high`.
fn vertex(solid: &Solid, crossings: &[Vec3], low: Vec3, high: Vec3) -> Vec3 {
    let mean = crossings.iter().sum::<Vec3>() / crossings.len() as f32;
    let normals: Vec<Vec3> = crossings.iter().map(|p| solid.normal(*p)).collect();
    let mut p = mean;
    if normals.iter().any(|n| n.dot(normals[0]) < 0.92) {
        // Least squares over the tangent planes, held near the mean where they leave a direction free.
        let mut a = Mat3::from_diagonal(Vec3::splat(0.03));
        let mut b = Vec3::ZERO;
        for (q, n) in crossings.iter().zip(&normals) {
            a += Mat3::from_cols(*n * n.x, *n * n.y, *n * n.z);
            b += *n * n.dot(*q - mean);
        }
        p = (mean + a.inverse() * b).clamp(low, high);
    } else {
        for _ in 0..2 {
            p = (p - solid.normal(p) * solid.distance(p)).clamp(low, high);
        }
    }
    p
}

/// The quads around the three edges that start at the low corner of cell `c`.
fn owned_quads(samples: &Samples, first: IVec3, c: IVec3) -> impl Iterator<Item = [IVec3; 4]> {
    const AXES: [IVec3; 3] = [IVec3::X, IVec3::Y, IVec3::Z];
    let here = samples.at(c) < 0.0;
    let crossed: [bool; 3] = std::array::from_fn(|k| here != (samples.at(c + AXES[k]) < 0.0));
    (0..3).filter(move |&k| crossed[k]).map(move |k| {
        let (u, v, key) = (AXES[(k + 1) % 3], AXES[(k + 2) % 3], first + c);
        if here { [key - u - v, key - v, key, key - u] } else { [key - u - v, key - u, key, key - v] }
    })
}

#[cfg(test)]
mod tests {
    use super::super::shape::Shape;
    use super::super::solid::Step;
    use super::*;

    fn ball_with_hole() -> Solid {
        let mut s = Solid::default();
        s.add(Step::new(Shape::Cylinder { radius: 12.0, half: 9.0, fillet: 3.0 }));
        s.cut(Step::new(Shape::Cylinder { radius: 4.0, half: 20.0, fillet: 0.0 }));
        s
    }

    #[test]
    fn mesh_is_closed_oriented_and_on_the_surface() {
        let solid = ball_with_hole();
        let net = mesh(&solid, Vec3::splat(-13.0), Vec3::splat(13.0), 1.0);
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        let mut volume = 0.0;
        for t in &net.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
            let [a, b, c] = t.map(|i| net.positions[i as usize]);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(edges.values().all(|n| *n == 0), "every edge is used once each way");
        let expected = std::f32::consts::PI * (144.0 - 16.0) * 18.0;
        assert!((0.94..1.0).contains(&(volume / expected)), "volume {volume} of {expected}");
        let off = net.positions.iter().filter(|p| solid.distance(**p).abs() > 0.05).count();
        assert!(off * 20 < net.positions.len(), "{off} of {} vertices off the surface", net.positions.len());
        for (p, n) in net.positions.iter().zip(&net.normals) {
            assert!(solid.distance(*p + *n) > solid.distance(*p - *n), "normals point outwards");
        }
    }

    #[test]
    fn mesh_does_not_depend_on_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| mesh(&ball_with_hole(), Vec3::splat(-13.0), Vec3::splat(13.0), 1.0))
        };
        let (one, three) = (run(1), run(3));
        assert_eq!(one.positions, three.positions);
        assert_eq!(one.triangles, three.triangles);
    }
}
