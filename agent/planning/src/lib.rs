//! View planning ([Remanufacturing paper], steps 2 and 4: the view planning problem and its two stages): an inspection of the
//! whole surface without prior knowledge of the part, then close looks at regions of interest.
//!
//! | file | what |
//! |---|---|
//! | `reach.rs` | poses that the cell reaches |
//! | `candidates.rs` | poses that are compared, and those of the baselines |
//! | `coverage/` | what the views until now have measured, seen through and left unknown |
//! | `visibility.rs` | what of it a camera would see: a z-buffer of splatted voxels |
//! | `gain.rs` | what a pose would add |
//! | `next_best.rs` | next best view, and the greedy count of frontiers |
//! | `fixed.rs` | regular turn and random poses |
//! | `regions.rs` | regions of interest on a mesh |
//! | `targeted.rs` | poses that see regions under a wanted incidence and resolution |
//! | `staged.rs` | both stages as one planner |
//!
//! All of them are a [`ViewPlanner`]; [`planned`] gives an inspection the one that its specification asks for.

mod candidates;
mod coverage;
mod fixed;
mod gain;
mod next_best;
mod reach;
mod regions;
mod staged;
mod targeted;
#[cfg(test)]
mod tests;
mod visibility;

pub use candidates::{Orbit, candidates};
pub use coverage::Coverage;
pub use reach::{OutOfReach, Reach};
pub use regions::{RegionOfInterest, defect_regions, named_components};
pub use targeted::{Camera, RegionOutcome, TargetedPlan, TargetedView, close_poses, look_closely};

use fixed::{RandomPoses, RegularTurn};
use next_best::{NextBest, Rule};
use semascan_inspection::planning::ViewPlanner;
use semascan_inspection::source::SourceInfo;
use semascan_inspection::spec::{PlanSpec, PlanStrategy, SpecError};
use semascan_inspection::{Inspection, SetupFailure};
use semascan_perception::view::Intrinsics;
use staged::Staged;

/// `inspection` with its views planned as `spec` says; as it is where that names no strategy.
///
/// # Errors
/// [`SetupFailure`] where the source cannot be steered or does not know its measuring volume.
pub fn planned(mut inspection: Inspection, spec: &PlanSpec) -> Result<Inspection, SetupFailure> {
    let Some(strategy) = spec.strategy else {
        return Ok(inspection);
    };
    let Some(camera) = inspection.steered_camera() else {
        let reason = format!("{}: its views come as they come, and cannot be planned", inspection.info().uri);
        return Err(SpecError { field: "plan".into(), reason }.into());
    };
    let planner = planner(strategy, spec, inspection.info(), &camera)?;
    inspection.planned_by(planner)
}

/// The planner of `strategy` for a source like `info` that is seen by `camera`.
///
/// # Errors
/// [`SpecError`] where the measuring volume is not known, or no pose is within the limits.
pub fn planner(
    strategy: PlanStrategy,
    spec: &PlanSpec,
    info: &SourceInfo,
    camera: &Intrinsics,
) -> Result<Box<dyn ViewPlanner>, SpecError> {
    let fail = |reason: String| SpecError { field: "plan".into(), reason };
    let volume = info.volume.ok_or_else(|| fail(format!("{} knows no measuring volume", info.uri)))?;
    let reach = Reach::new(&spec.reach, volume);
    let overall: Box<dyn ViewPlanner> = match strategy {
        PlanStrategy::Uniform => Box::new(RegularTurn::new(reach.clone(), camera, spec)),
        PlanStrategy::Random => Box::new(RandomPoses::new(reach.clone(), spec)),
        PlanStrategy::NextBest | PlanStrategy::Greedy => {
            let poses = candidates(&reach, &Orbit::OVERALL);
            if poses.is_empty() {
                return Err(fail("the cell reaches no pose: look at plan.reach".into()));
            }
            let rule = if strategy == PlanStrategy::Greedy { Rule::FrontierCount } else { Rule::Gain };
            let coverage = Coverage::new(volume, camera, &reach);
            Box::new(NextBest::new(rule, coverage, reach.clone(), poses, camera, spec))
        }
    };
    if !spec.refine {
        return Ok(overall);
    }
    Ok(Box::new(Staged::new(overall, reach, *camera, spec, info.taxonomy.clone())))
}
