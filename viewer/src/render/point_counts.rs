//! How many points a frame shows: counts by class and mark, kept per chunk.

use crate::display::{ClassMask, HiddenFlags};
use semascan_model::SemanticCloud;
use std::collections::BTreeMap;

/// Counts of one chunk.
#[derive(Clone, Debug, Default)]
pub struct PointCounts(BTreeMap<(u16, u16), usize>);

impl PointCounts {
    /// Counts the points of a chunk by class and hiding marks.
    pub fn of(cloud: &SemanticCloud) -> Self {
        let every = HiddenFlags { outliers: true, background: true }.bits();
        let mut counts = BTreeMap::new();
        for (label, flags) in cloud.labels.iter().zip(&cloud.flags) {
            *counts.entry((*label, flags.0 & every)).or_default() += 1;
        }
        Self(counts)
    }

    /// How many points there are, shown or not.
    pub fn points(&self) -> usize {
        self.0.values().sum()
    }

    /// How many of them are shown.
    pub fn shown(&self, classes: &ClassMask, hidden: HiddenFlags) -> usize {
        let shown = self.0.iter().filter(|((label, flags), _)| classes.has(*label) && flags & hidden.bits() == 0);
        shown.map(|(_, n)| n).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::PointFlags;

    #[test]
    fn it_counts_what_the_shader_shows() {
        let marks = [0, 0, PointFlags::RADIUS_OUTLIER, PointFlags::BACKGROUND, PointFlags::UNLABELLED, 0];
        let cloud = SemanticCloud {
            labels: vec![0, 1, 1, 2, 2, 2],
            flags: marks.map(PointFlags).to_vec(),
            ..SemanticCloud::default()
        };
        let counts = PointCounts::of(&cloud);
        let nothing = HiddenFlags { outliers: false, background: false };
        assert_eq!(counts.shown(&ClassMask::ALL, nothing), 6);
        assert_eq!(counts.shown(&ClassMask::ALL, HiddenFlags::default()), 5);
        assert_eq!(counts.shown(&ClassMask::ALL, HiddenFlags { outliers: true, background: true }), 4);
        let mut without_two = ClassMask::ALL;
        without_two.set(2, false);
        assert_eq!(counts.shown(&without_two, nothing), 3);
        assert_eq!(counts.shown(&ClassMask::NONE, nothing), 0);
        assert_eq!(counts.points(), 6);
    }
}
