//! Planners at work: on a wall and a ball, and in the virtual cell through the pipeline.

use crate::coverage::{Coverage, Patch};
use crate::regions::RegionOfInterest;
use crate::visibility::Glance;
use crate::{Camera, Orbit, OutOfReach, Reach, candidates, look_closely, planned};
use nalgebra::{Isometry3, Point3, Vector3};
use semascan_inspection::planning::{Viewpoint, look_at};
use semascan_inspection::record::isometry;
use semascan_inspection::spec::{InspectionSpec, PlanSpec, PlanStrategy, ReachSpec, TargetSpec};
use semascan_inspection::{Inspected, Inspection};
use semascan_model::record::{PlanPurpose, PlanStop};
use semascan_perception::fuse::KeptDepth;
use semascan_perception::view::Intrinsics;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

const VOLUME: (Point3<f64>, Point3<f64>) = (Point3::new(-0.06, -0.06, 0.0), Point3::new(0.06, 0.06, 0.2));
const CAMERA: Intrinsics = Intrinsics { width: 320, height: 240, fx: 308.0, fy: 308.0, cx: 159.5, cy: 119.5 };

fn reach() -> Reach {
    Reach::new(&ReachSpec::default(), VOLUME)
}

fn from(azimuth: f64, polar: f64, distance: f64) -> Viewpoint {
    let reach = reach();
    let eye = reach.place(azimuth.to_radians(), polar.to_radians(), distance);
    Viewpoint { tablebase_from_camera: look_at(eye, reach.centre), table_angle: 0.3 }
}

#[test]
fn every_limit_of_the_cell_is_kept() {
    let reach = reach();
    assert_eq!(reach.check(&from(60.0, 60.0, 0.5)), Ok(()));
    for (viewpoint, limit) in [
        (from(30.0, 60.0, 0.5), OutOfReach::Azimuth),
        (from(60.0, 30.0, 0.5), OutOfReach::Polar),
        (from(60.0, 60.0, 0.39), OutOfReach::Distance),
    ] {
        assert_eq!(reach.check(&viewpoint), Err(limit));
    }
    let mut aside = from(60.0, 60.0, 0.5);
    aside.tablebase_from_camera *= Isometry3::rotation(Vector3::x() * 0.3);
    assert_eq!(reach.check(&aside), Err(OutOfReach::Aim));
    let mut table = reach.clone();
    table.table = (0.0, 0.2);
    assert_eq!(table.check(&from(60.0, 60.0, 0.5)), Err(OutOfReach::Table));
    let eye = Point3::from(from(60.0, 60.0, 0.5).tablebase_from_camera.translation.vector);
    let mut blocked = reach.clone();
    blocked.obstacles.push((eye + Vector3::x() * 0.15, 0.08));
    assert_eq!(blocked.check(&from(60.0, 60.0, 0.5)), Err(OutOfReach::Collision));

    let poses = candidates(&reach, &Orbit::OVERALL);
    assert!(poses.len() > 100 && poses.iter().all(|pose| reach.check(pose).is_ok()));
}

/// What a camera at `pose` measures of a ball.
fn ball(pose: &Isometry3<f64>, centre: Point3<f64>, radius: f64) -> Vec<f32> {
    let c = pose.inverse() * centre;
    let pixel = |i: u32| {
        let ray = CAMERA.unproject((i % CAMERA.width).into(), (i / CAMERA.width).into(), 1.0).coords;
        // |t ray - c| = radius
        let (a, b) = (ray.norm_squared(), ray.dot(&c.coords));
        let root = b * b - a * (c.coords.norm_squared() - radius * radius);
        if root < 0.0 { 0.0 } else { ((b - root.sqrt()) / a) as f32 }
    };
    (0..CAMERA.width * CAMERA.height).map(pixel).collect()
}

#[test]
fn what_a_view_has_seen_of_a_ball_is_known_and_its_back_is_the_frontier() {
    let (reach, centre, radius) = (reach(), Point3::new(0.0, 0.0, 0.1), 0.045);
    let mut coverage = Coverage::new(VOLUME, &CAMERA, &reach);
    let pose = from(60.0, 80.0, 0.45).table_from_camera();
    let front = (Point3::from(pose.translation.vector) - centre).normalize().cast::<f32>();
    for _ in 0..2 {
        let metres = ball(&pose, centre, radius);
        coverage.integrate(&KeptDepth { index: 0, intrinsics: CAMERA, metres: metres.into(), table_from_camera: pose });
    }
    let patches = coverage.patches();
    let side = |p: &Patch| (Vector3::from(p.centre) - centre.coords.cast::<f32>()).dot(&front);
    let surface: Vec<&Patch> = patches.iter().filter(|p| !p.is_frontier()).collect();
    let area = surface.len() as f64 * coverage.cell_area();
    assert!(surface.len() > 100 && surface.iter().all(|p| side(p) > -0.005), "{area}");
    for patch in &surface {
        let outward = Vector3::from(patch.centre) - centre.coords.cast::<f32>();
        assert!((outward.norm() - 0.045).abs() < 0.006 && outward.normalize().dot(&Vector3::from(patch.normal)) > 0.8);
    }
    // Nothing is unknown before the ball, and behind it all is; a ray beside it came to nothing, which is weak evidence, but for
    // those close to the rim.
    let depth = ball(&pose, centre, radius);
    let frontier: Vec<&Patch> = patches.iter().filter(|p| p.is_frontier() && p.likelihood > 0.4).collect();
    let (mut behind, mut beside) = (0, 0);
    for patch in &frontier {
        let p = pose.inverse() * Point3::from(patch.centre).cast::<f64>();
        let pixel = CAMERA.project(&p).and_then(|(u, v)| CAMERA.pixel(u, v)).expect("in the picture");
        let measured = f64::from(depth[pixel]);
        assert!(measured == 0.0 || p.z > measured - 1.5 * coverage.edge, "{p}");
        behind += usize::from(measured > 0.0);
        let off_axis = (Vector3::from(patch.centre) - centre.coords.cast::<f32>()).cross(&front).norm();
        beside += usize::from(off_axis > 0.075);
    }
    assert!(behind > 20 && beside == 0, "{behind} behind, {beside} beside, of {}", frontier.len());
}

#[test]
fn what_stands_behind_is_hidden_and_what_faces_away_is_not_seen() {
    let patch = |x: f32, z: f32, towards: f32| Patch {
        centre: [x, 0.0, z],
        normal: [0.0, 0.0, towards],
        cell: 0,
        likelihood: 1.0,
        cosine: 0.0,
        uncertainty: 0.0,
        views: 1.0,
    };
    // A wall of 9 patches at 0.4 m before the camera, one patch behind it, one beside it, one that faces away.
    let mut patches: Vec<Patch> = (0..9).map(|i| patch((i - 4) as f32 * 0.005, 0.4, -1.0)).collect();
    patches.extend([patch(0.0, 0.45, -1.0), patch(0.1, 0.45, -1.0), patch(-0.1, 0.45, 1.0)]);
    let seen = Glance::new(&CAMERA, 0.005, 0.4).see(&patches, &Isometry3::identity());
    let seen: Vec<usize> = seen.iter().map(|s| s.patch).collect();
    assert_eq!(seen, [0, 1, 2, 3, 4, 5, 6, 7, 8, 10]);
}

/// A strip around a ball's upper half, and the ball.
fn strip() -> (Vec<RegionOfInterest>, Vec<[f32; 3]>) {
    let (centre, radius, mut ball) = (Vector3::new(0.0, 0.0, 0.1_f32), 0.045_f32, Vec::new());
    let mut region = RegionOfInterest {
        name: "wear on ball".into(),
        component: 1,
        defect: 2,
        points: Vec::new(),
        normals: Vec::new(),
        areas: Vec::new(),
    };
    for i in 0..120 {
        for j in 0..60 {
            let (a, p) = (i as f32 * 0.052_36, (j as f32 + 0.5) * 0.052_36);
            let n = Vector3::new(p.sin() * a.cos(), p.sin() * a.sin(), p.cos());
            ball.push((centre + n * radius).into());
            if (20..26).contains(&j) && (10..30).contains(&i) {
                region.points.push((centre + n * radius).into());
                region.normals.push(n.into());
                region.areas.push(5e-6);
            }
        }
    }
    (vec![region], ball)
}

#[test]
fn close_looks_keep_incidence_and_resolution() {
    let (regions, ball) = strip();
    let fine = CAMERA.scaled(13.0);
    let camera = Camera::new(fine, &TargetSpec::default());
    let plan = look_closely(&regions, (&ball, 2.4e-3), &camera, &reach(), 12);
    let outcome = &plan.regions[0];
    assert!(outcome.seen > 0.95 && (1..=3).contains(&plan.views.len()), "{plan:?}");
    // Every point is seen as it should be by one of the views: geometry, not the planner's own.
    for (p, n) in regions[0].points.iter().zip(&regions[0].normals) {
        let (p, n) = (Point3::from(p.map(f64::from)), Vector3::from(n.map(f64::from)));
        let suits = plan.views.iter().any(|view| {
            let pose = view.viewpoint.table_from_camera();
            let way = Point3::from(pose.translation.vector) - p;
            let cosine = way.normalize().dot(&n);
            let z = (pose.inverse() * p).z;
            cosine > 0.7 && z / fine.fx / cosine.max(0.1).sqrt() < 1.02e-4
        });
        assert!(suits, "{p}");
    }
    // A coarse camera cannot, and says what it would take.
    let coarse = look_closely(&regions, (&ball, 2.4e-3), &Camera { intrinsics: CAMERA, ..camera }, &reach(), 12);
    assert!(coarse.views.is_empty() && coarse.regions[0].seen == 0.0 && coarse.regions[0].within_incidence > 0.95);
    assert!(coarse.regions[0].needed_focal.is_some_and(|f| (2500.0..5000.0).contains(&f)), "{coarse:?}");
}

fn inspect(plan: PlanSpec) -> Inspected {
    let uri = "virtual:starter-motor?seed=1001&size=160x120&cell=4&errors=none&noise=none";
    let cell = VirtualCell::open(&VirtualCellSpec::parse(uri).expect("right")).expect("a motor");
    let mut spec = InspectionSpec { plan: plan.clone(), ..InspectionSpec::default() };
    spec.registration = semascan_inspection::spec::RegistrationMethod::Kinematic;
    let inspection = Inspection::new(spec, Box::new(cell)).expect("set up");
    planned(inspection, &plan).expect("a virtual cell can be steered").start().wait().expect("a model")
}

#[test]
fn the_virtual_cell_takes_the_views_that_are_planned_and_the_record_says_which_and_why_no_more() {
    let spec = |strategy, views| PlanSpec { strategy: Some(strategy), views, ..PlanSpec::default() };
    let inspected = inspect(PlanSpec { refine: true, refine_views: 1, ..spec(PlanStrategy::NextBest, 3) });
    let record = &inspected.record;
    let plan = record.plan.as_ref().expect("it was planned");
    assert_eq!((plan.strategy, plan.stopped), (PlanStrategy::NextBest, Some(PlanStop::ViewLimit)));
    assert_eq!((plan.views.len(), record.views.len()), (4, 4));
    for (planned, view) in plan.views.iter().zip(&record.views) {
        let (asked, taken) = (isometry(&planned.table_from_camera), view.pose.as_ref().map(isometry).expect("a pose"));
        assert!((asked.inverse() * taken).translation.vector.norm() < 1e-9, "view {}", view.index);
    }
    assert!(matches!(&plan.views[3].purpose, PlanPurpose::Targeted { regions } if !regions.is_empty()));
    let gains: Vec<f64> = plan.views[..3].iter().filter_map(|v| v.expected).map(|gain| gain.frontier).collect();
    assert!(gains.len() == 3 && gains[0] > gains[2], "{gains:?}");
    let coverage = plan.coverage.as_ref().expect("it looks at the model");
    assert!(coverage.measured > 0.01 && coverage.well_seen > 0.8 * coverage.measured, "{coverage:?}");
    assert!(coverage.frontier > 0.0 && coverage.unreachable > 0.0);

    // The same seed gives the same views, and all of them are within reach.
    let again = inspect(PlanSpec { refine: true, refine_views: 1, ..spec(PlanStrategy::NextBest, 3) });
    let poses = |inspected: &Inspected| -> Vec<_> {
        let plan = inspected.record.plan.as_ref().expect("planned");
        plan.views.iter().map(|view| (view.table_from_camera, view.table_angle)).collect()
    };
    assert_eq!(poses(&inspected), poses(&again));

    // With a gain that is soon out of reach it ends by itself.
    let lazy = inspect(PlanSpec { least_gain: 0.5, ..spec(PlanStrategy::NextBest, 10) });
    let plan = lazy.record.plan.expect("planned");
    assert!(plan.views.len() < 10 && matches!(plan.stopped, Some(PlanStop::LittleGain { .. })), "{plan:?}");

    let random = inspect(spec(PlanStrategy::Random, 2));
    let uniform = inspect(spec(PlanStrategy::Uniform, 2));
    for inspected in [random, uniform] {
        let plan = inspected.record.plan.expect("planned");
        assert!(plan.views.len() == 2 && plan.coverage.is_none() && plan.stopped == Some(PlanStop::ViewLimit));
    }
}
