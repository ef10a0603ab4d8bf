//! Locally Convex Connected Patches [Stein 2014], which [Eye-in-hand 2020], section 3.1.2, builds on: supervoxels that
//! meet convexly belong to one object.
//!
//! For touching supervoxels with centroids x1, x2 and unit normals n1, n2, let d = x1 - x2, beta the angle between the
//! normals and s = n1 x n2:
//! - convexity CC_b: `n1.d >= n2.d`, or beta below a tolerance;
//! - sanity SC: the angle between s and d, folded to at most 90 degrees, is not below
//!   `60 deg / (1 + exp(-0.25 (beta - 25 deg)))`: patches that meet in a single point say nothing;
//! - smoothness, if asked for: no step, `min(|d.n1|, |d.n2|) <= |s| R + c r`;
//! - extended convexity CC_e: at least k common neighbours meet both ends convexly.
//!
//! Segments are the connected components of what is left; small ones join their largest neighbour. As in the authors'
//! code, the flags that k counts include sanity and smoothness.

use super::vccs::{Patch, Supervoxels, VccsConfig};
use semascan_geometry::vector::{cross, dot, length};

/// How supervoxels are joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LccpConfig {
    /// Concave edges up to this angle between the normals still join, radians.
    pub concavity_tolerance: f32,
    /// Common neighbours that must agree.
    pub k: u32,
    /// Whether the sanity criterion applies.
    pub sanity: bool,
    /// Slack of the smoothness criterion in voxels; `None` leaves it out.
    pub smoothness: Option<f32>,
    /// Segments of at most this many supervoxels join their largest neighbour.
    pub small: u32,
}

impl Default for LccpConfig {
    fn default() -> Self {
        Self { concavity_tolerance: 10_f32.to_radians(), k: 1, sanity: true, smoothness: None, small: 0 }
    }
}

/// Segments of a cloud: which supervoxels belong together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Segments {
    /// Segment of each supervoxel, numbered from 0 in the order of their first supervoxels.
    pub of_patch: Vec<u32>,
    /// Number of segments.
    pub count: u32,
}

/// Segments of `supervoxels` by convexity alone.
pub fn lccp(supervoxels: &Supervoxels, vccs: &VccsConfig, config: &LccpConfig) -> Segments {
    join(supervoxels, &extended(supervoxels, &convex_edges(supervoxels, vccs, config), config.k), config.small)
}

/// For every edge, whether its ends meet convexly (CC_b, and SC and smoothness where they apply).
pub(super) fn convex_edges(supervoxels: &Supervoxels, vccs: &VccsConfig, config: &LccpConfig) -> Vec<bool> {
    let patch = |i: u32| &supervoxels.patches[i as usize];
    supervoxels.edges.iter().map(|&[a, b]| convex(patch(a), patch(b), vccs, config)).collect()
}

fn convex(a: &Patch, b: &Patch, vccs: &VccsConfig, config: &LccpConfig) -> bool {
    if dot(a.normal, a.normal) < 0.5 || dot(b.normal, b.normal) < 0.5 {
        return false;
    }
    let (n1, n2) = (a.normal, b.normal);
    let d = [0, 1, 2].map(|k| a.position[k] - b.position[k]);
    let s = cross(n1, n2);
    let beta = dot(n1, n2).clamp(-1.0, 1.0).acos();
    if let Some(slack) = config.smoothness {
        let step = dot(d, n1).abs().min(dot(d, n2).abs());
        if step > length(s) * vccs.seed + slack * vccs.voxel {
            return false;
        }
    }
    if config.sanity {
        // Folded to at most 90 degrees; parallel normals have no s, and nothing to object to.
        let along = length(s) * length(d);
        let theta = if along > 1e-12 { (dot(s, d).abs() / along).min(1.0).acos() } else { std::f32::consts::FRAC_PI_2 };
        if theta.to_degrees() < 60.0 / (1.0 + (-0.25 * (beta.to_degrees() - 25.0)).exp()) {
            return false;
        }
    }
    dot(n1, d) >= dot(n2, d) || beta < config.concavity_tolerance
}

/// CC_e: which convex edges have `k` common neighbours that both ends meet convexly, judged on the flags as given.
pub(super) fn extended(supervoxels: &Supervoxels, convex: &[bool], k: u32) -> Vec<bool> {
    if k == 0 {
        return convex.to_vec();
    }
    // Convex neighbours of each patch; edges come in order, so one list is sorted after both directions are in.
    let mut near: Vec<Vec<u32>> = vec![Vec::new(); supervoxels.patches.len()];
    for (&[a, b], _) in supervoxels.edges.iter().zip(convex).filter(|(_, c)| **c) {
        near[a as usize].push(b);
        near[b as usize].push(a);
    }
    near.iter_mut().for_each(|list| list.sort_unstable());
    let common = |a: u32, b: u32| {
        let b = &near[b as usize];
        near[a as usize].iter().filter(|n| b.binary_search(n).is_ok()).take(k as usize).count() as u32
    };
    supervoxels.edges.iter().zip(convex).map(|(&[a, b], &c)| c && common(a, b) >= k).collect()
}

/// Connected components of the `valid` edges; segments of at most `small` supervoxels then join a neighbour.
pub(super) fn join(supervoxels: &Supervoxels, valid: &[bool], small: u32) -> Segments {
    let mut sets = DisjointSets::new(supervoxels.patches.len());
    for (&[a, b], _) in supervoxels.edges.iter().zip(valid).filter(|(_, v)| **v) {
        sets.unite(a, b);
    }
    absorb_small(&mut sets, &supervoxels.edges, small);
    let mut number = vec![u32::MAX; supervoxels.patches.len()];
    let mut segments = Segments::default();
    for i in 0..supervoxels.patches.len() as u32 {
        let root = sets.root(i) as usize;
        if number[root] == u32::MAX {
            number[root] = segments.count;
            segments.count += 1;
        }
        segments.of_patch.push(number[root]);
    }
    segments
}

/// The smallest segments first join their largest neighbours, until all are large enough or stand alone.
fn absorb_small(sets: &mut DisjointSets, edges: &[[u32; 2]], small: u32) {
    for limit in 1..=small {
        loop {
            // Best neighbour of each small root: the largest, the lower root where two are as large.
            let mut best: std::collections::BTreeMap<u32, (u32, u32)> = std::collections::BTreeMap::new();
            for &[a, b] in edges {
                let (a, b) = (sets.root(a), sets.root(b));
                for (from, to) in [(a, b), (b, a)] {
                    if from != to && sets.size(from) <= limit {
                        let offer = (sets.size(to), u32::MAX - to);
                        let slot = best.entry(from).or_insert(offer);
                        *slot = (*slot).max(offer);
                    }
                }
            }
            if best.is_empty() {
                break;
            }
            for (from, (_, to)) in best {
                sets.unite(u32::MAX - to, from);
            }
        }
    }
}

/// Union-find whose roots are the lowest members.
struct DisjointSets {
    parent: Vec<u32>,
    size: Vec<u32>,
}

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect(), size: vec![1; n] }
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let above = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = above;
            i = above;
        }
        i
    }

    fn size(&self, root: u32) -> u32 {
        self.size[root as usize]
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            let (low, high) = (a.min(b), a.max(b));
            self.parent[high as usize] = low;
            self.size[low as usize] += self.size[high as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn patch(position: [f32; 3], normal: [f32; 3]) -> Patch {
        let n = dot(normal, normal).sqrt();
        Patch { position, normal: normal.map(|c| c / n), color: [0.0; 3], voxels: 1 }
    }

    fn is_convex(a: &Patch, b: &Patch) -> bool {
        convex(a, b, &VccsConfig::new(0.0075), &LccpConfig::default())
    }

    #[test]
    fn ridges_are_convex_and_valleys_are_not() {
        // Two faces of a roof, and the same faces turned into a gutter.
        let (left, right) = (patch([-0.02, 0.0, 0.5], [-1.0, 0.0, -1.0]), patch([0.02, 0.0, 0.5], [1.0, 0.0, -1.0]));
        assert!(is_convex(&left, &right) && is_convex(&right, &left));
        let (left, right) = (patch([-0.02, 0.0, 0.5], [1.0, 0.0, -1.0]), patch([0.02, 0.0, 0.5], [-1.0, 0.0, -1.0]));
        assert!(!is_convex(&left, &right) && !is_convex(&right, &left));
        // A shallow gutter is within the tolerance.
        let (left, right) = (patch([-0.02, 0.0, 0.5], [0.05, 0.0, -1.0]), patch([0.02, 0.0, 0.5], [-0.05, 0.0, -1.0]));
        assert!(is_convex(&left, &right));
    }

    #[test]
    fn the_sanity_criterion_rejects_patches_that_touch_in_a_point() {
        // The crease (along y) runs the way the patches stand apart: they lie beside each other along it.
        let (a, b) = (patch([0.0, -0.02, 0.5], [-1.0, 0.0, -1.0]), patch([0.0, 0.02, 0.5], [1.0, 0.0, -1.0]));
        assert!(!is_convex(&a, &b));
        let without = LccpConfig { sanity: false, ..LccpConfig::default() };
        assert!(convex(&a, &b, &VccsConfig::new(0.0075), &without));
    }

    #[test]
    fn the_smoothness_criterion_rejects_a_step() {
        let (a, b) = (patch([0.0, 0.0, 0.5], [0.0, 0.0, -1.0]), patch([0.03, 0.0, 0.505], [0.0, 0.0, -1.0]));
        assert!(is_convex(&a, &b));
        let smooth = LccpConfig { smoothness: Some(0.1), ..LccpConfig::default() };
        assert!(!convex(&a, &b, &VccsConfig::new(0.0075), &smooth));
    }

    #[test]
    fn extended_convexity_needs_a_common_neighbour() {
        // A triangle 0, 1, 2 and a tail 2-3: the tail has no witness.
        let supervoxels = Supervoxels {
            patches: vec![Patch::default(); 4],
            edges: vec![[0, 1], [0, 2], [1, 2], [2, 3]],
            of_point: Vec::new(),
        };
        assert_eq!(extended(&supervoxels, &[true; 4], 1), [true, true, true, false]);
        assert_eq!(extended(&supervoxels, &[true, false, true, true], 1), [false; 4]);
        assert_eq!(extended(&supervoxels, &[true; 4], 0), [true; 4]);
    }

    #[test]
    fn small_segments_join_the_largest_neighbour() {
        // 0-1-2 and 4-5 are segments, 3 between them is alone.
        let supervoxels = Supervoxels {
            patches: vec![Patch::default(); 7],
            edges: vec![[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]],
            of_point: Vec::new(),
        };
        let valid = [true, true, false, false, true];
        assert_eq!(join(&supervoxels, &valid, 0).of_patch, [0, 0, 0, 1, 2, 2, 3]);
        assert_eq!(join(&supervoxels, &valid, 1).of_patch, [0, 0, 0, 0, 1, 1, 2], "6 touches nothing");
        assert_eq!(join(&supervoxels, &valid, 2).of_patch, [0, 0, 0, 0, 0, 0, 1]);
    }

    proptest! {
        #[test]
        fn segments_are_numbered_without_gaps(
            edges in prop::collection::btree_set((0_u32..20, 0_u32..20), 0..60),
            keep in prop::collection::vec(any::<bool>(), 60),
            small in 0_u32..5,
        ) {
            let edges: Vec<[u32; 2]> = edges.into_iter().filter(|(a, b)| a < b).map(|(a, b)| [a, b]).collect();
            let supervoxels = Supervoxels { patches: vec![Patch::default(); 20], edges, of_point: Vec::new() };
            let segments = join(&supervoxels, &keep[..supervoxels.edges.len()], small);
            let mut seen: Vec<u32> = segments.of_patch.clone();
            seen.sort_unstable();
            seen.dedup();
            prop_assert_eq!(seen, (0..segments.count).collect::<Vec<_>>());
            for (&[a, b], _) in supervoxels.edges.iter().zip(&keep).filter(|(_, k)| **k) {
                prop_assert_eq!(segments.of_patch[a as usize], segments.of_patch[b as usize]);
            }
            // What is still small has no neighbour to join.
            for s in 0..segments.count {
                let size = segments.of_patch.iter().filter(|&&x| x == s).count() as u32;
                let of = |p: u32| segments.of_patch[p as usize];
                let touches = supervoxels.edges.iter().any(|&[a, b]| (of(a) == s) != (of(b) == s));
                prop_assert!(size > small || !touches);
            }
        }
    }
}
