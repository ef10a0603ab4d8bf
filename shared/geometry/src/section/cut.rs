//! From a mesh to the outlines of its section.
//!
//! A vertex on the plane counts as beyond it. So the plane crosses two edges of a triangle or none, never a vertex, and each
//! crossing is known by its edge alone: triangles that share an edge share the crossing, whatever rounding says, and outlines
//! are as closed as the surface is. What lies in the plane has the outline that a plane a hair before it would have.
//!
//! Triangles wind one way, so their segments do, too: a crossing from before to beyond ends a segment of one triangle and begins
//! that of its neighbour. The mesh must be wound so, as those of the mesher are.

use super::{End, Outline, Place, Plane, PlaneSection, distance};
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;

/// Places nearer than this are one, metres.
const SAME: f64 = 1e-9;

/// A crossed edge: the vertex before the plane, and that beyond it.
type Crossing = (u32, u32);

/// What the plane cuts out of one triangle.
struct Piece {
    from: Crossing,
    to: Crossing,
    label: u16,
}

impl PlaneSection {
    /// The section of those triangles of `mesh` (metres) whose component class `shows` accepts.
    pub fn of(mesh: &SemanticMesh, plane: Plane, shows: impl Fn(u16) -> bool) -> Self {
        let positions = &mesh.vertices.positions;
        let heights: Vec<f64> = positions.iter().map(|p| plane.height(p.map(f64::from))).collect();
        let pieces = pieces(mesh, &heights, shows);
        let place = |(before, beyond): Crossing| -> Place {
            let (low, high) = (heights[before as usize], heights[beyond as usize]);
            let share = low / (low - high);
            let [a, b] = [before, beyond].map(|v| positions[v as usize].map(f64::from));
            plane.drop([0, 1, 2].map(|k| a[k] + share * (b[k] - a[k])))
        };
        let outlines: Vec<Outline> = chains(&pieces).iter().filter_map(|chain| outline(chain, place)).collect();
        let rings = outlines.iter().filter(|outline| outline.is_closed()).map(|o| o.places.clone()).collect();
        Self { plane, outlines, rings }
    }
}

fn pieces(mesh: &SemanticMesh, heights: &[f64], shows: impl Fn(u16) -> bool) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for &triangle in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(|v| heights.get(v as usize).map(|h| *h >= 0.0)) else {
            continue;
        };
        // Far fewer are crossed than not.
        if a == b && b == c {
            continue;
        }
        let label = mesh.triangle_label(triangle);
        if !shows(label) || triangle.iter().any(|v| !heights[*v as usize].is_finite()) {
            continue;
        }
        let ([i, j, k], beyond) = (triangle, [a, b, c]);
        let edges = [(i, j, beyond[0], beyond[1]), (j, k, beyond[1], beyond[2]), (k, i, beyond[2], beyond[0])];
        let (mut from, mut to) = (None, None);
        for (start, end, starts_beyond, ends_beyond) in edges {
            match (starts_beyond, ends_beyond) {
                (false, true) => to = Some((start, end)),
                (true, false) => from = Some((end, start)),
                _ => {}
            }
        }
        if let (Some(from), Some(to)) = (from, to) {
            pieces.push(Piece { from, to, label });
        }
    }
    pieces
}

/// Pieces joined where one ends and the other begins; each is in one chain.
fn chains(pieces: &[Piece]) -> Vec<Vec<&Piece>> {
    // In order, so that the result is: first come, first joined.
    let mut beginning: BTreeMap<Crossing, Vec<usize>> = BTreeMap::new();
    let mut ending: BTreeMap<Crossing, usize> = BTreeMap::new();
    for (index, piece) in pieces.iter().enumerate().rev() {
        beginning.entry(piece.from).or_default().push(index);
        *ending.entry(piece.to).or_default() += 1;
    }
    let mut is_taken = vec![false; pieces.len()];
    let mut chains = Vec::new();
    // Where nothing ends an open line begins; what is left after those goes round.
    let begins_open = |piece: &Piece| !ending.contains_key(&piece.from);
    for wants_open in [true, false] {
        for (first, piece) in pieces.iter().enumerate() {
            if is_taken[first] || begins_open(piece) != wants_open {
                continue;
            }
            let mut chain = Vec::new();
            let mut next = Some(first);
            while let Some(index) = next {
                is_taken[index] = true;
                chain.push(&pieces[index]);
                if pieces[index].to == piece.from {
                    break;
                }
                let followers = beginning.get_mut(&pieces[index].to);
                next = followers.and_then(|f| {
                    while let Some(index) = f.pop() {
                        if !is_taken[index] {
                            return Some(index);
                        }
                    }
                    None
                });
            }
            chains.push(chain);
        }
    }
    chains
}

/// The line of a chain, without pieces that have no length; `None` where none has.
fn outline(chain: &[&Piece], place: impl Fn(Crossing) -> Place) -> Option<Outline> {
    let (first, last) = (chain.first()?, chain.last()?);
    let is_closed = first.from == last.to;
    let (mut places, mut labels) = (vec![place(first.from)], Vec::new());
    for piece in chain {
        let to = place(piece.to);
        if places.last().is_some_and(|last| distance(*last, to) > SAME) {
            places.push(to);
            labels.push(piece.label);
        }
    }
    if is_closed {
        // The last place is the first one again, or nearer to it than places are told apart.
        places.pop();
    }
    let least = if is_closed { 3 } else { 2 };
    (places.len() >= least).then(|| Outline { places, labels, ends: (!is_closed).then_some([End::Rim; 2]) })
}
