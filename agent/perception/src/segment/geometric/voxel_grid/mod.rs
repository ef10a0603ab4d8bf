//! Points gathered into voxels, and which voxels touch: the graph that supervoxels grow on ([Papon 2013], section III
//! A: 26-connected adjacency).
//!
//! Voxels are found by sorting integer addresses, not by hashing. Neighbouring pixels mostly share a voxel, so runs of
//! equal addresses are summed before the sort and a picture of 300 k pixels sorts some 60 k runs. Neighbours come from
//! sweeps of the sorted addresses, one pointer for each of the four lower rows around a voxel.
//!
//! The grid is centred on the bounding box of the points, as PCL's octree is, and voxels are numbered along the Morton
//! curve; so a figure of PCL for the same points is a figure for the same voxels.

use super::points::ColoredPoints;
use semascan_geometry::grid::morton;

/// Stands for no voxel, or no patch.
pub const NONE: u32 = u32::MAX;

/// Voxels an axis may have: 20 bits each way, so that an address fits a `u64`.
const LIMIT: f64 = (1 << 20) as f64 - 2.0;
pub(super) const BITS: u32 = 21;

/// Occupied voxels and their adjacency.
#[derive(Clone, Debug, Default)]
pub struct VoxelGrid {
    /// Mean position of each voxel's points, metres.
    pub positions: Vec<[f32; 3]>,
    /// Mean colour, 0 to 255.
    pub colors: Vec<[f32; 3]>,
    /// Points in each voxel.
    pub counts: Vec<u32>,
    /// Voxel of each point; [`NONE`] for points that are missing or out of reach.
    pub of_point: Vec<u32>,
    first: Vec<u32>,
    touching: Vec<u32>,
}

/// Consecutive points in one voxel.
struct Run {
    key: u64,
    from: u32,
    to: u32,
    position: [f32; 3],
    color: [u32; 3],
}

impl VoxelGrid {
    /// Voxels of edge `size` metres that hold `points`. Empty if `size` is not a length.
    pub fn new(points: &ColoredPoints, size: f32) -> Self {
        let mut grid = Self { of_point: vec![NONE; points.len()], ..Self::default() };
        let usable = size.is_finite() && size > 0.0;
        let Some(centre) = centre(&points.positions, size).filter(|_| usable) else {
            grid.first = vec![0];
            return grid;
        };
        let runs = runs(points, centre, size);
        let mut order: Vec<(u64, u32)> = runs.iter().enumerate().map(|(i, r)| (r.key, i as u32)).collect();
        sort_by_key(&mut order);
        let groups: Vec<&[(u64, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let keys: Vec<u64> = groups.iter().map(|g| g[0].0).collect();

        // Row-major order finds neighbours; the Morton curve numbers the voxels.
        let mut curve: Vec<(u64, u32)> = keys.iter().enumerate().map(|(i, &k)| (morton(unpack(k)), i as u32)).collect();
        sort_by_key(&mut curve);
        let mut number = vec![0_u32; keys.len()];
        for (n, &(_, row_major)) in curve.iter().enumerate() {
            number[row_major as usize] = n as u32;
            let (mut position, mut color, mut count) = ([0.0_f32; 3], [0_u32; 3], 0_u32);
            for &(_, run) in groups[row_major as usize] {
                let run = &runs[run as usize];
                for a in 0..3 {
                    position[a] += run.position[a];
                    color[a] += run.color[a];
                }
                // Runs are contiguous: missing points end them.
                count += run.to - run.from;
                grid.of_point[run.from as usize..run.to as usize].fill(n as u32);
            }
            let share = 1.0 / count as f32;
            grid.positions.push(position.map(|x| x * share));
            grid.colors.push(color.map(|c| c as f32 * share));
            grid.counts.push(count);
        }
        let pairs = adjacent(&keys);
        (grid.first, grid.touching) = neighbour_lists(&pairs, &number);
        grid
    }

    /// Number of occupied voxels.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether no voxel is occupied.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The occupied voxels that touch voxel `i` by face, edge or corner, itself excluded.
    pub fn neighbours(&self, i: u32) -> &[u32] {
        &self.touching[self.first[i as usize] as usize..self.first[i as usize + 1] as usize]
    }
}

/// Where the grid is centred: the middle of the bounding box, or the origin where one voxel grid cannot span the box.
/// `None` without a single finite point.
fn centre(positions: &[[f32; 3]], size: f32) -> Option<[f64; 3]> {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in positions.iter().filter(|p| is_finite(p)) {
        for a in 0..3 {
            low[a] = low[a].min(p[a]);
            high[a] = high[a].max(p[a]);
        }
    }
    if low[0] > high[0] {
        return None;
    }
    let spans = (0..3).all(|a| (f64::from(high[a]) - f64::from(low[a])) / f64::from(size) < LIMIT);
    let middle = |a: usize| 0.5 * (f64::from(low[a]) + f64::from(high[a]));
    Some(if spans { [middle(0), middle(1), middle(2)] } else { [0.0; 3] })
}

fn is_finite(p: &[f32; 3]) -> bool {
    p[0].is_finite() && p[1].is_finite() && p[2].is_finite()
}

fn runs(points: &ColoredPoints, centre: [f64; 3], size: f32) -> Vec<Run> {
    let scale = 1.0 / f64::from(size);
    let mut runs: Vec<Run> = Vec::with_capacity(points.len() / 4 + 1);
    let mut open = false;
    for (i, p) in points.positions.iter().enumerate() {
        let Some(key) = pack([0, 1, 2].map(|a| (f64::from(p[a]) - centre[a]) * scale)) else {
            open = false;
            continue;
        };
        let color = points.color(i);
        match runs.last_mut().filter(|r| open && r.key == key) {
            Some(run) => {
                run.to = i as u32 + 1;
                for a in 0..3 {
                    run.position[a] += p[a];
                    run.color[a] += u32::from(color[a]);
                }
            }
            None => runs.push(Run { key, from: i as u32, to: i as u32 + 1, position: *p, color: color.map(u32::from) }),
        }
        open = true;
    }
    runs
}

/// Address of the cell that holds a position given in cells; `None` out of reach or not finite.
pub(super) fn pack(at: [f64; 3]) -> Option<u64> {
    const HALF: f64 = (1 << (BITS - 1)) as f64;
    // Positive from here on, so that the conversion to an integer is the floor.
    let [x, y, z] = at.map(|c| c + HALF);
    let inside = |c: f64| c > HALF - LIMIT && c < HALF + LIMIT;
    (inside(x) && inside(y) && inside(z))
        .then(|| u64::from(x as u32) << (2 * BITS) | u64::from(y as u32) << BITS | u64::from(z as u32))
}

/// The coordinates of an address.
pub(super) fn unpack(key: u64) -> [u32; 3] {
    [2, 1, 0].map(|a| (key >> (a * BITS)) as u32 & ((1 << BITS) - 1))
}

/// Stable radix sort by the key, over the digits in which keys differ at all.
pub(super) fn sort_by_key(items: &mut Vec<(u64, u32)>) {
    const DIGIT: u32 = 11;
    let differing = items.iter().fold(0, |bits, i| bits | (i.0 ^ items[0].0));
    let mut other = vec![(0, 0); items.len()];
    for shift in (0..64).step_by(DIGIT as usize) {
        let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
        if digit(differing) == 0 {
            continue;
        }
        let mut starts = [0_u32; 1 << DIGIT];
        for item in items.iter() {
            starts[digit(item.0)] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += std::mem::replace(start, sum);
        }
        for item in items.iter() {
            let start = &mut starts[digit(item.0)];
            other[*start as usize] = *item;
            *start += 1;
        }
        std::mem::swap(items, &mut other);
    }
}

/// Pairs of sorted addresses that are neighbours in 26-connectivity, lower address first.
fn adjacent(keys: &[u64]) -> Vec<(u32, u32)> {
    let row = |dx: i64, dy: i64| ((dx << (2 * BITS)) + (dy << BITS)) as u64;
    let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(keys.len() * 5);
    for (i, pair) in keys.windows(2).enumerate() {
        if pair[1] - pair[0] == 1 {
            pairs.push((i as u32, i as u32 + 1));
        }
    }
    for (dx, dy) in [(0, 1), (1, -1), (1, 0), (1, 1)] {
        let mut at = 0;
        for (i, &key) in keys.iter().enumerate() {
            // Coordinates stay a voxel clear of the ends of their bits, so sums never carry into the next axis.
            let lowest = key.wrapping_add(row(dx, dy)) - 1;
            while keys.get(at).is_some_and(|&k| k < lowest) {
                at += 1;
            }
            let near = keys[at..].iter().take(3).take_while(|&&k| k - lowest <= 2).count();
            pairs.extend((at..at + near).map(|j| (i as u32, j as u32)));
        }
    }
    pairs
}

/// Adjacency lists of renumbered pairs: where each list begins, and all lists in a row.
pub(super) fn neighbour_lists(pairs: &[(u32, u32)], number: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; number.len() + 1];
    let renumbered = |&(a, b): &(u32, u32)| (number[a as usize], number[b as usize]);
    for (a, b) in pairs.iter().map(renumbered) {
        first[a as usize] += 1;
        first[b as usize] += 1;
    }
    let mut sum = 0;
    for f in &mut first {
        sum += *f;
        *f = sum;
    }
    let mut touching = vec![0; pairs.len() * 2];
    for (a, b) in pairs.iter().rev().map(renumbered) {
        for (from, to) in [(a, b), (b, a)] {
            first[from as usize] -= 1;
            touching[first[from as usize] as usize] = to;
        }
    }
    (first, touching)
}

#[cfg(test)]
mod tests;
