//! How well one partition of points agrees with another: segments against labels, or ours against another program's.
//!
//! Points that are unlabelled on either side (`None`) are left out, and the number that count is given.

use std::collections::BTreeMap;

/// Agreement of two partitions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartitionScore {
    /// Adjusted Rand index [Hubert 1985]: 1 for the same partition, about 0 for unrelated ones.
    pub adjusted_rand: f64,
    /// Share of the points that lie outside the segment that covers most of their true region: how far regions fall
    /// apart.
    pub over_segmentation: f64,
    /// Share of the points that lie in a segment whose majority belongs to another true region: how far segments leak.
    pub under_segmentation: f64,
    /// Points that count.
    pub points: u64,
    /// True regions among them.
    pub regions: u64,
    /// Segments among them.
    pub segments: u64,
}

/// Agreement of `segments` with `truth`, one entry a point; points past the end of the shorter are left out.
pub fn compare_partitions(segments: &[Option<u32>], truth: &[Option<u32>]) -> PartitionScore {
    let mut joint: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    for (&s, &t) in segments.iter().zip(truth) {
        if let (Some(s), Some(t)) = (s, t) {
            *joint.entry((t, s)).or_default() += 1;
        }
    }
    let (mut rows, mut columns): (BTreeMap<u32, Group>, BTreeMap<u32, Group>) = Default::default();
    for (&(t, s), &n) in &joint {
        rows.entry(t).or_default().add(n);
        columns.entry(s).or_default().add(n);
    }
    let points: u64 = joint.values().sum();
    let pairs = |n: u64| n as f64 * (n as f64 - 1.0) / 2.0;
    let together: f64 = joint.values().map(|&n| pairs(n)).sum();
    let (in_rows, in_columns): (f64, f64) =
        (rows.values().map(|g| pairs(g.all)).sum(), columns.values().map(|g| pairs(g.all)).sum());
    let expected = if points > 1 { in_rows * in_columns / pairs(points) } else { 0.0 };
    let most = 0.5 * (in_rows + in_columns);
    let outside = |groups: &BTreeMap<u32, Group>| {
        let outside: u64 = groups.values().map(|g| g.all - g.largest).sum();
        if points == 0 { 0.0 } else { outside as f64 / points as f64 }
    };
    PartitionScore {
        // One region in one segment, or every point alone on both sides: the same partition.
        adjusted_rand: if (most - expected).abs() < 1e-9 { 1.0 } else { (together - expected) / (most - expected) },
        over_segmentation: outside(&rows),
        under_segmentation: outside(&columns),
        points,
        regions: rows.len() as u64,
        segments: columns.len() as u64,
    }
}

#[derive(Default)]
struct Group {
    all: u64,
    largest: u64,
}

impl Group {
    fn add(&mut self, n: u64) {
        self.all += n;
        self.largest = self.largest.max(n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(labels: &[u32]) -> Vec<Option<u32>> {
        labels.iter().map(|&l| (l != 99).then_some(l)).collect()
    }

    #[test]
    fn the_same_partition_under_other_names_is_perfect() {
        let score = compare_partitions(&some(&[5, 5, 7, 7, 7, 99]), &some(&[1, 1, 2, 2, 2, 2]));
        assert_eq!((score.adjusted_rand, score.over_segmentation, score.under_segmentation), (1.0, 0.0, 0.0));
        assert_eq!((score.points, score.regions, score.segments), (5, 2, 2));
    }

    #[test]
    fn figures_of_a_worked_example() {
        // Hubert and Arabie's index for [0,0,1,1] against [0,0,1,2] is 4/7.
        let score = compare_partitions(&some(&[0, 0, 1, 2]), &some(&[0, 0, 1, 1]));
        assert!((score.adjusted_rand - 4.0 / 7.0).abs() < 1e-12, "{score:?}");
        assert_eq!((score.over_segmentation, score.under_segmentation), (0.25, 0.0));
        let merged = compare_partitions(&some(&[3, 3, 3, 3]), &some(&[0, 1, 1, 1]));
        assert_eq!((merged.over_segmentation, merged.under_segmentation), (0.0, 0.25));
        assert!(merged.adjusted_rand.abs() < 1e-12);
    }

    #[test]
    fn nothing_to_compare() {
        let score = compare_partitions(&[None, Some(1)], &[Some(1)]);
        assert_eq!((score.points, score.adjusted_rand), (0, 1.0));
    }
}
