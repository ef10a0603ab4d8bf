//! The area that an inspection states against the area that its views have seen: planes and spheres in 20 poses, motors in
//! nine, as any rotation and shift against the grid of the map, on voxels of half a millimetre.

mod defects;
mod posed_shape;

use posed_shape::{Pictures, Sensor, pose};
use semascan_inspection::source::{Source, TrueMesh};
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_inspection::{Inspected, Inspection};
use semascan_perception::view::Intrinsics;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// Poses of each plane and sphere, and of all motors together, which take seconds each.
const POSES: u64 = 20;
const MOTOR_POSES: u64 = 9;
/// Voxel edge, millimetres.
const VOXEL: f64 = 0.5;
const EXACT: Sensor = Sensor { sigma: 0.0, step: 0.0 };
/// An industrial camera.
const NOISY: Sensor = Sensor { sigma: 1e-4, step: 5e-5 };
/// A camera whose depth comes in whole millimetres.
const COARSE: Sensor = Sensor { sigma: 2e-4, step: 1e-3 };
/// Directions from all sides but the lowest.
const AROUND: [[f64; 3]; 8] = [
    [1.0, 0.0, 0.4],
    [0.0, 1.0, 0.9],
    [-1.0, 0.0, 0.4],
    [0.0, -1.0, 0.9],
    [1.0, 1.0, 0.9],
    [-1.0, 1.0, 0.2],
    [-1.0, -1.0, 0.9],
    [1.0, -1.0, 0.2],
];
/// Directions from above.
const ABOVE: [[f64; 3]; 4] = [[0.5, 0.0, 1.0], [-0.2, 0.4, 1.0], [-0.2, -0.4, 1.0], [0.0, 0.1, 1.0]];

/// A camera with `width` columns whose pixels are a quarter of a millimetre wide at `distance` metres: half a voxel.
fn camera(width: u32, distance: f64) -> Intrinsics {
    let height = width * 3 / 4;
    let middle = |n: u32| f64::from(n - 1) / 2.0;
    let focal = distance / 2.5e-4;
    Intrinsics { width, height, fx: focal, fy: focal, cx: middle(width), cy: middle(height) }
}

/// A sphere, its halves x > 0 and x < 0 of two classes.
fn sphere(radius: f32) -> TrueMesh {
    use std::f32::consts::{PI, TAU};
    let (rows, columns) = (180_u32, 360_u32);
    let mut mesh = TrueMesh::default();
    for r in 0..=rows {
        for c in 0..columns {
            let (polar, around) = (PI * r as f32 / rows as f32, TAU * c as f32 / columns as f32);
            let direction = [polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()];
            mesh.vertices.push(direction.map(|d| d * radius));
            mesh.labels.push(if around.cos() > 0.0 { 1 } else { 2 });
            let (a, b) = (r * columns + c, r * columns + (c + 1) % columns);
            if r < rows {
                mesh.triangles.extend([[a, a + columns, b + columns], [a, b + columns, b]]);
            }
        }
    }
    mesh.defects = vec![0; mesh.vertices.len()];
    mesh
}

/// A square in the plane z = 0.
fn plane(edge: f32) -> TrueMesh {
    let half = 0.5 * edge;
    TrueMesh {
        vertices: vec![[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        labels: vec![1; 4],
        defects: vec![0; 4],
        taxonomy: None,
    }
}

/// A starter motor around the origin.
fn motor(seed: u64) -> TrueMesh {
    let uri = format!("virtual:starter-motor?seed={seed}&views=1");
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
    let mut mesh = cell.truth().expect("simulated").clone();
    let middle = [0, 1, 2].map(|a| {
        let along = mesh.vertices.iter().map(|p| p[a]);
        0.5 * (along.clone().fold(f32::INFINITY, f32::min) + along.fold(f32::NEG_INFINITY, f32::max))
    });
    for p in &mut mesh.vertices {
        *p = [0, 1, 2].map(|a| p[a] - middle[a]);
    }
    mesh
}

/// Inspects views whose poses are true, on voxels of `voxel` millimetres.
fn inspect(source: impl Source + 'static, voxel: f64) -> Inspected {
    let mut spec = InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() };
    spec.source.voxel_mm = Some(voxel);
    Inspection::new(spec, Box::new(source)).expect("set up").start().wait().expect("a model")
}

/// Square metres of all components as the record states them.
fn stated(inspected: &Inspected) -> f64 {
    inspected.record.components.iter().map(|c| c.area.expect("there is a mesh")).sum()
}

/// Asserts that the relative error of the stated area over all poses is at most `median` in the middle and 4 % at worst.
fn check(name: &str, pictures: &Pictures, median: f64) {
    check_errors(name, (0..POSES).map(|seed| error(pictures, seed)).collect(), median);
}

/// Relative error of the stated area in a pose, and the pose.
fn error(pictures: &Pictures, seed: u64) -> (f64, u64) {
    (stated(&inspect(pictures.posed(&pose(seed)), VOXEL)) / pictures.seen.area() - 1.0, seed)
}

fn check_errors(name: &str, mut errors: Vec<(f64, u64)>, median: f64) {
    errors.sort_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
    let ((middle, _), (worst, at)) = (errors[errors.len() / 2], errors[errors.len() - 1]);
    assert!(
        middle.abs() <= median && worst.abs() <= 0.04,
        "{name}: error median {:+.2} %, worst {:+.2} % in pose {at}",
        100.0 * middle,
        100.0 * worst
    );
}

#[test]
fn planes_in_any_pose_have_the_area_that_was_seen() {
    for (name, edge) in [("plane of 60 mm", 0.06), ("plane beyond the pictures", 0.4)] {
        for sensor in [EXACT, NOISY] {
            let pictures = Pictures::take(&plane(edge), &ABOVE, 0.3, camera(320, 0.3), sensor);
            check(name, &pictures, 0.01);
        }
    }
}

#[test]
fn depth_in_whole_millimetres_does_not_enlarge_a_plane() {
    // Pose 0: the plane lies on faces of voxels, and noise fills those on both sides.
    let pictures = Pictures::take(&plane(0.06), &ABOVE, 0.3, camera(320, 0.3), COARSE);
    check("plane of 60 mm in whole millimetres", &pictures, 0.01);
}

#[test]
fn spheres_in_any_pose_have_the_area_that_was_seen() {
    for (name, radius) in [("sphere of 25 mm", 0.025), ("sphere of 8 mm", 0.008)] {
        for sensor in [EXACT, NOISY] {
            let pictures = Pictures::take(&sphere(radius), &AROUND, 0.3, camera(320, 0.3), sensor);
            check(name, &pictures, 0.01);
        }
    }
}

#[test]
fn motors_in_any_pose_have_the_area_that_was_seen() {
    let motors = [(7, EXACT), (8, NOISY), (9, NOISY)];
    let pictures = motors.map(|(seed, sensor)| Pictures::take(&motor(seed), &AROUND, 0.5, camera(1280, 0.5), sensor));
    // One motor after the other, each pose once.
    let errors = (0..MOTOR_POSES).zip((0..motors.len()).cycle()).map(|(seed, of)| error(&pictures[of], seed)).collect();
    check_errors("motors", errors, 0.01);
}
