//! Shortest ways on a triangle mesh.
//!
//! Dijkstra's algorithm with the update across faces of [Novotni 2002]: the distance of a face's third corner from that of the
//! other two, as if the source lay in the unfolded plane of the face. It is exact on a plane and needs no edge to run along the
//! way. Lengths of edges are the caller's, who knows how much of them is roughness.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A piece of surface as ways over it need it.
pub struct Geodesics {
    /// First edge of each vertex, and one past the last.
    edge_starts: Vec<usize>,
    /// Number and distance of each vertex's neighbours.
    edges: Vec<(u32, f64)>,
    /// First wedge of each vertex, and one past the last.
    wedge_starts: Vec<usize>,
    wedges: Vec<Wedge>,
}

/// A face as one of its corners sees it: the two others, and the lengths of the edges, metres.
struct Wedge {
    others: [u32; 2],
    to_others: [f64; 2],
    between: f64,
}

/// Distances from a source.
#[derive(Clone, Debug, PartialEq)]
pub struct Distances {
    /// Of each vertex, metres; infinite where no way leads.
    pub metres: Vec<f64>,
    /// The vertex over which the way to each comes; itself at a source and where no way leads.
    pub before: Vec<u32>,
}

/// A finite distance in the order of its size.
#[derive(Clone, Copy, PartialEq)]
struct Distance(f64);

impl Eq for Distance {}

impl PartialOrd for Distance {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Distance {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Vertices that were reached, the nearest first.
type Reached = BinaryHeap<Reverse<(Distance, u32)>>;

impl Geodesics {
    /// The surface of vertices 0 to `count`.
    ///
    /// * `neighbours`: those of a vertex.
    /// * `faces`: corners of the faces around a vertex; one whose corners are no neighbours of each other is left out.
    /// * `length`: of the edge between two vertices, metres.
    pub fn new<N: IntoIterator<Item = u32>, F: IntoIterator<Item = [u32; 3]>>(
        count: u32,
        neighbours: impl Fn(u32) -> N,
        faces: impl Fn(u32) -> F,
        length: impl Fn(u32, u32) -> f64,
    ) -> Self {
        let (mut edge_starts, mut edges, mut wedge_starts, mut wedges) = (vec![0], Vec::new(), vec![0], Vec::new());
        for v in 0..count {
            let first = edges.len();
            edges.extend(neighbours(v).into_iter().map(|w| (w, length(v, w))));
            edge_starts.push(edges.len());
            // The other corners of its faces are among its neighbours.
            let beside = &edges[first..];
            for face in faces(v) {
                let mut others = face.into_iter().filter(|w| *w != v);
                let (Some(u), Some(w)) = (others.next(), others.next()) else { continue };
                let found = |w: u32| beside.iter().find(|(other, _)| *other == w);
                let (Some(&left), Some(&right)) = (found(u), found(w)) else { continue };
                wedges.push(Wedge { others: [u, w], to_others: [left.1, right.1], between: length(u, w) });
            }
            wedge_starts.push(wedges.len());
        }
        Self { edge_starts, edges, wedge_starts, wedges }
    }

    /// Distance of each vertex from `sources`, vertices with the distance that they begin with, metres.
    pub fn distances(&self, sources: &[(u32, f64)]) -> Distances {
        let count = self.edge_starts.len() - 1;
        let mut found = Distances { metres: vec![f64::INFINITY; count], before: (0..count as u32).collect() };
        let mut done = vec![false; count];
        let mut reached = Reached::new();
        for &(source, metres) in sources {
            offer(&mut found, &mut reached, source, (metres, source));
        }
        while let Some(Reverse((_, at))) = reached.pop() {
            let from = at as usize;
            if std::mem::replace(&mut done[from], true) {
                continue;
            }
            let here = found.metres[from];
            for &(next, length) in &self.edges[self.edge_starts[from]..self.edge_starts[from + 1]] {
                offer(&mut found, &mut reached, next, (here + length, at));
            }
            for wedge in &self.wedges[self.wedge_starts[from]..self.wedge_starts[from + 1]] {
                for (second, third) in [(0, 1), (1, 0)] {
                    let [known, wanted] = [second, third].map(|k: usize| wedge.others[k]);
                    if done[known as usize] && !done[wanted as usize] {
                        let [to_known, to_wanted] = [second, third].map(|k: usize| wedge.to_others[k]);
                        let from_known = found.metres[known as usize];
                        if let Some(distance) = across_face([to_known, to_wanted, wedge.between], here, from_known) {
                            offer(&mut found, &mut reached, wanted, (distance, at));
                        }
                    }
                }
            }
        }
        found
    }
}

impl Distances {
    /// The vertices over which the way to `vertex` comes, from there back to the source.
    pub fn way_to(&self, vertex: u32) -> Vec<u32> {
        let mut way = vec![vertex];
        let mut at = vertex;
        while let Some(&before) = self.before.get(at as usize).filter(|before| **before != at) {
            way.push(before);
            at = before;
        }
        way
    }
}

/// A way to `vertex` of this distance over another vertex: taken if it is the shortest yet.
fn offer(found: &mut Distances, reached: &mut Reached, vertex: u32, (distance, over): (f64, u32)) {
    let Some(known) = found.metres.get_mut(vertex as usize) else { return };
    if distance < *known {
        *known = distance;
        found.before[vertex as usize] = over;
        reached.push(Reverse((Distance(distance), vertex)));
    }
}

/// Distance of corner `c` of a face with the edges `ab`, `ac` and `bc`, whose corners `a` and `b` have the distances `from_a`
/// and `from_b`, along a straight way that crosses the edge between these; `None` where there is none.
fn across_face([ab, ac, bc]: [f64; 3], from_a: f64, from_b: f64) -> Option<f64> {
    // In the plane of the face: a in the origin, b on the x axis, c above it and the source below.
    let foot = |to_a: f64, to_b: f64| {
        let x = (to_a * to_a - to_b * to_b + ab * ab) / (2.0 * ab);
        let squared = to_a * to_a - x * x;
        (squared >= 0.0).then(|| (x, squared.sqrt()))
    };
    let (corner, source) = (foot(ac, bc)?, foot(from_a, from_b)?);
    let height = corner.1 + source.1;
    let crossing = source.0 + (corner.0 - source.0) * source.1 / height;
    (height > 0.0 && (0.0..=ab).contains(&crossing)).then(|| (corner.0 - source.0).hypot(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `n` by `n` cells of side 1, its diagonals all one way.
    fn square(n: u32) -> Geodesics {
        let at = |v: u32| ((v % (n + 1)) as f64, (v / (n + 1)) as f64);
        let faces: Vec<[u32; 3]> = (0..n)
            .flat_map(|j| (0..n).map(move |i| j * (n + 1) + i))
            .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
            .collect();
        let around = |v: u32| faces.iter().filter(move |f| f.contains(&v)).copied();
        let neighbours = |v: u32| {
            let mut all: Vec<u32> = around(v).flatten().filter(|w| *w != v).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let length = |a: u32, b: u32| (at(a).0 - at(b).0).hypot(at(a).1 - at(b).1);
        Geodesics::new((n + 1) * (n + 1), neighbours, around, length)
    }

    #[test]
    fn ways_on_a_plane_are_straight_in_every_direction() {
        let n = 20;
        let surface = square(n);
        let from = surface.distances(&[(0, 0.0)]);
        for (v, metres) in (0_u32..).zip(&from.metres) {
            let straight = f64::from(v % (n + 1)).hypot(f64::from(v / (n + 1)));
            assert!((metres - straight).abs() < 1e-6 + 0.01 * straight, "{v}: {metres} for {straight}");
        }
        let way = from.way_to(n * (n + 1) + n / 2);
        assert_eq!((way[0], way[way.len() - 1]), (n * (n + 1) + n / 2, 0));
        let later = surface.distances(&[(0, 5.0), (999_999, 0.0)]);
        assert!(
            (later.metres[1] - 6.0).abs() < 1e-12,
            "a source begins with its distance, one that is not there is none"
        );
        assert!(Geodesics::new(1, |_| [], |_| [], |_, _| 0.0).distances(&[]).metres[0].is_infinite());
    }
}
