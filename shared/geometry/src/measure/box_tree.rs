//! A bounding volume hierarchy for nearest-neighbour queries: four boxes a node, tested together.
//!
//! Items are halved at the median of the longest side of their centres' box [Friedman 1977], twice for each node, so
//! that the tree is balanced and its shape depends on the number of items alone. Tight boxes prune better than
//! splitting planes where points lie on surfaces. A query walks nearest box first and ends when no box is nearer than
//! what it has.

use super::batch;
use glam::Vec4;

/// Items from which two halves are sorted beside each other.
const PARALLEL: usize = 1 << 14;
/// Marks a child that is a leaf.
const LEAF_BIT: u32 = 1 << 31;
/// Deepest stack: a balanced tree of 2^32 items has 17 levels, and each leaves up to three boxes behind.
const STACK: usize = 64;

/// Lower and upper corner of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Bounds {
    /// A box that holds nothing and is infinitely far from everything.
    pub(super) const EMPTY: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    /// Grows to hold a point.
    pub(super) fn include(&mut self, p: [f32; 3]) {
        for (axis, c) in p.into_iter().enumerate() {
            self.low[axis] = self.low[axis].min(c);
            self.high[axis] = self.high[axis].max(c);
        }
    }

    /// Grows to hold another box.
    fn join(&mut self, other: &Self) {
        self.include(other.low);
        self.include(other.high);
    }

    fn longest_side(&self) -> usize {
        let side = |a: usize| self.high[a] - self.low[a];
        (0..3).fold(0, |best, a| if side(a) > side(best) { a } else { best })
    }
}

/// What the tree sorts: where an item is, and which it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) centre: [f32; 3],
    pub(super) item: u32,
}

/// Boxes of four children, and what they are: a node, or a leaf if [`LEAF_BIT`] is set.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
    children: [u32; 4],
}

impl Node {
    /// Squared distances to the four boxes.
    #[inline(always)]
    fn distances(&self, p: &[Vec4; 3]) -> [f32; 4] {
        let along = |a: usize| (self.low[a] - p[a]).max(p[a] - self.high[a]).max(Vec4::ZERO);
        let (x, y, z) = (along(0), along(1), along(2));
        (x * x + y * y + z * z).to_array()
    }
}

/// Balanced hierarchy over leaves of `LEAF` items.
#[derive(Clone, Debug)]
pub(super) struct BoxTree<const LEAF: usize> {
    nodes: Vec<Node>,
    /// A node or a leaf; `None` without items.
    root: Option<u32>,
}

impl<const LEAF: usize> BoxTree<LEAF> {
    /// Sorts `entries` into the order of the leaves: leaf `i` holds entries `i * LEAF ..`, and only the last leaf may be
    /// short. `bounds` gives the box of an item.
    pub(super) fn new(entries: &mut [Entry], bounds: impl Fn(u32) -> Bounds) -> Self {
        sort::<LEAF>(entries);
        let mut tree = Self { nodes: Vec::with_capacity(entries.len() / (2 * LEAF) + 1), root: None };
        if !entries.is_empty() {
            tree.root = Some(tree.build(entries, 0, &bounds).0);
        }
        tree
    }

    /// Makes the subtree over `entries`, which begin at position `at`.
    fn build(&mut self, entries: &[Entry], at: usize, bounds: &impl Fn(u32) -> Bounds) -> (u32, Bounds) {
        if entries.len() <= LEAF {
            let mut hull = Bounds::EMPTY;
            entries.iter().for_each(|e| hull.join(&bounds(e.item)));
            return ((at / LEAF) as u32 | LEAF_BIT, hull);
        }
        let id = self.nodes.len();
        self.nodes.push(Node { low: [Vec4::INFINITY; 3], high: [Vec4::NEG_INFINITY; 3], children: [0; 4] });
        let (left, right) = entries.split_at(middle::<LEAF>(entries.len()));
        let mut hull = Bounds::EMPTY;
        let mut slot = 0;
        for (half, at) in [(left, at), (right, at + left.len())] {
            let (first, second) = half.split_at(middle::<LEAF>(half.len()));
            for (part, at) in [(first, at), (second, at + first.len())] {
                if part.is_empty() {
                    continue;
                }
                let (child, b) = self.build(part, at, bounds);
                let node = &mut self.nodes[id];
                for axis in 0..3 {
                    node.low[axis][slot] = b.low[axis];
                    node.high[axis][slot] = b.high[axis];
                }
                node.children[slot] = child;
                slot += 1;
                hull.join(&b);
            }
        }
        (id as u32, hull)
    }

    /// Calls `leaf` with the number of each leaf whose box is nearer to `p` than `bound` (squared), nearest boxes first.
    /// `leaf` lowers the bound as it finds nearer items. `p` has to be finite.
    #[inline(always)]
    pub(super) fn walk(&self, p: [f32; 3], bound: &mut f32, mut leaf: impl FnMut(usize, &mut f32)) {
        let Some(mut at) = self.root else { return };
        let splat = p.map(Vec4::splat);
        let mut stack = [(0.0_f32, 0_u32); STACK];
        let mut top = 0;
        loop {
            if at & LEAF_BIT != 0 {
                leaf((at & !LEAF_BIT) as usize, bound);
            } else {
                let node = &self.nodes[at as usize];
                let distances = node.distances(&splat);
                let base = top;
                for (d, child) in distances.into_iter().zip(node.children) {
                    // Sorted, farthest first; a box that holds nothing is infinitely far.
                    if d < *bound {
                        let mut place = top;
                        while place > base && stack[place - 1].0 < d {
                            stack[place] = stack[place - 1];
                            place -= 1;
                        }
                        stack[place] = (d, child);
                        top += 1;
                    }
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if stack[top].0 < *bound {
                    at = stack[top].1;
                    break;
                }
            }
        }
    }
}

/// Entries that go to the left half: whole leaves.
fn middle<const LEAF: usize>(entries: usize) -> usize {
    (entries.div_ceil(LEAF).div_ceil(2) * LEAF).min(entries)
}

/// Brings entries into the order of the leaves.
fn sort<const LEAF: usize>(entries: &mut [Entry]) {
    if entries.len() <= LEAF {
        return;
    }
    let mut hull = Bounds::EMPTY;
    entries.iter().for_each(|e| hull.include(e.centre));
    let at = middle::<LEAF>(entries.len());
    if at < entries.len() {
        match hull.longest_side() {
            0 => entries.select_nth_unstable_by(at, |a, b| a.centre[0].total_cmp(&b.centre[0])),
            1 => entries.select_nth_unstable_by(at, |a, b| a.centre[1].total_cmp(&b.centre[1])),
            _ => entries.select_nth_unstable_by(at, |a, b| a.centre[2].total_cmp(&b.centre[2])),
        };
    }
    let (left, right) = entries.split_at_mut(at);
    if left.len() >= PARALLEL {
        batch::both(|| sort::<LEAF>(left), || sort::<LEAF>(right));
    } else {
        sort::<LEAF>(left);
        sort::<LEAF>(right);
    }
}
