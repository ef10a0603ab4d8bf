//! The cells of a tile that the surface passes through, and how it does.
//!
//! A cell counts only where there is evidence: points reach all its corners, its points surround it (weighted means
//! drift inwards at the edge of a cloud: [Adamson 2004]), and the field rises in the direction of the points' normals,
//! which between two parallel layers it does not.

use super::field::{Field, bits};
use super::node::Node;
use super::topology::{EDGE_CORNERS, Loops, crossed, loops, others, whole_loops};
use super::working_grid::{CELLS, HALO, NODES, TILE_EDGE, coordinates, node_index};
use crate::vector::dot;

/// How far, in cells, the middle of the points may lie from a cell before it is outside of what was observed.
const DRIFT: f32 = 0.75;

/// A cell that the surface crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Index of its lowest node.
    pub(super) node: usize,
    /// Corners inside, a bit each.
    pub(super) mask: u8,
    /// Crossed edges with a quad, a bit each.
    pub(super) quads: u16,
    /// Faces that are read the other way round.
    pub(super) flips: u8,
    /// Loops of the edges with a quad.
    pub(super) loops: Loops,
    /// First vertex of the cell among those of the tile.
    pub(super) first_vertex: u32,
}

/// The crossed cells of a tile, in grid order.
#[derive(Debug)]
pub(super) struct Cells {
    pub(super) list: Vec<Cell>,
    /// Columns of cells, a bit each.
    columns: Vec<u64>,
    /// Cells in the columns before.
    starts: Vec<u32>,
}

impl Default for Cells {
    fn default() -> Self {
        Self { list: Vec::new(), columns: vec![0; NODES * NODES], starts: vec![0; NODES * NODES] }
    }
}

impl Cells {
    /// Finds the cells and what their quads and loops are.
    pub(super) fn find(&mut self, field: &Field) {
        self.list.clear();
        self.columns.fill(0);
        for x in 0..CELLS {
            for y in 0..CELLS {
                let column = x * NODES + y;
                self.starts[column] = self.list.len() as u32;
                let around = [column, column + 1, column + NODES, column + NODES + 1];
                let [active, inside] = [&field.active, &field.inside].map(|columns| around.map(|c| columns[c]));
                let reached = active.iter().fold(u64::MAX, |all, c| all & c & c >> 1);
                let (any, all) =
                    inside.iter().fold((0, u64::MAX), |(any, all), c| (any | c | c >> 1, all & c & c >> 1));
                let mut found = 0;
                bits(reached & any & !all, |z| {
                    let node = column * NODES + z;
                    if let Some(mask) = crossing(&field.nodes, node) {
                        let loops = *whole_loops(mask);
                        self.list.push(Cell { node, mask, quads: 0, flips: 0, loops, first_vertex: 0 });
                        found |= 1 << z;
                    }
                });
                self.columns[column] = found;
            }
        }
        for i in 0..self.list.len() {
            let Cell { node, mask, loops: whole, .. } = self.list[i];
            // Cells in the halo, but for the layer that quads of this tile reach into, are there to be asked only.
            if coordinates(node).iter().any(|&c| c + 1 < HALO || c >= HALO + TILE_EDGE) {
                continue;
            }
            let all = crossed(mask);
            let quads = (0..12).filter(|e| all >> e & 1 == 1 && self.has_quad(node, *e)).fold(0, |q, e| q | 1 << e);
            let flips = if whole.doubled == 0 { 0 } else { self.flips(node, whole.doubled) };
            let cell = &mut self.list[i];
            cell.quads = quads;
            cell.flips = flips;
            if quads != all || flips != 0 {
                cell.loops = loops(mask, flips, quads);
            }
        }
    }

    fn is_cell(&self, node: usize) -> bool {
        self.columns[node / NODES] >> (node % NODES) & 1 == 1
    }

    /// The cell above `node`.
    pub(super) fn at(&self, node: usize) -> Option<&Cell> {
        let (column, z) = (node / NODES, node % NODES);
        let below = self.columns[column] & ((1 << z) - 1);
        self.is_cell(node).then(|| &self.list[(self.starts[column] + below.count_ones()) as usize])
    }

    /// Whether all four cells around edge `e` of the cell above `node` are there.
    fn has_quad(&self, node: usize, e: usize) -> bool {
        let start = node + corner_step(EDGE_CORNERS[e][0]);
        let [b, c] = others(e / 4).map(step);
        [0, b, c, b + c].iter().all(|back| self.is_cell(start - back))
    }

    /// Faces of the cell above `node` to read the other way round, of those in `doubled`.
    fn flips(&self, node: usize, doubled: u8) -> u8 {
        let candidates = self.candidates(node, doubled);
        let mut flips = 0;
        for face in (0..6).filter(|f| candidates >> f & 1 == 1) {
            // One flip a cell: the first of all candidates of both neighbours, so that both cells, and both tiles where
            // the face lies between two, decide alike.
            let Some(other) = beyond(node, face) else { continue };
            let theirs = self.at(other).map_or(0, |cell| self.candidates(other, whole_loops(cell.mask).doubled));
            let id = face_id(node, face);
            let first = |node: usize, candidates: u8| {
                (0..6).filter(|f| candidates >> f & 1 == 1).map(|f| face_id(node, f)).min()
            };
            if first(node, candidates) == Some(id) && first(other, theirs) == Some(id) {
                flips |= 1 << face;
            }
        }
        flips
    }

    /// Faces in `doubled` whose other cell is doubled there as well.
    fn candidates(&self, node: usize, doubled: u8) -> u8 {
        (0..6)
            .filter(|face| {
                let other = beyond(node, *face).filter(|_| doubled >> face & 1 == 1).and_then(|n| self.at(n));
                other.is_some_and(|cell| whole_loops(cell.mask).doubled >> (face ^ 1) & 1 == 1)
            })
            .fold(0, |set, face| set | 1 << face)
    }
}

impl Cell {
    /// The loops that vertex positions are taken from: of all crossed edges, those without a quad as well.
    pub(super) fn shape(&self) -> Loops {
        if self.flips == 0 { *whole_loops(self.mask) } else { loops(self.mask, self.flips, crossed(self.mask)) }
    }
}

/// Corners inside of the cell above `node` if the evidence there is good.
fn crossing(nodes: &[Node], node: usize) -> Option<u8> {
    let mut mask = 0_u8;
    let mut drift = [0.0_f32; 3];
    let corners: [&Node; 8] = std::array::from_fn(|c| &nodes[node + corner_step(c as u8)]);
    for (c, corner) in corners.iter().enumerate() {
        mask |= u8::from(corner.value < 0.0) << c;
        for (sum, d) in drift.iter_mut().zip(corner.drift) {
            *sum += d;
        }
    }
    if dot(drift, drift) > (8.0 * DRIFT) * (8.0 * DRIFT) {
        return None;
    }
    // Along a crossed edge the field must rise with the normal of at least one end: the ends may lie on two surfaces.
    let edges = crossed(mask);
    let mut rise = 0.0;
    bits(edges.into(), |e| {
        let [low, high] = EDGE_CORNERS[e].map(usize::from);
        let upwards = if mask >> low & 1 == 1 { 1.0 } else { -1.0 };
        rise += (upwards * corners[low].normal[e / 4]).max(upwards * corners[high].normal[e / 4]);
    });
    (rise > 0.0).then_some(mask)
}

/// Distance in the node array of one step along `axis`.
pub(super) const fn step(axis: usize) -> usize {
    match axis {
        0 => NODES * NODES,
        1 => NODES,
        _ => 1,
    }
}

/// Distance in the node array from a cell's lowest node to its corner `corner`.
pub(super) const fn corner_step(corner: u8) -> usize {
    (corner & 1) as usize * step(0) + (corner >> 1 & 1) as usize * step(1) + (corner >> 2 & 1) as usize * step(2)
}

/// Lowest node of the cell beyond a face.
fn beyond(node: usize, face: usize) -> Option<usize> {
    let mut at = coordinates(node);
    at[face / 2] += if face % 2 == 1 { 1 } else { -1 };
    at.iter().all(|&c| (0..CELLS as i32).contains(&c)).then(|| node_index(at))
}

/// A number of a face that both its cells agree on, and that orders faces alike in every tile.
fn face_id(node: usize, face: usize) -> (usize, usize) {
    let low = if face % 2 == 1 { node + step(face / 2) } else { node };
    (low, face / 2)
}
