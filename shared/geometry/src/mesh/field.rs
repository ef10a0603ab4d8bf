//! The signed distance field on the nodes of one tile: implicit moving least squares over oriented points, on a band.
//!
//! `f(x) = 1/2 [sum w n.(x - p) + m.sum w (x - p)] / sum w`, `m` the normalized `sum w n`. The first half is the IMLS
//! field of [Kolluri 2005], which puts a convex surface outwards by half the mean square distance over the radius of
//! curvature; the second, the distance from the plane through the weighted mean, puts it inwards by as much. Their mean
//! is free of that error. `w = v (1 - d^2 / r^2)^3`, `v` the number of views that the point is a mean of.
//!
//! Two surfaces that are closer than the kernel is wide must not mix. Where normals disagree, a node takes that of its
//! nearest point, and points whose normals differ more than the gate allows do not count. So a thin sheet keeps both its
//! sides as long as one node lies between them.
//!
//! All distances are in grid cells, taken from whole numbers and the points' places in their cells, and points come in the
//! same order in every tile: a node has the same value, bit by bit, in each tile that holds it.

use super::columns::{Columns, Share};
use super::node::{Node, Sums};
use super::points::Placed;
use super::working_grid::{Local, NODES};
use crate::vector::dot;
use glam::{BVec4A, Mat4, Vec4};

/// A node whose points disagree: it goes by those that agree with the nearest.
#[derive(Clone, Copy, Debug)]
struct Disputed {
    node: usize,
    /// Squared distance of the nearest point.
    nearest: f32,
    /// Normal of the nearest point.
    normal: [f32; 3],
    /// As in [`Sums`].
    sums: [Vec4; 2],
}

/// The kernel's reach and the gate between normals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kernel {
    /// Radius in cells, more than 1 and at most 4.
    pub(super) radius: f32,
    /// Least cosine between normals that belong together.
    pub(super) gate: f32,
}

/// The nodes of a tile. Columns along z are words of a bit a node.
#[derive(Debug)]
pub(super) struct Field {
    /// Meaningful where they are active.
    pub(super) nodes: Vec<Node>,
    /// Nodes that points reach.
    pub(super) active: Vec<u64>,
    /// Active nodes with a negative value.
    pub(super) inside: Vec<u64>,
    columns: Columns,
    /// Nodes whose points disagree.
    split: Vec<u64>,
    /// Place in `disputed` of each node in `split`.
    slots: Vec<u32>,
    disputed: Vec<Disputed>,
}

impl Default for Field {
    fn default() -> Self {
        let columns = || vec![0; NODES * NODES];
        Self {
            // Nodes are written four at a time, from the last column beyond the end.
            nodes: vec![Node::default(); NODES * NODES * NODES + 4],
            active: columns(),
            inside: columns(),
            columns: Columns::default(),
            split: columns(),
            slots: vec![0; NODES * NODES * NODES],
            disputed: Vec::new(),
        }
    }
}

impl Field {
    /// Computes the field of `points`.
    pub(super) fn fill(&mut self, points: &[Local], kernel: Kernel) {
        if kernel.radius <= 2.0 {
            self.fill_within::<4, 1>(points, kernel);
        } else {
            self.fill_within::<8, 2>(points, kernel);
        }
    }

    /// With `N` nodes along an edge of the cube around a point's reach, `M` times four.
    fn fill_within<const N: usize, const M: usize>(&mut self, points: &[Local], kernel: Kernel) {
        self.active.fill(0);
        let scale = 1.0 / (kernel.radius * kernel.radius);
        for local in points.iter().filter(|l| l.point.normal != [0.0; 3]) {
            self.add::<N, M>(local, scale);
        }
        self.disputed.clear();
        for column in 0..NODES * NODES {
            self.settle(column);
        }
        if !self.disputed.is_empty() {
            self.resolve::<N>(points, kernel);
        }
    }

    /// Adds one point to the nodes around it. Nodes beyond its reach get a weight of zero: that is cheaper than asking.
    fn add<const N: usize, const M: usize>(&mut self, local: &Local, scale: f32) {
        let Placed { within, normal, weight, .. } = local.point;
        let offset = offsets::<N>(within);
        let [xs, ys, zs] = ranges::<N>(local.cell);
        if zs.is_empty() {
            return;
        }
        let reach = column_bits(&zs, local.cell[2], N);
        let first = local.cell[2] - low::<N>();
        let along: [Vec4; M] = std::array::from_fn(|m| Vec4::from_slice(&offset[2][4 * m..]));
        for i in xs {
            let x = offset[0][i];
            for j in ys.clone() {
                let y = offset[1][j];
                let (across, level) = (1.0 - (x * x + y * y) * scale, normal[0] * x + normal[1] * y);
                let weight = along.map(|z| {
                    let near = (across - z * z * scale).max(Vec4::ZERO);
                    weight * near * near * near
                });
                let plane = along.map(|z| level + normal[2] * z);
                let column = column::<N>(local.cell, i, j);
                self.active[column] |= reach;
                self.columns.add(column, first, &Share { weight, plane, normal, across: [x, y], along });
            }
        }
    }

    /// Turns the sums of a column into its nodes and forgets them. Nodes whose points disagree are disputed.
    fn settle(&mut self, column: usize) {
        let touched = std::mem::take(&mut self.active[column]);
        let (mut rest, mut active, mut inside, mut split) = (touched, 0, 0, 0);
        while rest != 0 {
            let z = rest.trailing_zeros() as usize;
            let four = rest & 0b1111 << z;
            rest ^= four;
            let sums = self.columns.four(column, z);
            let (nodes, below) = sums.nodes();
            let bits = |mask: BVec4A| u64::from(mask.bitmask()) << z & four;
            let reached = bits(sums.reached());
            active |= reached;
            inside |= bits(below) & reached;
            split |= bits(sums.disputed());
            // What lies beyond the column is overwritten by the next, where it is active there.
            let first = column * NODES + z;
            self.nodes[first..first + 4].copy_from_slice(&nodes);
        }
        bits(split, |z| {
            let node = column * NODES + z;
            self.slots[node] = self.disputed.len() as u32;
            let (nearest, normal, sums) = (f32::INFINITY, [0.0; 3], [Vec4::ZERO; 2]);
            self.disputed.push(Disputed { node, nearest, normal, sums });
        });
        if touched != 0 {
            self.columns.clear(column, touched);
        }
        (self.active[column], self.inside[column], self.split[column]) = (active, inside, split);
    }

    /// Computes the disputed nodes again.
    fn resolve<const N: usize>(&mut self, points: &[Local], kernel: Kernel) {
        let limit = kernel.radius * kernel.radius;
        let oriented = || points.iter().filter(|l| l.point.normal != [0.0; 3]);
        let (split, slots, disputed) = (&self.split, &self.slots, &mut self.disputed);
        for local in oriented() {
            around::<N>(split, local, limit, |node, _, squared| {
                let at = &mut disputed[slots[node] as usize];
                if squared < at.nearest {
                    (at.nearest, at.normal) = (squared, local.point.normal);
                }
            });
        }
        let scale = 1.0 / limit;
        for local in oriented() {
            let Placed { normal, weight, .. } = local.point;
            around::<N>(split, local, limit, |node, offset, squared| {
                let at = &mut disputed[slots[node] as usize];
                if dot(at.normal, normal) < kernel.gate {
                    return;
                }
                let near = 1.0 - squared * scale;
                let (w, [nx, ny, nz], [x, y, z]) = (weight * near * near * near, normal, offset);
                at.sums[0] += w * Vec4::new(1.0, dot(normal, offset), nx, ny);
                at.sums[1] += w * Vec4::new(nz, x, y, z);
            });
        }
        for four in self.disputed.chunks(4) {
            let of = |k: usize| four.get(k).map_or([Vec4::ZERO; 2], |d| d.sums);
            let [low, high] = [0, 1].map(|half| {
                let columns = Mat4::from_cols(of(0)[half], of(1)[half], of(2)[half], of(3)[half]).transpose();
                [0, 1, 2, 3].map(|k| columns.col(k))
            });
            let [[w, plane, nx, ny], [nz, x, y, z]] = [low, high];
            let sums = Sums([w, plane, nx, ny, nz, x, y, z]);
            let ((nodes, below), reached) = (sums.nodes(), sums.reached());
            for (k, disputed) in four.iter().enumerate() {
                let (column, bit) = (disputed.node / NODES, 1 << (disputed.node % NODES));
                self.nodes[disputed.node] = nodes[k];
                set(&mut self.active[column], bit, reached.test(k));
                set(&mut self.inside[column], bit, reached.test(k) && below.test(k));
            }
        }
    }
}

/// Sets or clears a bit.
fn set(word: &mut u64, bit: u64, to: bool) {
    *word = if to { *word | bit } else { *word & !bit };
}

/// How many nodes of the cube lie below the point's cell.
const fn low<const N: usize>() -> i32 {
    N as i32 / 2 - 1
}

/// Node minus point along each axis, for the nodes of the cube.
fn offsets<const N: usize>(within: [f32; 3]) -> [[f32; N]; 3] {
    within.map(|t| std::array::from_fn(|k| (k as i32 - low::<N>()) as f32 - t))
}

/// Nodes of the cube that the tile has, along each axis.
fn ranges<const N: usize>(cell: [i32; 3]) -> [std::ops::Range<usize>; 3] {
    cell.map(|c| {
        let first = c - low::<N>();
        let (n, edge) = (N as i32, NODES as i32);
        (-first).clamp(0, n) as usize..(edge - first).clamp(0, n) as usize
    })
}

/// The column of nodes at place (i, j) of the cube. Only for places that [`ranges`] allows.
fn column<const N: usize>(cell: [i32; 3], i: usize, j: usize) -> usize {
    let (x, y) = (cell[0] - low::<N>() + i as i32, cell[1] - low::<N>() + j as i32);
    (x * NODES as i32 + y) as usize
}

/// The nodes of a column that the cube around height `z` reaches.
fn column_bits(zs: &std::ops::Range<usize>, z: i32, n: usize) -> u64 {
    if zs.is_empty() {
        return 0;
    }
    let first = z - (n as i32 / 2 - 1) + zs.start as i32;
    ((1 << zs.len()) - 1) << first
}

/// Visits the nodes in `columns` within reach of a point: index, node minus point, squared distance.
fn around<const N: usize>(columns: &[u64], local: &Local, limit: f32, mut visit: impl FnMut(usize, [f32; 3], f32)) {
    let [xs, ys, zs] = ranges::<N>(local.cell);
    let reach = column_bits(&zs, local.cell[2], N);
    let within = local.point.within;
    for i in xs {
        for j in ys.clone() {
            let column = column::<N>(local.cell, i, j);
            let hit = columns[column] & reach;
            if hit == 0 {
                continue;
            }
            let x = (i as i32 - low::<N>()) as f32 - within[0];
            let y = (j as i32 - low::<N>()) as f32 - within[1];
            bits(hit, |z| {
                let offset = [x, y, (z as i32 - local.cell[2]) as f32 - within[2]];
                let squared = dot(offset, offset);
                if squared < limit {
                    visit(column * NODES + z, offset, squared);
                }
            });
        }
    }
}

/// Calls `f` with each bit that is set, rising.
pub(super) fn bits(mut word: u64, mut f: impl FnMut(usize)) {
    while word != 0 {
        f(word.trailing_zeros() as usize);
        word &= word - 1;
    }
}
