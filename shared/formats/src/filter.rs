//! Which points an export holds: filters mark points, exports choose.

use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use std::collections::BTreeSet;
use std::fmt;

/// Points of a model that a file does not hold, by the reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Background: outside of the measuring volume.
    pub background: usize,
    /// Stray: marked as outliers.
    pub stray: usize,
    /// Of a class that was too uncertain.
    pub uncertain: usize,
    /// Of a hidden component.
    pub hidden: usize,
}

impl LeftOut {
    /// All of them.
    pub fn total(self) -> usize {
        self.background + self.stray + self.uncertain + self.hidden
    }
}

impl fmt::Display for LeftOut {
    /// `141468 background, 12 stray`; `nothing` where there are none.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reasons = [
            (self.background, "background"),
            (self.stray, "stray"),
            (self.uncertain, "too uncertain"),
            (self.hidden, "of hidden components"),
        ];
        let said: Vec<String> =
            reasons.iter().filter(|(count, _)| *count > 0).map(|(count, why)| format!("{count} {why}")).collect();
        f.write_str(if said.is_empty() { "nothing".into() } else { said.join(", ") }.as_str())
    }
}

/// Points to leave out. The default leaves out nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportFilter {
    /// Component classes that are hidden.
    pub hidden_labels: BTreeSet<u16>,
    /// Marks (bits of [`PointFlags`]), any of which leaves a point out.
    pub skip_flags: u16,
}

impl ExportFilter {
    /// Leaves out what is no part of the surface: what was marked as stray, as background or as too uncertain.
    pub fn of_the_part() -> Self {
        Self { skip_flags: PointFlags::LEFT_OUT, ..Self::default() }
    }

    /// Whether `point` is exported.
    pub fn keep(&self, point: &SemanticPoint) -> bool {
        !point.flags.has(self.skip_flags) && !self.hidden_labels.contains(&point.label)
    }

    /// How many points of `cloud` are not exported, and why.
    pub fn left_out(&self, cloud: &SemanticCloud) -> LeftOut {
        let mut left = LeftOut::default();
        for (flags, label) in cloud.flags.iter().zip(&cloud.labels) {
            let marked = |bits: u16| flags.has(self.skip_flags & bits);
            let of = [
                (&mut left.background, marked(PointFlags::BACKGROUND)),
                (&mut left.stray, marked(PointFlags::OUTLIER)),
                (&mut left.uncertain, marked(PointFlags::UNCERTAIN)),
                (&mut left.hidden, self.hidden_labels.contains(label)),
            ];
            // The first reason counts.
            if let Some((count, _)) = of.into_iter().find(|(_, left)| *left) {
                *count += 1;
            }
        }
        left
    }

    /// The exported part of `cloud`, in order.
    pub fn apply(&self, cloud: &SemanticCloud) -> SemanticCloud {
        cloud.iter().filter(|p| self.keep(p)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_counted_once_by_its_first_reason() {
        let point =
            |label: u16, flags: u16| SemanticPoint { label, flags: PointFlags(flags), ..SemanticPoint::UNKNOWN };
        let cloud: SemanticCloud = [
            point(1, 0),
            point(1, PointFlags::BACKGROUND | PointFlags::NOISE),
            point(1, PointFlags::EDGE),
            point(2, PointFlags::UNCERTAIN),
            point(2, PointFlags::BOUNDARY),
        ]
        .into_iter()
        .collect();
        let mut filter = ExportFilter::of_the_part();
        let left = filter.left_out(&cloud);
        assert_eq!(left, LeftOut { background: 1, stray: 1, uncertain: 1, hidden: 0 });
        assert_eq!(
            (left.total() + filter.apply(&cloud).len(), left.to_string()),
            (5, "1 background, 1 stray, 1 too uncertain".into())
        );
        filter.hidden_labels.insert(2);
        let left = filter.left_out(&cloud);
        assert_eq!((left.hidden, left.total() + filter.apply(&cloud).len()), (1, 5));
        assert_eq!(ExportFilter::default().left_out(&cloud).to_string(), "nothing");
    }
}
