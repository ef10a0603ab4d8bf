//! The mesh of one tile: 32^3 cells of the grid, computed from the points in and around it and from nothing else.
//!
//! A tile owns the vertices of its cells and the quads over the edges that start at its nodes. Quads at its low sides end
//! at vertices of the tiles before it; they are named by cell and loop until all tiles are joined. The halo is wide enough
//! for both tiles at a seam to come to the same cells, loops and vertices.

use super::cells::{Cell, Cells, corner_step, step};
use super::field::{Field, Kernel};
use super::points::Points;
use super::topology::{EDGE_CORNERS, NO_LOOP, others};
use super::vertices::{Evidence, Vertex, Votes};
use super::working_grid::{HALO, Local, NODES, TILE_EDGE, coordinates};
use semascan_model::SemanticCloud;

/// Set in a quad's corner that belongs to another tile.
pub(super) const FOREIGN: u32 = 1 << 31;

/// A tile's part of the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct TileMesh {
    pub(super) vertices: SemanticCloud,
    /// Whether what lies beyond a vertex was not observed.
    pub(super) boundary: Vec<bool>,
    /// Names of the vertices, rising: see [`name`].
    pub(super) names: Vec<u32>,
    /// Vertices around each quad, counter-clockwise from outside. With [`FOREIGN`]: which axes lead to the tile before in
    /// bits 18 to 20, and the name there.
    pub(super) quads: Vec<[u32; 4]>,
}

/// Everything a tile is computed with, kept for the next one.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    local: Vec<Local>,
    field: Field,
    cells: Cells,
    evidence: Evidence,
    votes: Votes,
}

/// Name of a vertex in its tile: cell in grid order, then loop.
fn name(own: [i32; 3], loop_: u8) -> u32 {
    let cell = own.iter().fold(0, |index, c| index << 5 | *c as u32);
    cell << 3 | u32::from(loop_)
}

/// Meshes the tile whose lowest cell is `first`. `chunks` are all that may hold points within reach, in order; `scale` is
/// the grid's pitch in metres.
pub(super) fn mesh_tile(
    work: &mut Workspace,
    first: [i32; 3],
    chunks: &[&Points],
    kernel: Kernel,
    scale: f64,
) -> TileMesh {
    let Workspace { local, field, cells, evidence, votes } = work;
    let origin = first.map(|c| c - HALO);
    let reach = kernel.radius.ceil() as i32;
    local.clear();
    for (chunk, points) in chunks.iter().enumerate() {
        for (index, placed) in points.placed.iter().enumerate() {
            let cell: [i32; 3] = std::array::from_fn(|a| placed.cell[a] - origin[a]);
            if cell.iter().all(|&c| c >= -reach - 1 && c < NODES as i32 + reach) {
                local.push(Local { cell, point: *placed, chunk: chunk as u32, index: index as u32 });
            }
        }
    }
    let mut mesh = TileMesh::default();
    if local.is_empty() {
        return mesh;
    }
    evidence.fill(local);
    field.fill(local, kernel);
    cells.find(field);
    mesh.vertices = SemanticCloud::with_capacity(cells.list.len());
    mesh.quads.reserve(cells.list.len());
    for cell in &mut cells.list {
        if let Some(own) = own(coordinates(cell.node)) {
            cell.first_vertex = mesh.vertices.len() as u32;
            let vertex = Vertex { nodes: &field.nodes, evidence, local, chunks, kernel, first: origin, scale };
            add_vertices(&mut mesh, cell, own, &vertex, votes);
        }
    }
    for cell in &cells.list {
        // An edge belongs to the tile of its lower node.
        if own(coordinates(cell.node)).is_some() {
            add_quads(&mut mesh, cells, cell);
        }
    }
    mesh
}

/// Place among the tile's own cells.
fn own(at: [i32; 3]) -> Option<[i32; 3]> {
    let own = at.map(|c| c - HALO);
    own.iter().all(|c| (0..TILE_EDGE).contains(c)).then_some(own)
}

fn add_vertices(mesh: &mut TileMesh, cell: &Cell, own: [i32; 3], vertex: &Vertex<'_>, votes: &mut Votes) {
    let shape = cell.shape();
    for number in 0..cell.loops.count {
        let belongs = |e: usize| cell.loops.of_edge[e] == number;
        // A fan may be part of a loop; its vertex is that of the loop.
        let Some(whole) = (0..12).find(|&e| belongs(e)).map(|e| shape.of_edge[e]) else { continue };
        let edges = (0..12).filter(|&e| shape.of_edge[e] == whole).fold(0_u16, |set, e| set | 1 << e);
        mesh.vertices.push(vertex.at(cell.node, edges, shape.count == 1, votes));
        mesh.boundary.push((0..12).any(|e| edges >> e & 1 == 1 && !belongs(e)));
        mesh.names.push(name(own, number));
    }
}

/// Quads over the crossed edges that start at the cell's lowest node.
fn add_quads(mesh: &mut TileMesh, cells: &Cells, cell: &Cell) {
    for axis in 0..3 {
        let edge = 4 * axis;
        if cell.quads >> edge & 1 == 0 {
            continue;
        }
        let [b, c] = others(axis);
        // Around the edge, and the corner of each cell at which the edge starts.
        let around = [(0, 0), (1, 0), (1, 1), (0, 1)];
        let corners = around.map(|(back_b, back_c)| {
            let node = cell.node - back_b * step(b) - back_c * step(c);
            let there = cells.at(node)?;
            let e = edge + back_b + 2 * back_c;
            debug_assert_eq!(node + corner_step(EDGE_CORNERS[e][0]), cell.node);
            let number = there.loops.of_edge[e];
            (number != NO_LOOP).then(|| reference(there, number))
        });
        let [Some(v0), Some(v1), Some(v2), Some(v3)] = corners else { continue };
        // Seen against the axis, (0, 0), (1, 0), (1, 1), (0, 1) steps backwards turn as the axes b and c do; b x c = axis
        // but for the middle axis.
        let inside_first = cell.mask & 1 == 1;
        let quad = if inside_first == (axis != 1) { [v0, v1, v2, v3] } else { [v0, v3, v2, v1] };
        mesh.quads.push(quad);
    }
}

fn reference(cell: &Cell, number: u8) -> u32 {
    let at = coordinates(cell.node);
    if own(at).is_some() {
        return cell.first_vertex + u32::from(number);
    }
    let before = (0..3).filter(|&a| at[a] < HALO).fold(0_u32, |set, a| set | 1 << a);
    FOREIGN | before << 18 | name(at.map(|c| (c - HALO).rem_euclid(TILE_EDGE)), number)
}
