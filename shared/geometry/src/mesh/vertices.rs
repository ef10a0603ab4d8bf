//! Where a vertex lies and what it says: position from the field, everything else from the evidence around it.

use super::cells::corner_step;
use super::field::Kernel;
use super::node::Node;
use super::points::Points;
use super::topology::EDGE_CORNERS;
use super::working_grid::{Local, NODES, coordinates, node_index};
use crate::vector::{dot, unit};
use semascan_model::{PointFlags, SemanticPoint};

/// How far a vertex stays from the sides of its cell, in cells: so no two vertices of a quad meet and no triangle is
/// degenerate.
const MARGIN: f32 = 0.02;
/// Crossings stay this far from the ends of their edge, in cells.
const END: f32 = 0.01;
/// The evidence for a vertex comes from this share of the kernel's radius: labels and colours are sharper than the shape.
const EVIDENCE: f32 = 0.75;
/// The evidence for a defect comes from this many cells around the vertex: its own place. Cracks and scratches
/// are one or two voxels wide. Within a cell, a stripe of one voxel's width has as much weight as what lies beside it, and
/// keeps its width; a wider kernel lets its surroundings outvote it.
const OWN_PLACE: f32 = 1.0;

/// The points of a tile by cell.
#[derive(Debug, Default)]
pub(super) struct Evidence {
    /// For each cell of the working grid 1 + its last point, or 0.
    last: Vec<u32>,
    /// For each point 1 + the one before it in its cell, or 0.
    before: Vec<u32>,
}

impl Evidence {
    /// Sorts in the points of a tile; those outside of the working grid support no vertex.
    pub(super) fn fill(&mut self, local: &[Local]) {
        self.last.clear();
        self.last.resize(NODES * NODES * NODES, 0);
        self.before.clear();
        self.before.resize(local.len(), 0);
        for (i, at) in local.iter().enumerate() {
            if at.cell.iter().all(|&c| (0..NODES as i32).contains(&c)) {
                let last = &mut self.last[node_index(at.cell)];
                self.before[i] = std::mem::replace(last, i as u32 + 1);
            }
        }
    }

    /// Visits the points whose cells are at most `reach` from `cell`.
    fn around(&self, cell: [i32; 3], reach: i32, mut visit: impl FnMut(usize)) {
        let range = |axis: usize| (cell[axis] - reach).max(0)..=(cell[axis] + reach).min(NODES as i32 - 1);
        let heights = range(2);
        for x in range(0) {
            for y in range(1) {
                let row = node_index([x, y, *heights.start()]);
                for &last in &self.last[row..=row + (heights.end() - heights.start()) as usize] {
                    let mut next = last;
                    while next != 0 {
                        visit(next as usize - 1);
                        next = self.before[next as usize - 1];
                    }
                }
            }
        }
    }
}

/// Makes the vertices of a tile.
pub(super) struct Vertex<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) evidence: &'a Evidence,
    pub(super) local: &'a [Local],
    pub(super) chunks: &'a [&'a Points],
    pub(super) kernel: Kernel,
    /// Cell of the working grid's first node.
    pub(super) first: [i32; 3],
    /// Metres a cell.
    pub(super) scale: f64,
}

impl Vertex<'_> {
    /// The vertex of the crossed `edges` (a bit each) of the cell above `node`; `alone` if no other sheet passes through.
    pub(super) fn at(&self, node: usize, edges: u16, alone: bool, votes: &mut Votes) -> SemanticPoint {
        let corners: [Node; 8] = std::array::from_fn(|c| self.nodes[node + corner_step(c as u8)]);
        let (within, normal) = place(&corners, edges, alone);
        let cell = coordinates(node);
        let position = std::array::from_fn(|a| {
            let cells = f64::from(self.first[a] + cell[a]) + f64::from(within[a]);
            (cells * self.scale) as f32
        });
        self.describe(cell, within, normal, position, votes)
    }

    /// Labels, colour and normal by the weight of the points around.
    fn describe(
        &self,
        cell: [i32; 3],
        within: [f32; 3],
        normal: [f32; 3],
        position: [f32; 3],
        votes: &mut Votes,
    ) -> SemanticPoint {
        for radius in [EVIDENCE * self.kernel.radius, self.kernel.radius + 1.0] {
            votes.clear();
            let reach = (radius - 0.5).ceil().max(1.0) as i32;
            let scale = 1.0 / (radius * radius);
            self.evidence.around(cell, reach, |i| {
                let Local { cell: at, point, chunk, index } = &self.local[i];
                let offset = std::array::from_fn(|a| (at[a] - cell[a]) as f32 + point.within[a] - within[a]);
                let near = 1.0 - dot(offset, offset) * scale;
                let known = point.normal != [0.0; 3];
                if near > 0.0 && (!known || dot(point.normal, normal) >= self.kernel.gate) {
                    let whole = &self.chunks[*chunk as usize].points[*index as usize];
                    votes.add(whole, point.normal, point.weight * near * near);
                    let own = 1.0 - dot(offset, offset) / (OWN_PLACE * OWN_PLACE);
                    if own > 0.0 {
                        votes.add_own(whole, point.weight * own * own);
                    }
                }
            });
            if votes.weight > 0.0 {
                return votes.point(position, normal);
            }
        }
        votes.clear();
        votes.point(position, normal)
    }
}

/// Place in the cell (0..1) and direction in which the field rises there.
fn place(corners: &[Node; 8], edges: u16, alone: bool) -> ([f32; 3], [f32; 3]) {
    let (mut sum, mut count, mut mean) = ([0.0_f32; 3], 0.0_f32, [0.0_f32; 3]);
    for e in (0..12_usize).filter(|e| edges >> e & 1 == 1) {
        let [low, high] = EDGE_CORNERS[e].map(usize::from);
        let (f0, f1) = (corners[low].value, corners[high].value);
        let t = (f0 / (f0 - f1)).clamp(END, 1.0 - END);
        // The end outside is on this sheet; the one inside may be nearer to another.
        let outside = corners[if f0 < 0.0 { high } else { low }].normal;
        for a in 0..3 {
            sum[a] += if a == e / 4 { t } else { (low >> a & 1) as f32 };
            mean[a] += outside[a];
        }
        count += 1.0;
    }
    let mut at = sum.map(|s| s / count.max(1.0));
    let normal = unit(mean, 1e-3).unwrap_or([0.0, 0.0, 1.0]);
    if alone {
        // The mean of crossings lies inside a curved surface: one Newton step puts it back.
        let (value, gradient) = trilinear(corners, at);
        let squared = dot(gradient, gradient);
        if squared > 0.1 && dot(gradient, normal) > 0.5 * squared.sqrt() {
            let step = (value / squared).clamp(-0.5, 0.5);
            at = std::array::from_fn(|a| at[a] - step * gradient[a]);
        }
    }
    (at.map(|c| c.clamp(MARGIN, 1.0 - MARGIN)), normal)
}

/// Value and gradient of the field between the corners of a cell.
fn trilinear(corners: &[Node; 8], at: [f32; 3]) -> (f32, [f32; 3]) {
    let (mut value, mut gradient) = (0.0, [0.0; 3]);
    for (c, corner) in corners.iter().enumerate() {
        let high = [0, 1, 2].map(|a| c >> a & 1 == 1);
        let w: [f32; 3] = std::array::from_fn(|a| if high[a] { at[a] } else { 1.0 - at[a] });
        let sign = high.map(|h| if h { 1.0 } else { -1.0 });
        value += w[0] * w[1] * w[2] * corner.value;
        gradient[0] += sign[0] * w[1] * w[2] * corner.value;
        gradient[1] += sign[1] * w[0] * w[2] * corner.value;
        gradient[2] += sign[2] * w[0] * w[1] * corner.value;
    }
    (value, gradient)
}

/// What the points around a vertex say, each with its weight.
#[derive(Debug, Default)]
pub(super) struct Votes {
    weight: f32,
    normal: [f32; 3],
    color: [f32; 3],
    sigma: f32,
    defect_sigma: f32,
    views: f32,
    /// Evidence by component class and instance.
    components: Tally<(u16, u16)>,
    /// Evidence by defect class.
    defects: Tally<u16>,
    /// Of the points at the vertex's own place: weight, evidence by defect class.
    own_weight: f32,
    own_defects: Tally<u16>,
}

impl Votes {
    /// Forgets everything but its memory: there is a vertex every few hundred nanoseconds.
    fn clear(&mut self) {
        let Self { components, defects, own_defects, .. } = std::mem::take(self);
        self.components = components;
        self.defects = defects;
        self.own_defects = own_defects;
        self.components.0.clear();
        self.defects.0.clear();
        self.own_defects.0.clear();
    }

    fn add(&mut self, p: &SemanticPoint, normal: [f32; 3], weight: f32) {
        self.weight += weight;
        self.normal.iter_mut().zip(normal).for_each(|(sum, n)| *sum += weight * n);
        self.color.iter_mut().zip(p.color).for_each(|(sum, c)| *sum += weight * f32::from(c));
        self.sigma += weight * finite(p.sigma);
        self.defect_sigma += weight * finite(p.defect_sigma);
        self.views += weight * f32::from(p.views);
        self.components.add((p.label, p.instance), weight * finite(p.confidence));
        self.defects.add(p.defect, weight * finite(p.defect_confidence));
    }

    /// Adds a point at the vertex's own place.
    fn add_own(&mut self, p: &SemanticPoint, weight: f32) {
        self.own_weight += weight;
        self.own_defects.add(p.defect, weight * finite(p.defect_confidence));
    }

    fn point(&self, position: [f32; 3], along: [f32; 3]) -> SemanticPoint {
        let share = 1.0 / self.weight.max(f32::MIN_POSITIVE);
        let (label, confidence) = self.components.best(|(label, _)| label);
        // Of the class that won, the instance with most evidence.
        let instance = self
            .components
            .0
            .iter()
            .filter_map(|&(key, e)| (key.0 == label && e > 0.0).then_some((key.1, e)))
            .fold((0, 0.0), heavier)
            .0;
        // Where nothing at its own place says anything of defects, what lies around does.
        let (defect, defect_confidence) = match self.own_defects.best(|defect| defect) {
            (defect, evidence) if evidence > 0.0 => (defect, evidence / self.own_weight),
            _ => {
                let (defect, evidence) = self.defects.best(|defect| defect);
                (defect, evidence * share)
            }
        };
        SemanticPoint {
            position,
            normal: unit(self.normal, 1e-3 * self.weight).unwrap_or(along),
            color: self.color.map(|c| (c * share).round().clamp(0.0, 255.0) as u8),
            label,
            confidence: (confidence * share).min(1.0),
            defect,
            defect_confidence: defect_confidence.min(1.0),
            sigma: self.sigma * share,
            defect_sigma: self.defect_sigma * share,
            instance,
            views: (self.views * share).round() as u16,
            flags: PointFlags(if confidence > 0.0 { 0 } else { PointFlags::UNLABELLED }),
        }
    }
}

/// Evidence by key, in order of first appearance: a vertex sees few classes.
#[derive(Debug)]
struct Tally<K>(Vec<(K, f32)>);

impl<K> Default for Tally<K> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: Copy + PartialEq> Tally<K> {
    fn add(&mut self, key: K, evidence: f32) {
        match self.0.iter_mut().find(|(k, _)| *k == key) {
            Some((_, sum)) => *sum += evidence,
            None => self.0.push((key, evidence)),
        }
    }

    /// The class with most evidence, and that evidence; ties go to the lower class.
    fn best(&self, class: impl Fn(K) -> u16) -> (u16, f32) {
        let of_class = |c: u16| self.0.iter().filter(|(k, _)| class(*k) == c).map(|(_, e)| e).sum::<f32>();
        self.0.iter().map(|(k, _)| (class(*k), of_class(class(*k)))).fold((0, 0.0), heavier)
    }
}

/// The entry with more evidence; of equals the lower class.
fn heavier(best: (u16, f32), next: (u16, f32)) -> (u16, f32) {
    if next.1 > best.1 || (next.1 == best.1 && next.1 > 0.0 && next.0 < best.0) { next } else { best }
}

fn finite(share: f32) -> f32 {
    if share.is_finite() { share.max(0.0) } else { 0.0 }
}
