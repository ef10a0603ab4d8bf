//! Findings of simulated parts against truth.

mod scores;
mod true_regions;

pub use scores::{COUNTED, Compared, FindingScores, Match, score_findings};
pub use true_regions::{TrueRegion, TrueRegions};

use crate::seen_area::SeenFrom;
use semascan_inspection::Inspected;
use semascan_inspection::source::Source;
use semascan_perception::fuse::{FuseError, KeptDepth};
use semascan_perception::view::DepthImage;
use semascan_simulation::VirtualCell;

/// What the views of `inspected` have truly seen of the defects of the part in `cell`, another opening of its source.
///
/// # Errors
/// [`FuseError`] if a view that is kept on disk cannot be read back.
pub fn true_regions(inspected: &Inspected, cell: &VirtualCell) -> Result<TrueRegions, FuseError> {
    let Some(truth) = cell.truth() else { return Ok(TrueRegions::default()) };
    let map = inspected.model.read();
    let kept = map.kept_views();
    let mut taken = Vec::new();
    for i in 0..kept.len() {
        let KeptDepth { index, intrinsics, metres, .. } = kept.depth(i)?;
        let Some(pose) = inspected.recorded.true_poses.iter().find(|p| p.view == index) else { continue };
        let depth = DepthImage { width: intrinsics.width, height: intrinsics.height, metres: metres.into_owned() };
        taken.push((intrinsics, depth, pose.truth));
    }
    let pictures: Vec<SeenFrom<'_>> = taken
        .iter()
        .map(|(intrinsics, depth, pose)| SeenFrom { intrinsics, depth, table_from_camera: *pose })
        .collect();
    Ok(TrueRegions::of(truth, &|place, class| cell.defect_at(place, class), &pictures))
}
