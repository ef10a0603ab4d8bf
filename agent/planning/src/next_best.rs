//! Next best view: of all poses that the cell reaches the one that would add most; and, as a baseline behind the same interface
//! and on the same poses, the one that would see most frontier cells.

use crate::coverage::{Coverage, Patch};
use crate::gain::{WELL_SEEN, expected_gain};
use crate::reach::Reach;
use crate::visibility::{Glance, SeenPatch};
use rayon::prelude::*;
use semascan_inspection::planning::{Decision, NextView, ViewPlanner, Viewpoint};
use semascan_inspection::spec::{PlanSpec, PlanStrategy};
use semascan_model::record::{ExpectedGain, PlanCoverage, PlanPurpose, PlanStop, UnreachableRegion};
use semascan_perception::fuse::SemanticMap;
use semascan_perception::view::Intrinsics;

/// Pieces of unreachable surface that are reported.
const REGIONS: usize = 16;
/// Cells of the smallest of them.
const LEAST_CELLS: usize = 8;

/// By what the next view is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    /// What it would add.
    Gain,
    /// Frontier cells that it would see.
    FrontierCount,
}

/// Chooses the next view by what the model lacks.
pub(crate) struct NextBest {
    rule: Rule,
    coverage: Coverage,
    reach: Reach,
    poses: Vec<Viewpoint>,
    /// Poses that were taken: a second view from the same place shows the same.
    taken: Vec<bool>,
    glance: Glance,
    least_gain: f64,
    views: u32,
    seed: u64,
    asked: u32,
    last: Option<Viewpoint>,
}

impl NextBest {
    pub(crate) fn new(
        rule: Rule,
        coverage: Coverage,
        reach: Reach,
        poses: Vec<Viewpoint>,
        camera: &Intrinsics,
        spec: &PlanSpec,
    ) -> Self {
        Self {
            rule,
            glance: Glance::new(camera, coverage.edge, 0.5 * (reach.distance.0 + reach.distance.1)),
            coverage,
            taken: vec![false; poses.len()],
            poses,
            reach,
            least_gain: spec.least_gain,
            views: spec.views,
            seed: spec.seed,
            asked: 0,
            last: None,
        }
    }

    fn see(&self, patches: &[Patch]) -> Vec<Vec<SeenPatch>> {
        self.poses.par_iter().map(|pose| self.glance.see(patches, &pose.table_from_camera())).collect()
    }

    /// The gain of each pose, by the rule.
    fn gains(&self, patches: &[Patch], seen: &[Vec<SeenPatch>]) -> Vec<ExpectedGain> {
        let area = self.coverage.cell_area();
        let gain = |(pose, seen): (&Viewpoint, &Vec<SeenPatch>)| match self.rule {
            Rule::Gain => expected_gain(&self.coverage, &self.reach, patches, seen, pose, self.last.as_ref()),
            Rule::FrontierCount => {
                let frontier = area * seen.iter().filter(|s| patches[s.patch].is_frontier()).count() as f64;
                ExpectedGain { frontier, score: frontier, ..ExpectedGain::default() }
            }
        };
        self.poses.par_iter().zip(seen).map(gain).collect()
    }

    /// What is covered: surface and frontier, and what of that no pose sees well.
    fn covered(&self, patches: &[Patch], seen: &[Vec<SeenPatch>]) -> PlanCoverage {
        let area = self.coverage.cell_area();
        let mut reachable = vec![false; patches.len()];
        for seen in seen.iter().flatten().filter(|s| s.cosine >= WELL_SEEN) {
            reachable[seen.patch] = true;
        }
        let sum = |of: &dyn Fn(usize, &Patch) -> bool| {
            let chosen = patches.iter().enumerate().filter(|(i, p)| of(*i, p));
            chosen.map(|(_, p)| area * f64::from(p.likelihood)).sum::<f64>()
        };
        let hidden: Vec<&Patch> =
            (0..patches.len()).filter(|i| patches[*i].is_frontier() && !reachable[*i]).map(|i| &patches[i]).collect();
        PlanCoverage {
            convention: format!(
                "areas of cells of {:.1} mm, one side each; surface that is not known by its likelihood; well seen: \
                 within 75 degrees of incidence",
                1e3 * self.coverage.edge
            ),
            measured: sum(&|_, p| !p.is_frontier()),
            well_seen: sum(&|_, p| !p.is_frontier() && p.cosine >= WELL_SEEN),
            frontier: sum(&|i, p| p.is_frontier() && reachable[i]),
            unreachable: sum(&|i, p| p.is_frontier() && !reachable[i]),
            unreachable_regions: connected(&hidden, &self.coverage),
        }
    }
}

impl ViewPlanner for NextBest {
    fn strategy(&self) -> PlanStrategy {
        match self.rule {
            Rule::Gain => PlanStrategy::NextBest,
            Rule::FrontierCount => PlanStrategy::Greedy,
        }
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn most_views(&self) -> u32 {
        self.views
    }

    fn next(&mut self, model: Option<&SemanticMap>) -> Decision {
        if let Some(Err(error)) = model.map(|map| self.coverage.follow(map)) {
            // The plan is worse without it, the views are as good.
            tracing::warn!("a view is planned without what could not be read back: {error}");
        }
        let patches = self.coverage.patches();
        let seen = self.see(&patches);
        let gains = self.gains(&patches, &seen);
        // Of equal poses the first.
        let free = (0..self.poses.len()).filter(|i| !self.taken[*i]);
        let best = free.reduce(|best, i| if gains[i].score > gains[best].score { i } else { best });
        let measured = self.coverage.cell_area() * patches.iter().filter(|p| !p.is_frontier()).count() as f64;
        let stop = |why| Decision::Stop { why, coverage: Some(Box::new(self.covered(&patches, &seen))) };
        let Some(best) = best else { return stop(PlanStop::NoPose) };
        if self.asked == self.views {
            return stop(PlanStop::ViewLimit);
        }
        let expected = gains[best];
        // The price of the way is no reason to stop.
        let share = (expected.frontier + expected.quality + expected.labels) / measured;
        if measured > 0.0 && (share < self.least_gain || share <= 0.0) {
            return stop(PlanStop::LittleGain { expected: share, least: self.least_gain });
        }
        self.asked += 1;
        self.taken[best] = true;
        let viewpoint = self.poses[best].clone();
        self.last = Some(viewpoint.clone());
        let candidates = self.poses.len() as u32;
        Decision::Capture(Box::new(NextView {
            viewpoint,
            purpose: PlanPurpose::Overall,
            expected: Some(expected),
            candidates,
        }))
    }
}

/// The largest connected pieces of `patches`, the largest first.
fn connected(patches: &[&Patch], coverage: &Coverage) -> Vec<UnreachableRegion> {
    let size = coverage.size.map(|n| n as i64);
    let place = |cell: u32| {
        let cell = i64::from(cell);
        [cell % size[0], cell / size[0] % size[1], cell / size[0] / size[1]]
    };
    let mut waiting: std::collections::BTreeMap<[i64; 3], &Patch> =
        patches.iter().map(|patch| (place(patch.cell), *patch)).collect();
    let mut regions = Vec::new();
    while let Some((first, patch)) = waiting.pop_first() {
        let (mut piece, mut open) = (vec![patch], vec![first]);
        while let Some([x, y, z]) = open.pop() {
            for step in 0..27 {
                let beside = [x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1];
                if let Some(patch) = waiting.remove(&beside) {
                    piece.push(patch);
                    open.push(beside);
                }
            }
        }
        if piece.len() >= LEAST_CELLS {
            let count = piece.len() as f64;
            let centre = [0, 1, 2].map(|k| piece.iter().map(|p| f64::from(p.centre[k])).sum::<f64>() / count);
            let area = piece.iter().map(|p| coverage.cell_area() * f64::from(p.likelihood)).sum();
            regions.push(UnreachableRegion { centre, area });
        }
    }
    regions.sort_by(|a, b| b.area.total_cmp(&a.area));
    regions.truncate(REGIONS);
    regions
}
