//! Baselines that do not look at the model: a regular turn, and random poses as [Remanufacturing paper] sampled its data.

use crate::reach::Reach;
use nalgebra::UnitQuaternion;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_inspection::planning::{Decision, NextView, ViewPlanner, Viewpoint, look_at};
use semascan_inspection::spec::{PlanSpec, PlanStrategy};
use semascan_model::record::{PlanPurpose, PlanStop};
use semascan_perception::fuse::SemanticMap;
use semascan_perception::view::Intrinsics;
use std::f64::consts::TAU;

/// Polar angles of a regular turn, as shares of their range: every step of the table at the next one.
const HEIGHTS: [f64; 3] = [0.51, 0.07, 0.91];
/// Largest turn of a random view about each of its axes, radians (10 degrees).
const JITTER: f64 = 0.174_533;
/// Draws before a random pose within the limits is given up.
const DRAWS: usize = 10_000;

/// Regular steps of the table at three heights.
pub(crate) struct RegularTurn {
    reach: Reach,
    distance: f64,
    views: u32,
    seed: u64,
    next: u32,
}

impl RegularTurn {
    /// A turn of `spec.views` views that show all of the measuring volume where the distance allows it.
    pub(crate) fn new(reach: Reach, camera: &Intrinsics, spec: &PlanSpec) -> Self {
        let smaller = (f64::from(camera.width) / camera.fx).min(f64::from(camera.height) / camera.fy);
        let distance = reach.radius() / (0.5 * smaller).atan().sin();
        Self {
            distance: distance.clamp(reach.distance.0, reach.distance.1),
            reach,
            views: spec.views,
            seed: spec.seed,
            next: 0,
        }
    }

    fn viewpoint(&self, index: u32) -> Viewpoint {
        let between = |(low, high): (f64, f64), share: f64| low + (high - low) * share;
        let polar = between(self.reach.polar, HEIGHTS[index as usize % HEIGHTS.len()]);
        let eye = self.reach.place(between(self.reach.azimuth, 0.5), polar, self.distance);
        let table_angle = between(self.reach.table, f64::from(index) / f64::from(self.views));
        Viewpoint { tablebase_from_camera: look_at(eye, self.reach.centre), table_angle }
    }
}

impl ViewPlanner for RegularTurn {
    fn strategy(&self) -> PlanStrategy {
        PlanStrategy::Uniform
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn most_views(&self) -> u32 {
        self.views
    }

    fn next(&mut self, _: Option<&SemanticMap>) -> Decision {
        while self.next < self.views {
            let viewpoint = self.viewpoint(self.next);
            self.next += 1;
            // A step that the cell does not reach is left out.
            if self.reach.check(&viewpoint).is_ok() {
                return capture(viewpoint, self.views);
            }
        }
        Decision::Stop { why: PlanStop::ViewLimit, coverage: None }
    }
}

/// Poses anywhere within the limits of the cell, each turned by up to 10 degrees about its axes.
pub(crate) struct RandomPoses {
    reach: Reach,
    views: u32,
    seed: u64,
    random: Pcg64,
    taken: u32,
}

impl RandomPoses {
    /// `spec.views` of them.
    pub(crate) fn new(reach: Reach, spec: &PlanSpec) -> Self {
        Self { reach, views: spec.views, seed: spec.seed, random: Pcg64::seed_from_u64(spec.seed), taken: 0 }
    }

    fn draw(&mut self) -> Viewpoint {
        let random = &mut self.random;
        let mut within = |(low, high): (f64, f64)| low + (high - low) * random.random_range(0.0..1.0);
        let (azimuth, polar) = (within(self.reach.azimuth), within(self.reach.polar));
        let eye = self.reach.place(azimuth, polar, within(self.reach.distance));
        let mut jitter = || within((-JITTER, JITTER));
        let turn = UnitQuaternion::from_euler_angles(jitter(), jitter(), jitter());
        let table_angle = within(self.reach.table).rem_euclid(TAU);
        Viewpoint { tablebase_from_camera: look_at(eye, self.reach.centre) * turn, table_angle }
    }
}

impl ViewPlanner for RandomPoses {
    fn strategy(&self) -> PlanStrategy {
        PlanStrategy::Random
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn most_views(&self) -> u32 {
        self.views
    }

    fn next(&mut self, _: Option<&SemanticMap>) -> Decision {
        if self.taken == self.views {
            return Decision::Stop { why: PlanStop::ViewLimit, coverage: None };
        }
        self.taken += 1;
        for _ in 0..DRAWS {
            let viewpoint = self.draw();
            if self.reach.check(&viewpoint).is_ok() {
                return capture(viewpoint, 1);
            }
        }
        Decision::Stop { why: PlanStop::NoPose, coverage: None }
    }
}

fn capture(viewpoint: Viewpoint, candidates: u32) -> Decision {
    let purpose = PlanPurpose::Overall;
    Decision::Capture(Box::new(NextView { viewpoint, purpose, expected: None, candidates }))
}
