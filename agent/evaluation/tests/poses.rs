//! Registered views against the robot's own poses: alignment may make no view worse than its kinematic pose by more than
//! the covariance that it states. On a part whose faces hold every direction, and on a gear that turns almost freely.

use semascan_evaluation::judge_inspection;
use semascan_inspection::Inspection;
use semascan_inspection::spec::InspectionSpec;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use std::fmt::Write;
use std::path::Path;

/// Standard deviations by which a view may be worse.
const DEVIATIONS: f64 = 3.0;
const SEEDS: [u64; 2] = [1, 2];

const WEDGE: &str = "v 0 0 0\nv 60 0 0\nv 0 45 0\nv 0 0 38\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// A spur gear of 20 teeth, 40 mm wide and 12 mm high, as OBJ in millimetres.
fn gear() -> String {
    const CORNERS: u32 = 80;
    let mut text = String::new();
    for height in [0, 12] {
        for k in 0..CORNERS {
            // Two corners at the tip and two at the root of each tooth.
            let radius = if k % 4 < 2 { 20.0 } else { 17.0 };
            let (sine, cosine) = (f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS)).sin_cos();
            writeln!(text, "v {} {} {height}", radius * cosine, radius * sine).expect("a String takes everything");
        }
    }
    let (low, high) = (2 * CORNERS + 1, 2 * CORNERS + 2);
    text.push_str("v 0 0 0\nv 0 0 12\n");
    for k in 0..CORNERS {
        let [a, b] = [k + 1, (k + 1) % CORNERS + 1];
        let [c, d] = [a, b].map(|v| v + CORNERS);
        writeln!(text, "f {low} {b} {a}\nf {high} {c} {d}\nf {a} {b} {d}\nf {a} {d} {c}")
            .expect("a String takes everything");
    }
    text
}

/// The number of registered views, and the largest excess of a view's error over that of its kinematic pose, in stated
/// standard deviations.
fn worst_excess(part: &Path, seed: u64) -> (usize, f64) {
    let uri = format!("virtual:mesh?path={}&scale=0.001&seed={seed}&views=6", part.display());
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a part");
    let inspected =
        Inspection::new(InspectionSpec::default(), Box::new(cell)).expect("set up").start().wait().expect("a model");
    let truth = judge_inspection(&inspected).and_then(|truth| truth.aligned).expect("the true poses are known");
    let mut worst = f64::NEG_INFINITY;
    for pose in &truth.poses {
        let prior = truth.prior_poses.iter().find(|prior| prior.view == pose.view).expect("a robot holds the camera");
        let view = inspected.record.views.iter().find(|view| view.index == pose.view).expect("it is in the record");
        let covariance = view.covariance.expect("a view in the model has a covariance");
        let deviation = |axes: std::ops::Range<usize>| axes.map(|a| covariance[a][a]).sum::<f64>().sqrt();
        let turned = (pose.rotation - prior.rotation) / deviation(0..3);
        let shifted = (pose.translation - prior.translation) / deviation(3..6);
        worst = worst.max(turned).max(shifted);
    }
    (truth.poses.len(), worst)
}

#[test]
fn no_view_is_worse_than_its_kinematic_pose_by_more_than_it_states() {
    let folder = tempfile::tempdir().expect("temporary folder");
    for (name, text) in [("wedge.obj", WEDGE.to_owned()), ("gear.obj", gear())] {
        let part = folder.path().join(name);
        std::fs::write(&part, text).expect("written");
        for seed in SEEDS {
            let (views, worst) = worst_excess(&part, seed);
            assert!(views == 6 && worst < DEVIATIONS, "{name}, seed {seed}: {views} views, {worst:+.2} deviations");
        }
    }
}
