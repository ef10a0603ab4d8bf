//! Which points an export holds: filters mark points, exports choose.

use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use std::collections::BTreeSet;

/// Points to leave out. The default leaves out nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportFilter {
    /// Component classes that are hidden.
    pub hidden_labels: BTreeSet<u16>,
    /// Marks (bits of [`PointFlags`]), any of which leaves a point out.
    pub skip_flags: u16,
}

impl ExportFilter {
    /// Leaves out what was marked as stray or as background: the part itself.
    pub fn of_the_part() -> Self {
        Self { skip_flags: PointFlags::OUTLIER | PointFlags::BACKGROUND, ..Self::default() }
    }

    /// Whether `point` is exported.
    pub fn keep(&self, point: &SemanticPoint) -> bool {
        !point.flags.has(self.skip_flags) && !self.hidden_labels.contains(&point.label)
    }

    /// The exported part of `cloud`, in order.
    pub fn apply(&self, cloud: &SemanticCloud) -> SemanticCloud {
        cloud.iter().filter(|p| self.keep(p)).collect()
    }
}
