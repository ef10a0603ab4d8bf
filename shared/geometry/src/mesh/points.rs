//! The points of one chunk of the map as the mesher wants them: placed in the grid and in an order of their own, so that
//! every sum over them is the same whichever way they came.

use crate::grid::cell;
use crate::vector::dot;
use semascan_model::{SemanticCloud, SemanticPoint};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Largest absolute cell index: far beyond any part, and sums of a few cells cannot overflow.
const CELL_LIMIT: f64 = (1 << 28) as f64;

/// A point in the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Cell that holds the point.
    pub(super) cell: [i32; 3],
    /// Place in that cell, 0..1 along each axis.
    pub(super) within: [f32; 3],
    /// Unit normal; zero where unknown.
    pub(super) normal: [f32; 3],
    /// How much the point counts: a mean over more views is worth more.
    pub(super) weight: f32,
}

/// The points of one chunk.
#[derive(Clone, Debug, Default)]
pub(super) struct Points {
    pub(super) placed: Vec<Placed>,
    /// The points themselves, in the same order.
    pub(super) points: Vec<SemanticPoint>,
    /// Lowest and highest cell; meaningless without points.
    pub(super) bounds: [[i32; 3]; 2],
}

impl Points {
    /// Places `points` in a grid of `pitch` metres. Points without a finite position and those with any of `skip_flags`
    /// are left out.
    pub(super) fn new(points: impl Iterator<Item = SemanticPoint>, pitch: f64, skip_flags: u16) -> Self {
        let kept = points.filter(|p| !p.flags.has(skip_flags)).filter_map(|p| Some((place(&p, pitch)?, p)));
        let (placed, points): (Vec<Placed>, Vec<SemanticPoint>) = kept.unzip();
        let mut bounds = [[i32::MAX; 3], [i32::MIN; 3]];
        for placed in &placed {
            for (axis, &c) in placed.cell.iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(c);
                bounds[1][axis] = bounds[1][axis].max(c);
            }
        }
        let order = in_order(&placed, &points, bounds);
        let (placed, points) = order.iter().map(|&i| (placed[i as usize], points[i as usize])).unzip();
        Self { placed, points, bounds }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }
}

/// Cuts a cloud into chunks of `edge` metres: chunk coordinates with the indices of their points, in order. Points with
/// any of `skip_flags` are left out.
pub(super) fn cut(cloud: &SemanticCloud, edge: f64, skip_flags: u16) -> Vec<([i32; 3], Vec<u32>)> {
    let mut chunks: BTreeMap<[i32; 3], Vec<u32>> = BTreeMap::new();
    // Neighbours in a cloud mostly are neighbours in space: runs of points go to their chunk at once.
    let mut run: ([i32; 3], Vec<u32>) = Default::default();
    for (i, (position, flags)) in cloud.positions.iter().zip(&cloud.flags).enumerate() {
        let id = cell(*position, edge);
        if flags.has(skip_flags) || !id.iter().all(|c| c.abs() < CELL_LIMIT) {
            continue;
        }
        let id = id.map(|c| c as i32);
        if id != run.0 {
            chunks.entry(run.0).or_default().append(&mut run.1);
            run.0 = id;
        }
        run.1.push(i as u32);
    }
    chunks.entry(run.0).or_default().append(&mut run.1);
    chunks.into_iter().filter(|(_, points)| !points.is_empty()).collect()
}

fn place(p: &SemanticPoint, pitch: f64) -> Option<Placed> {
    let mut placed = Placed { cell: [0; 3], within: [0.0; 3], normal: [0.0; 3], weight: 1.0 };
    for (axis, lowest) in cell(p.position, pitch).into_iter().enumerate() {
        if !lowest.is_finite() || lowest.abs() > CELL_LIMIT {
            return None;
        }
        placed.cell[axis] = lowest as i32;
        placed.within[axis] = (f64::from(p.position[axis]) / pitch - lowest) as f32;
    }
    let squared = dot(p.normal, p.normal);
    if squared.is_finite() && squared > 1e-6 {
        let length = squared.sqrt();
        placed.normal = p.normal.map(|c| c / length);
    }
    placed.weight = f32::from(p.views.clamp(1, MOST_VIEWS));
    Some(placed)
}

/// Views past this number add no more weight: what is left of the error then is common to all.
const MOST_VIEWS: u16 = 8;

/// Indices of the points by cell, along x, y, z; in one cell in an order of their own.
fn in_order(placed: &[Placed], points: &[SemanticPoint], [low, high]: [[i32; 3]; 2]) -> Vec<u32> {
    let by_point = |a: &u32, b: &u32| points_in_order(&points[*a as usize], &points[*b as usize]);
    // Chunks are small: their cells fit a number, and numbers are quick to sort.
    if (0..3).any(|a| i64::from(high[a]) - i64::from(low[a]) >= 1 << 10) {
        let mut order: Vec<u32> = (0..placed.len() as u32).collect();
        order.sort_unstable_by(|a, b| {
            placed[*a as usize].cell.cmp(&placed[*b as usize].cell).then_with(|| by_point(a, b))
        });
        return order;
    }
    let key = |(i, p): (usize, &Placed)| {
        let cell = (0..3).fold(0, |key, a| key << 10 | (p.cell[a] - low[a]) as u64);
        cell << 32 | i as u64
    };
    let mut keys: Vec<u64> = placed.iter().enumerate().map(key).collect();
    keys.sort_unstable();
    let mut order: Vec<u32> = keys.iter().map(|k| *k as u32).collect();
    let mut rest = order.as_mut_slice();
    for run in keys.chunk_by(|a, b| a >> 32 == b >> 32) {
        let (cell, after) = rest.split_at_mut(run.len());
        cell.sort_unstable_by(by_point);
        rest = after;
    }
    order
}

/// An order of points in one cell that depends on nothing but the points.
fn points_in_order(a: &SemanticPoint, b: &SemanticPoint) -> Ordering {
    let key = |p: &SemanticPoint| (p.position.map(f32::to_bits), p.normal.map(f32::to_bits), p.color);
    let rest = |p: &SemanticPoint| (p.label, p.defect, p.instance, p.views, p.flags.0, p.confidence.to_bits());
    let unsure = |p: &SemanticPoint| [p.defect_confidence, p.sigma, p.defect_sigma].map(f32::to_bits);
    key(a).cmp(&key(b)).then_with(|| rest(a).cmp(&rest(b))).then_with(|| unsure(a).cmp(&unsure(b)))
}
