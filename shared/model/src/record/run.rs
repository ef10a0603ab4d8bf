//! What the record says of the run itself: how many views became part of the model, and what was left out of them.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::AddAssign;

/// How the run went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RunRecord {
    /// Views that came.
    pub views: u32,
    /// Views that became part of the model.
    pub used: u32,
    /// Their share, 0 to 1; 0 without views.
    pub share: f64,
    /// The smallest share that was asked for.
    pub least_share: f64,
    /// Whether the share is not below it.
    pub sufficient: bool,
    /// Pixels outside the region of interest.
    pub region: RegionRecord,
    /// Whether noisy surfaces were made thin after the last view: not where a large model was stopped. Absent without a
    /// model, and in older records.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surfaces_thinned: Option<bool>,
}

impl RunRecord {
    /// The run of `views` views of which `used` became part of the model.
    pub fn new(views: u32, used: u32, least_share: f64, region: RegionRecord) -> Self {
        let share = f64::from(used) / f64::from(views.max(1));
        let sufficient = used > 0 && share >= least_share;
        Self { views, used, share, least_share, sufficient, region, surfaces_thinned: None }
    }
}

/// Pixels of all views that the region of interest left out, by the reason: each is counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RegionRecord {
    /// Pixels that have depth.
    pub measured: u64,
    /// Of these: nearer or farther than asked for.
    pub outside_depth: u64,
    /// Outside the box that was asked for.
    pub outside_box: u64,
    /// Without a label, where only labelled ones were asked for.
    pub unlabelled: u64,
    /// So far away that the sensor cannot measure at the wanted voxel.
    pub too_coarse: u64,
}

impl RegionRecord {
    /// All pixels that were left out.
    pub fn left_out(&self) -> u64 {
        self.outside_depth + self.outside_box + self.unlabelled + self.too_coarse
    }
}

impl AddAssign for RegionRecord {
    fn add_assign(&mut self, other: Self) {
        self.measured += other.measured;
        self.outside_depth += other.outside_depth;
        self.outside_box += other.outside_box;
        self.unlabelled += other.unlabelled;
        self.too_coarse += other.too_coarse;
    }
}

impl fmt::Display for RegionRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} pixels with depth left out", self.left_out(), self.measured)?;
        let parts = [
            (self.outside_depth, "outside the depth range"),
            (self.outside_box, "outside the box"),
            (self.unlabelled, "not labelled"),
            (self.too_coarse, "too far for the voxel"),
        ];
        let said: Vec<String> = parts.iter().filter(|(n, _)| *n > 0).map(|(n, why)| format!("{n} {why}")).collect();
        if said.is_empty() { Ok(()) } else { write!(f, " ({})", said.join(", ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_judged_by_the_share_of_its_views() {
        let run = |views, used| RunRecord::new(views, used, 0.5, RegionRecord::default()).sufficient;
        assert_eq!([run(19, 1), run(2, 1), run(0, 0), run(5, 5)], [false, true, false, true]);
        assert!(!RunRecord::new(3, 0, 0.0, RegionRecord::default()).sufficient, "nothing is never enough");
        let mut region = RegionRecord { measured: 10, too_coarse: 2, ..RegionRecord::default() };
        region += RegionRecord { measured: 5, outside_box: 1, ..RegionRecord::default() };
        assert_eq!(
            region.to_string(),
            "3 of 15 pixels with depth left out (1 outside the box, 2 too far for the voxel)"
        );
    }
}
