//! What rings enclose, by the even-odd rule: a place is inside if a ray from it crosses rings an odd number of times.
//!
//! A line is swept upwards over the rings. Between two heights at which edges begin or end, edges do not change their order, and
//! the first and second, the third and fourth of them bound what is inside. A quad goes on as long as its two edges do, so there
//! are about as many quads as edges. Rings that cross each other, which those of a surface that does not cross itself do not, are
//! told apart between their places only.

use super::Place;
use std::collections::BTreeMap;

/// Four corners, in order around; two of them may be one.
pub type Quad = [Place; 4];

/// An edge from its lower to its higher end.
#[derive(Clone, Copy)]
struct Edge {
    low: Place,
    high: Place,
}

impl Edge {
    fn at(&self, height: f64) -> f64 {
        if height <= self.low[1] {
            return self.low[0];
        }
        if height >= self.high[1] {
            return self.high[0];
        }
        let share = (height - self.low[1]) / (self.high[1] - self.low[1]);
        self.low[0] + share * (self.high[0] - self.low[0])
    }
}

/// The inside of rings as quads that do not overlap.
pub fn fill(rings: &[Vec<Place>]) -> Vec<Quad> {
    let edges = edges(rings);
    let mut heights: Vec<f64> = edges.iter().flat_map(|edge| [edge.low[1], edge.high[1]]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let mut quads = Vec::new();
    // Where the quad between two edges began.
    let mut growing: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let (mut coming, mut active) = (0, Vec::new());
    for strip in heights.windows(2) {
        let [bottom, top] = [strip[0], strip[1]];
        while edges.get(coming).is_some_and(|edge| edge.low[1] <= bottom) {
            active.push(coming);
            coming += 1;
        }
        active.retain(|&e: &usize| edges[e].high[1] > bottom);
        let middle = 0.5 * (bottom + top);
        active.sort_by(|a, b| edges[*a].at(middle).total_cmp(&edges[*b].at(middle)).then(a.cmp(b)));
        let before = std::mem::take(&mut growing);
        for pair in active.chunks_exact(2) {
            let pair = (pair[0], pair[1]);
            growing.insert(pair, before.get(&pair).copied().unwrap_or(bottom));
        }
        quads.extend(
            before.iter().filter(|(pair, _)| !growing.contains_key(pair)).map(|(p, b)| quad(&edges, *p, *b, bottom)),
        );
    }
    if let Some(top) = heights.last() {
        quads.extend(growing.iter().map(|(pair, begin)| quad(&edges, *pair, *begin, *top)));
    }
    quads
}

/// Area of quads, square metres.
pub fn area(quads: &[Quad]) -> f64 {
    let of = |quad: &Quad| {
        let doubled: f64 = (0..4).map(|i| cross(quad[i], quad[(i + 1) % 4], quad[0])).sum();
        0.5 * doubled.abs()
    };
    quads.iter().map(of).fold(0.0, |sum, of| sum + of)
}

/// Edges that are not level, the lowest first.
fn edges(rings: &[Vec<Place>]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for ring in rings.iter().filter(|ring| ring.iter().flatten().all(|c| c.is_finite())) {
        for (from, to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            if from[1] != to[1] {
                let (low, high) = if from[1] < to[1] { (*from, *to) } else { (*to, *from) };
                edges.push(Edge { low, high });
            }
        }
    }
    edges.sort_by(|a, b| a.low[1].total_cmp(&b.low[1]));
    edges
}

fn quad(edges: &[Edge], (left, right): (usize, usize), bottom: f64, top: f64) -> Quad {
    let (left, right) = (&edges[left], &edges[right]);
    [[left.at(bottom), bottom], [right.at(bottom), bottom], [right.at(top), top], [left.at(top), top]]
}

fn cross(a: Place, b: Place, from: Place) -> f64 {
    (a[0] - from[0]) * (b[1] - from[1]) - (a[1] - from[1]) * (b[0] - from[0])
}
