//! The signed distance field on the nodes of one tile: implicit moving least squares over oriented points, on a band.
//!
//! `f(x) = 1/2 [sum w n.(x - p) + m.sum w (x - p)] / sum w`, `m` the normalized `sum w n`. The first half is the IMLS field of
//! Kolluri (2005), which puts a convex surface outwards by half the mean square distance over the radius of curvature;
//! the second, the distance from the plane through the weighted mean, puts it inwards by as much. Their mean is free of
//! that error. `w = v (1 - d^2 / r^2)^3`, `v` the number of views that the point is a mean of.
//!
//! Two surfaces that are closer than the kernel is wide must not mix. Where normals disagree, a node takes that of its
//! nearest point, and points whose normals differ more than the gate allows do not count. So a thin sheet keeps both its
//! sides as long as one node lies between them.
//!
//! All distances are in grid cells, taken from whole numbers and the points' places in their cells, and points come in the
//! same order in every tile: a node has the same value, bit by bit, in each tile that holds it.

use super::points::Placed;
use super::tile::{Local, NODES};
use bytemuck::{Pod, Zeroable};

/// Normals around a node whose mean is longer than this agree, and need no gate.
const AGREEMENT: f32 = 0.9;

/// What the points say of one node: sums over them at first, then their means. Eight numbers in a row, which are added to
/// as one.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Node {
    /// Weight of the points; 0 where none reaches.
    pub(super) weight: f32,
    /// Sum of weighted plane distances; then the signed distance in cells, negative inside.
    pub(super) value: f32,
    /// Sum of weighted normals; then the unit normal.
    pub(super) normal: [f32; 3],
    /// Sum of weighted offsets of the node from its points; then how far it lies from their middle along the surface.
    pub(super) drift: [f32; 3],
}

/// The point nearest to a node.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    squared: f32,
    normal: [f32; 3],
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
    pub(super) nodes: Vec<Node>,
    /// Nodes that points reach.
    pub(super) active: Vec<u64>,
    /// Active nodes with a negative value.
    pub(super) inside: Vec<u64>,
    /// Nodes whose points disagree.
    split: Vec<u64>,
    /// Place in `nearest` of each node in `split`.
    slots: Vec<u32>,
    nearest: Vec<Nearest>,
}

impl Default for Field {
    fn default() -> Self {
        let columns = || vec![0; NODES * NODES];
        Self {
            nodes: vec![Node::default(); NODES * NODES * NODES],
            active: columns(),
            inside: columns(),
            split: columns(),
            slots: vec![0; NODES * NODES * NODES],
            nearest: Vec::new(),
        }
    }
}

impl Field {
    /// Computes the field of `points`.
    pub(super) fn fill(&mut self, points: &[Local], kernel: Kernel) {
        match kernel.radius {
            r if r <= 2.0 => self.fill_within::<4>(points, kernel),
            r if r <= 3.0 => self.fill_within::<6>(points, kernel),
            _ => self.fill_within::<8>(points, kernel),
        }
    }

    /// With `N` nodes along an edge of the cube around a point's reach.
    fn fill_within<const N: usize>(&mut self, points: &[Local], kernel: Kernel) {
        for (c, column) in self.active.iter_mut().enumerate() {
            bits(std::mem::take(column), |z| self.nodes[c * NODES + z] = Node::default());
        }
        let scale = 1.0 / (kernel.radius * kernel.radius);
        for local in points.iter().filter(|l| l.point.normal != [0.0; 3]) {
            self.add::<N>(local, scale);
        }
        self.resolve::<N>(points, kernel);
        for c in 0..NODES * NODES {
            let (mut active, mut inside) = (0, 0);
            bits(self.active[c], |z| {
                let node = &mut self.nodes[c * NODES + z];
                if node.weight > 0.0 {
                    node.finish();
                    active |= 1 << z;
                    inside |= u64::from(node.value < 0.0) << z;
                }
            });
            // Nodes without weight keep their zeros.
            (self.active[c], self.inside[c]) = (active, inside);
        }
    }

    /// Adds one point to the nodes around it. Nodes beyond its reach get a weight of zero: that is cheaper than asking.
    fn add<const N: usize>(&mut self, local: &Local, scale: f32) {
        let Placed { within, normal, weight, .. } = local.point;
        let offset = offsets::<N>(within);
        let [xs, ys, zs] = ranges::<N>(local.cell);
        let reach = column_bits(&zs, local.cell[2], N);
        for i in xs {
            let x = offset[0][i];
            for j in ys.clone() {
                let y = offset[1][j];
                let column = column::<N>(local.cell, i, j);
                let (across, along) = (1.0 - (x * x + y * y) * scale, normal[0] * x + normal[1] * y);
                self.active[column] |= reach;
                let first = column as i32 * NODES as i32 + local.cell[2] - low::<N>();
                let nodes = (first + zs.start as i32) as usize..(first + zs.end as i32) as usize;
                for (node, &z) in self.nodes[nodes].iter_mut().zip(&offset[2][zs.clone()]) {
                    let near = (across - z * z * scale).max(0.0);
                    node.add(weight * near * near * near, along + normal[2] * z, normal, [x, y, z]);
                }
            }
        }
    }

    /// Computes the nodes whose points disagree again, from those that agree with the nearest.
    fn resolve<const N: usize>(&mut self, points: &[Local], kernel: Kernel) {
        self.nearest.clear();
        for c in 0..NODES * NODES {
            let mut split = 0;
            bits(self.active[c], |z| {
                let node = &mut self.nodes[c * NODES + z];
                let limit = AGREEMENT * node.weight;
                if dot(node.normal, node.normal) < limit * limit {
                    split |= 1 << z;
                    *node = Node::default();
                    self.slots[c * NODES + z] = self.nearest.len() as u32;
                    self.nearest.push(Nearest { squared: f32::INFINITY, normal: [0.0; 3] });
                }
            });
            self.split[c] = split;
        }
        if self.nearest.is_empty() {
            return;
        }
        let limit = kernel.radius * kernel.radius;
        let oriented = || points.iter().filter(|l| l.point.normal != [0.0; 3]);
        for local in oriented() {
            let normal = local.point.normal;
            let (slots, nearest) = (&self.slots, &mut self.nearest);
            around::<N>(&self.split, local, limit, |node, _, squared| {
                let nearest = &mut nearest[slots[node] as usize];
                if squared < nearest.squared {
                    *nearest = Nearest { squared, normal };
                }
            });
        }
        let scale = 1.0 / limit;
        for local in oriented() {
            let Placed { normal, weight, .. } = local.point;
            let (slots, nearest, nodes) = (&self.slots, &self.nearest, &mut self.nodes);
            around::<N>(&self.split, local, limit, |node, offset, squared| {
                if dot(nearest[slots[node] as usize].normal, normal) < kernel.gate {
                    return;
                }
                let near = 1.0 - squared * scale;
                nodes[node].add(weight * near * near * near, dot(normal, offset), normal, offset);
            });
        }
    }
}

impl Node {
    /// Adds a point of weight `w`, its plane at distance `plane`, the node at `offset` from it.
    #[inline]
    fn add(&mut self, w: f32, plane: f32, normal: [f32; 3], offset: [f32; 3]) {
        let [nx, ny, nz] = normal;
        let [x, y, z] = offset;
        let sums: &mut [f32; 8] = bytemuck::cast_mut(self);
        for (sum, v) in sums.iter_mut().zip([1.0, plane, nx, ny, nz, x, y, z]) {
            *sum += w * v;
        }
    }

    /// Turns sums into means.
    fn finish(&mut self) {
        let share = 1.0 / self.weight;
        let length = dot(self.normal, self.normal).sqrt().max(f32::MIN_POSITIVE);
        self.normal = self.normal.map(|c| c / length);
        let middle = self.drift.map(|c| c * share);
        let height = dot(self.normal, middle);
        self.value = 0.5 * (self.value * share + height);
        self.drift = std::array::from_fn(|a| middle[a] - height * self.normal[a]);
    }
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

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
