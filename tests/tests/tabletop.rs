//! Geometric segmentation of three real tabletop clouds with labels: patches by convexity and colour (LCCCP) and by
//! convexity alone (LCCP), scored against them.
//!
//! Over-segmentation is the share of points outside the segment that covers most of their labelled region,
//! under-segmentation the share in a segment whose majority belongs to another region; points that are missing or
//! unlabelled do not count.

use semascan_evaluation::{PartitionScore, compare_partitions};
use semascan_formats::offset::single;
use semascan_formats::pcd;
use semascan_perception::segment::geometric::{ColoredPoints, GeometricConfig, NONE, SegmentedCloud};
use semascan_tests::data;

fn score(name: &str, config: &GeometricConfig) -> PartitionScore {
    let folder = data::folder("point-clouds/tabletop-labelled").expect("real captures");
    let cloud = pcd::read_file(&folder.join(name)).expect("reads");
    let colors = cloud.colors.expect("the cloud has colours");
    let points = ColoredPoints { positions: single(&cloud.positions), colors };
    let labels = cloud.labels.expect("the cloud has labels");
    let truth: Vec<_> = labels.iter().map(|&l| (l != 0).then_some(l)).collect();
    let segments = SegmentedCloud::new(&points, config).of_point();
    let segments: Vec<_> = segments.into_iter().map(|s| (s != NONE).then_some(s)).collect();
    let labelled = truth.iter().filter(|t| t.is_some()).count();
    let score = compare_partitions(&segments, &truth);
    assert!(score.points * 1000 >= labelled as u64 * 995, "{name}: {} of {labelled} points are reached", score.points);
    score
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn segments_of_real_tabletops_follow_the_labels() {
    let lcccp = GeometricConfig::new(0.0075);
    let lccp = GeometricConfig { color: None, ..lcccp };
    // Colour parts what shape joins: printed patterns cost over-segmentation, and leaks must not grow.
    for (name, config, over, under) in [("LCCP", &lccp, 0.08, 0.010), ("LCCCP", &lcccp, 0.12, 0.025)] {
        for cloud in ["learn0.pcd", "learn9.pcd", "learn17.pcd"] {
            let score = score(cloud, config);
            eprintln!(
                "{name:<5} {cloud:<12} {:>3} segments of {} regions: over-segmentation {:.2} %, under-segmentation {:.2} %, \
                 adjusted Rand index {:.3}",
                score.segments,
                score.regions,
                score.over_segmentation * 100.0,
                score.under_segmentation * 100.0,
                score.adjusted_rand
            );
            assert!(score.over_segmentation <= over, "{name} {cloud}: {score:?}");
            assert!(score.under_segmentation <= under, "{name} {cloud}: {score:?}");
            assert!(score.adjusted_rand >= 0.90, "{name} {cloud}: {score:?}");
        }
    }
}
