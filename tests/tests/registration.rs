//! Views against each other: a simulated motor whose true poses are known, and real captures of a shelf.

use anyhow::Result;
use semascan_evaluation::judge_inspection;
use semascan_geometry::measure::NearestPoints;
use semascan_perception::fuse::SemanticMap;
use semascan_tests::data;
use semascan_tests::inspect::{inspect, inspect_kinematic};
use semascan_tests::sources::open;

#[test]
fn a_robot_off_by_a_degree_is_set_right() -> Result<()> {
    let uri = "virtual:starter-motor?seed=8&views=12&errors=rough&noise=zivid";
    let inspected = inspect(open(uri)?)?;
    assert_eq!(inspected.model.read().epoch(), 2, "the map was made anew with the refined poses");
    let poses = inspected.model.read().kept_views().poses();
    let truth = judge_inspection(&inspected).expect("the virtual cell knows the truth");
    assert_eq!(inspected.model.read().kept_views().poses(), poses, "judging leaves the model alone");
    let aligned = truth.aligned.expect("all poses are known");
    let mut turned: Vec<f64> = aligned.poses.iter().map(|p| p.rotation.to_degrees()).collect();
    let mut shifted: Vec<f64> = aligned.poses.iter().map(|p| p.translation * 1e3).collect();
    for (pose, prior) in aligned.poses.iter().zip(&aligned.prior_poses) {
        let better = pose.rotation < prior.rotation && pose.translation < prior.translation;
        assert!(better, "{pose:?} is worse than kinematics' {prior:?}");
    }
    turned.sort_by(f64::total_cmp);
    shifted.sort_by(f64::total_cmp);
    let (angle, distance) = (turned[6], shifted[6]);
    eprintln!("median pose error {angle:.4} deg, {distance:.4} mm; worst {:.4} deg, {:.4} mm", turned[11], shifted[11]);
    assert!(angle < 0.02 && distance < 0.08, "{angle} deg, {distance} mm");
    assert!(aligned.mean_error.is_some_and(|e| e < 0.12e-3), "{:?}", aligned.mean_error);
    Ok(())
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn real_views_of_a_shelf_agree_better_once_registered() -> Result<()> {
    let shelf = data::folder("shelf-eye-in-hand")?;
    let mut agreement = Vec::new();
    for registered in [false, true] {
        let source = open(&shelf.display().to_string())?;
        let inspected = if registered { inspect(source)? } else { inspect_kinematic(source)? };
        agreement.push(mean_nearest_distance(&inspected.model.read())?);
    }
    eprintln!(
        "mean nearest distance between overlapping views: {:.4} mm by kinematics, {:.4} mm registered",
        agreement[0] * 1e3,
        agreement[1] * 1e3
    );
    assert!(agreement[1] < 0.9 * agreement[0], "{agreement:?}");
    Ok(())
}

/// Mean distance from a view's points to the nearest point of another view, over all pairs and the points that have one
/// within 10 mm; metres.
fn mean_nearest_distance(map: &SemanticMap) -> Result<f64> {
    let kept = map.kept_views();
    let poses = kept.poses();
    let mut clouds = Vec::new();
    for (i, pose) in poses.iter().enumerate() {
        let view = kept.restore(i)?;
        let points: Vec<[f32; 3]> = (0..view.cloud.depth.len())
            .step_by(5)
            .filter_map(|p| view.cloud.point(p))
            .map(|p| (pose * p).coords.cast::<f32>().into())
            .collect();
        clouds.push(points);
    }
    let (mut sum, mut count) = (0.0, 0_u64);
    for (i, cloud) in clouds.iter().enumerate() {
        let index = NearestPoints::new(cloud);
        for (_, other) in clouds.iter().enumerate().filter(|(j, _)| *j != i) {
            for nearest in other.iter().step_by(5).filter_map(|p| index.nearest_within(*p, 0.01)) {
                sum += nearest.distance();
                count += 1;
            }
        }
    }
    Ok(sum / count as f64)
}
