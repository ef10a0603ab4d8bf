//! Pairs to contract, cheapest first, in an order that depends on nothing but costs and indices.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A pair of vertices or points to contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Pair {
    /// Bits of the cost: of numbers that are not negative the bits are in the order of the numbers.
    cost: u64,
    pub(super) a: u32,
    pub(super) b: u32,
    /// How often `a` and `b` had changed when the cost was computed.
    changes: [u32; 2],
}

/// Pairs by cost. A pair whose ends changed since is passed over.
#[derive(Debug, Default)]
pub(super) struct Queue {
    heap: BinaryHeap<Reverse<Pair>>,
    changes: Vec<u32>,
}

/// Changes of an end that is gone.
const GONE: u32 = u32::MAX;

impl Queue {
    pub(super) fn new(ends: usize) -> Self {
        Self { heap: BinaryHeap::new(), changes: vec![0; ends] }
    }

    /// Adds a pair; `cost` is not negative.
    pub(super) fn push(&mut self, cost: f64, a: u32, b: u32) {
        let (a, b) = (a.min(b), a.max(b));
        let changes = [a, b].map(|v| self.changes[v as usize]);
        if cost.is_finite() {
            self.heap.push(Reverse(Pair { cost: cost.max(0.0).to_bits(), a, b, changes }));
        }
    }

    /// The cheapest pair that still stands.
    pub(super) fn pop(&mut self) -> Option<Pair> {
        while let Some(Reverse(pair)) = self.heap.pop() {
            let now = [pair.a, pair.b].map(|v| self.changes[v as usize]);
            if now == pair.changes && !now.contains(&GONE) {
                return Some(pair);
            }
        }
        None
    }

    /// Makes pairs with `v` void.
    pub(super) fn changed(&mut self, v: u32) {
        self.changes[v as usize] += 1;
    }

    /// Takes `v` out for good.
    pub(super) fn gone(&mut self, v: u32) {
        self.changes[v as usize] = GONE;
    }

    /// Whether `v` was taken out.
    pub(super) fn is_gone(&self, v: u32) -> bool {
        self.changes[v as usize] == GONE
    }
}
