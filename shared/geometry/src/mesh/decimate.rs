//! Fewer triangles: edges are contracted in order of their quadric error [Garland 1997].
//!
//! An edge is contracted only if its ends carry the same component, so each triangle that is left keeps the component it
//! had. Planes along open edges and along component borders, square to the surface, hold both outlines; contractions that
//! would fold the surface over, change its topology or tear an outline off are refused.

use super::blend::blend;
use super::collapse_queue::Queue;
use super::options::MeshError;
use super::progress::Progress;
use super::quadric::Quadric;
use crate::vector::{cross, direction, dot, squared_distance, sub, unit};
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;

/// Weight of a plane along an outline against one of the surface.
const OUTLINE: f64 = 20.0;
/// Least cosine between a triangle's normals before and after.
const FOLD: f64 = 0.3;
/// Least area of a triangle, as a share of the square of its longest edge.
const SLIVER: f64 = 0.02;
/// Contractions between two reports of progress.
const REPORT: usize = 1024;

/// Contracts edges until at most `triangles` are left or no edge may be contracted.
///
/// # Errors
/// [`MeshError::Cancelled`] if `progress` says so.
pub fn decimate(mesh: &SemanticMesh, triangles: usize, progress: &dyn Progress) -> Result<SemanticMesh, MeshError> {
    let total = mesh.triangles.len().saturating_sub(triangles);
    let mut work = Decimation::new(mesh);
    let mut done = 0;
    let mut reported = 0;
    while done < total {
        let Some(pair) = work.queue.pop() else { break };
        done += work.contract(pair.a, pair.b);
        if done / REPORT > reported {
            reported = done / REPORT;
            if progress.advance(done, total).is_break() {
                return Err(MeshError::Cancelled);
            }
        }
    }
    let kept: Vec<[u32; 3]> = work.triangles.iter().flatten().copied().collect();
    Ok(work.mesh.compacted(&kept))
}

struct Decimation {
    mesh: SemanticMesh,
    positions: Vec<[f64; 3]>,
    triangles: Vec<Option<[u32; 3]>>,
    /// Triangles around each vertex.
    fans: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// Vertices on an open edge.
    open: Vec<bool>,
    /// Vertices at a border between components.
    border: Vec<bool>,
    queue: Queue,
}

impl Decimation {
    fn new(mesh: &SemanticMesh) -> Self {
        let n = mesh.len();
        let positions: Vec<[f64; 3]> = mesh.vertices.positions.iter().map(|p| p.map(f64::from)).collect();
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().filter(|t| t.iter().all(|&v| (v as usize) < n)).copied().collect();
        let mut fans = vec![Vec::new(); n];
        let mut quadrics = vec![Quadric::default(); n];
        let mut edges: BTreeMap<[u32; 2], (u32, Option<u32>)> = BTreeMap::new();
        for (i, t) in triangles.iter().enumerate() {
            if let Some((normal, twice)) = normal_of(t.map(|v| positions[v as usize])) {
                let plane = Quadric::plane(normal, positions[t[0] as usize], twice / 6.0);
                t.iter().for_each(|&v| quadrics[v as usize].add(&plane));
            }
            for k in 0..3 {
                fans[t[k] as usize].push(i as u32);
                let (a, b) = (t[k], t[(k + 1) % 3]);
                edges.entry([a.min(b), a.max(b)]).and_modify(|e| e.1 = Some(i as u32)).or_insert((i as u32, None));
            }
        }
        let (mut open, mut border) = (vec![false; n], vec![false; n]);
        for (&[a, b], &(first, second)) in &edges {
            let first = triangles[first as usize];
            let outline = match second {
                None => {
                    open[a as usize] = true;
                    open[b as usize] = true;
                    true
                }
                Some(s) => mesh.triangle_label(first) != mesh.triangle_label(triangles[s as usize]),
            };
            let labels = [a, b].map(|v| mesh.vertices.labels[v as usize]);
            if outline || labels[0] != labels[1] {
                border[a as usize] = true;
                border[b as usize] = true;
            }
            let (pa, pb) = (positions[a as usize], positions[b as usize]);
            let along = sub(pb, pa);
            let across = normal_of(first.map(|v| positions[v as usize])).and_then(|(n, _)| unit(cross(along, n), 0.0));
            if let Some(across) = across.filter(|_| outline) {
                let plane = Quadric::plane(across, pa, OUTLINE * dot(along, along));
                quadrics[a as usize].add(&plane);
                quadrics[b as usize].add(&plane);
            }
        }
        let queue = Queue::new(n);
        let triangles = triangles.into_iter().map(Some).collect();
        let mut work = Self { mesh: mesh.clone(), positions, triangles, fans, quadrics, open, border, queue };
        for [a, b] in edges.into_keys() {
            work.offer(a, b);
        }
        work
    }

    /// Puts an edge into the queue if it may be contracted at all.
    fn offer(&mut self, a: u32, b: u32) {
        if let Some((_, _, cost)) = self.target(a, b) {
            self.queue.push(cost, a, b);
        }
    }

    /// Where the ends of an edge would meet, how far that is from `a` to `b`, and the error there.
    fn target(&self, a: u32, b: u32) -> Option<([f64; 3], f64, f64)> {
        let (i, j) = (a as usize, b as usize);
        if self.mesh.vertices.labels[i] != self.mesh.vertices.labels[j] {
            return None;
        }
        let mut q = self.quadrics[i];
        q.add(&self.quadrics[j]);
        let (pa, pb) = (self.positions[i], self.positions[j]);
        // An outline stays where it is when what is beside it is drawn onto it.
        let rank = |v: usize| u8::from(self.border[v]) + 2 * u8::from(self.open[v]);
        let along = sub(pb, pa);
        let length = dot(along, along);
        let at = |t: f64| std::array::from_fn(|k| pa[k] + t * along[k]);
        let (p, t) = match rank(i).cmp(&rank(j)) {
            std::cmp::Ordering::Greater => (pa, 0.0),
            std::cmp::Ordering::Less => (pb, 1.0),
            std::cmp::Ordering::Equal => match q.least().filter(|p| squared_distance(*p, at(0.5)) <= length) {
                Some(p) => (p, if length > 0.0 { dot(sub(p, pa), along) / length } else { 0.0 }),
                None => [0.5, 0.0, 1.0]
                    .map(|t| (at(t), t))
                    .into_iter()
                    .min_by(|x, y| q.error(x.0).total_cmp(&q.error(y.0)))?,
            },
        };
        // A trace of the edge's length: in a plane all errors are zero, and short edges should go first.
        Some((p, t, q.error(p) + 1e-9 * length * length))
    }

    /// Contracts `b` into `a` unless that would harm the surface; returns how many triangles went.
    fn contract(&mut self, a: u32, b: u32) -> usize {
        let Some((position, share, _)) = self.target(a, b) else { return 0 };
        if !self.keeps_topology(a, b) || self.folds(a, b, position) || self.folds(b, a, position) {
            return 0;
        }
        let (i, j) = (a as usize, b as usize);
        let (Some(va), Some(vb)) = (self.mesh.vertices.get(i), self.mesh.vertices.get(j)) else { return 0 };
        self.mesh.vertices.set(i, blend(&va, &vb, share, position));
        self.mesh.boundary[i] |= self.mesh.boundary[j];
        // What is drawn is rounded to f32; so is what is computed with.
        self.positions[i] = self.mesh.vertices.positions[i].map(f64::from);
        let other = self.quadrics[j];
        self.quadrics[i].add(&other);
        self.open[i] |= self.open[j];
        self.border[i] |= self.border[j];
        let mut gone = 0;
        for t in std::mem::take(&mut self.fans[j]) {
            let Some(corners) = self.triangles[t as usize] else { continue };
            if corners.contains(&a) {
                self.triangles[t as usize] = None;
                gone += 1;
            } else {
                self.triangles[t as usize] = Some(corners.map(|v| if v == b { a } else { v }));
                self.fans[i].push(t);
            }
        }
        let triangles = &self.triangles;
        self.fans[i].retain(|&t| triangles[t as usize].is_some());
        self.queue.gone(b);
        self.queue.changed(a);
        for v in self.around(a) {
            self.offer(a, v);
        }
        gone
    }

    /// Vertices that share a triangle with `v`, in order.
    fn around(&self, v: u32) -> Vec<u32> {
        let corners = self.fans[v as usize].iter().filter_map(|&t| self.triangles[t as usize]).flatten();
        let mut around: Vec<u32> = corners.filter(|&u| u != v).collect();
        around.sort_unstable();
        around.dedup();
        around
    }

    /// The link condition: the ends of the edge have no common neighbours but the tips of its triangles, and two vertices
    /// on open edges are contracted only along one.
    fn keeps_topology(&self, a: u32, b: u32) -> bool {
        let tips =
            self.fans[a as usize].iter().filter_map(|&t| self.triangles[t as usize]).filter(|t| t.contains(&b)).count();
        let (near_a, near_b) = (self.around(a), self.around(b));
        let common = near_a.iter().filter(|v| near_b.binary_search(v).is_ok()).count();
        let both_open = self.open[a as usize] && self.open[b as usize];
        // A closed piece must keep its four corners.
        common == tips && (tips == 2 || tips == 1) && both_open == (tips == 1) && near_a.len() + near_b.len() > 6 + tips
    }

    /// Whether moving `v` to `to`, with `gone` contracted into it, turns a triangle over or makes a sliver of it.
    fn folds(&self, v: u32, gone: u32, to: [f64; 3]) -> bool {
        self.fans[v as usize].iter().filter_map(|&t| self.triangles[t as usize]).filter(|t| !t.contains(&gone)).any(
            |t| {
                let before = t.map(|u| self.positions[u as usize]);
                let after = t.map(|u| if u == v { to } else { self.positions[u as usize] });
                let (Some((old, _)), Some((new, twice))) = (normal_of(before), normal_of(after)) else { return true };
                let longest = (0..3).map(|k| sub(after[k], after[(k + 1) % 3])).map(|e| dot(e, e)).fold(0.0, f64::max);
                dot(old, new) < FOLD || twice < 2.0 * SLIVER * longest
            },
        )
    }
}

/// Unit normal of a triangle and twice its area; `None` if it is degenerate.
fn normal_of([a, b, c]: [[f64; 3]; 3]) -> Option<([f64; 3], f64)> {
    direction(cross(sub(b, a), sub(c, a)), 0.0)
}
