//! The area that an inspection states, against the area that its views have seen.

mod posed_shape;

use posed_shape::{PosedShape, Sensor, Setup, pose};
use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_inspection::Inspection;
use semascan_inspection::source::{Source, TrueMesh};
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_perception::view::Intrinsics;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

const CAMERA: Intrinsics = Intrinsics { width: 1280, height: 960, fx: 1800.0, fy: 1800.0, cx: 639.5, cy: 479.5 };

fn sphere(radius: f32) -> TrueMesh {
    let (rows, columns) = (180_u32, 360_u32);
    let mut mesh = TrueMesh::default();
    for r in 0..=rows {
        for c in 0..columns {
            let (t, p) =
                (std::f32::consts::PI * r as f32 / rows as f32, std::f32::consts::TAU * c as f32 / columns as f32);
            mesh.vertices.push([t.sin() * p.cos(), t.sin() * p.sin(), t.cos()].map(|x| x * radius));
            mesh.labels.push(if p.cos() > 0.0 { 1 } else { 2 });
            mesh.defects.push(0);
            let (a, b) = (r * columns + c, r * columns + (c + 1) % columns);
            if r < rows {
                mesh.triangles.extend([[a, a + columns, b + columns], [a, b + columns, b]]);
            }
        }
    }
    mesh
}

fn plane(width: f32, height: f32) -> TrueMesh {
    let (w, h) = (0.5 * width, 0.5 * height);
    TrueMesh {
        vertices: vec![[-w, -h, 0.0], [w, -h, 0.0], [w, h, 0.0], [-w, h, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        labels: vec![1; 4],
        defects: vec![0; 4],
        taxonomy: None,
    }
}

fn motor(seed: u64) -> TrueMesh {
    let uri = format!("virtual:starter-motor?seed={seed}&views=1");
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
    let mut mesh = cell.truth().expect("simulated").clone();
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in &mesh.vertices {
        for a in 0..3 {
            (low[a], high[a]) = (low[a].min(p[a]), high[a].max(p[a]));
        }
    }
    for p in &mut mesh.vertices {
        *p = std::array::from_fn(|a| p[a] - 0.5 * (low[a] + high[a]));
    }
    eprintln!("motor {:?}", [0, 1, 2].map(|a| high[a] - low[a]));
    mesh
}

const RING: [[f64; 3]; 8] = [
    [1.0, 0.0, 0.4],
    [0.0, 1.0, 0.9],
    [-1.0, 0.0, 0.4],
    [0.0, -1.0, 0.9],
    [1.0, 1.0, 0.9],
    [-1.0, 1.0, 0.2],
    [-1.0, -1.0, 0.9],
    [1.0, -1.0, 0.2],
];

#[test]
#[ignore = "prints"]
fn measure() {
    let table: Vec<[f64; 3]> =
        [0.0, 0.5, 1.0, 1.5].iter().map(|a: &f64| [0.5 * (4.0 * a).cos(), 0.5 * (4.0 * a).sin(), 1.0]).collect();
    let setups = [
        ("sphere 25", Setup::around(sphere(0.025), &RING, 0.45, CAMERA)),
        ("sphere 8 ", Setup::around(sphere(0.008), &RING, 0.45, CAMERA)),
        ("sphere 25 from 2", Setup::around(sphere(0.025), &RING[..2], 0.45, CAMERA)),
        ("plane 100x80", Setup::around(plane(0.1, 0.08), &table, 0.45, CAMERA)),
        ("plane cut", Setup::around(plane(0.6, 0.6), &table, 0.45, CAMERA)),
        ("motor", Setup::around(motor(7), &RING, 0.5, CAMERA)),
    ];
    let sensors = [("exact", 0.0, 0.0), ("0.1", 1e-4, 0.0), ("1mm", 0.0, 1e-3)];
    let poses: u64 = std::env::var("POSES").map_or(3, |p| p.parse().expect("a number"));
    for (name, setup) in &setups {
        for (sensor, sigma, step) in sensors {
            let sensor_model = Sensor { sigma, step };
            for seed in 0..poses {
                let at = if seed == 0 { nalgebra::Isometry3::identity() } else { pose(seed) };
                let source = PosedShape::new(setup, &at, sensor_model, seed);
                let seen = source.seen(200_000);
                let mut spec =
                    InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() };
                spec.source.voxel_mm = Some(0.5);
                let inspected =
                    Inspection::new(spec, Box::new(source)).expect("set up").start().wait().expect("a model");
                let mesh = mesh_cloud(&inspected.cloud, 5e-4, &MeshOptions::default(), &()).expect("a mesh");
                let truth = seen.area();
                let voxels: f64 = inspected.record.components.iter().filter_map(|c| c.area).sum();
                let corrected: f64 = semascan_geometry::measure::seen_vertex_areas(&mesh, 5e-4).iter().sum();
                let percent = |a: f64| 100.0 * (a / truth - 1.0);
                let beyond = |cosine: f64| seen.each * seen.samples.iter().filter(|s| s.cosine > cosine).count() as f64;
                eprintln!(
                    "{name:>16} {sensor:>5} {seed}: truth {:8.1} mm2, voxels {:+6.2} %, mesh {:+6.2} %; corrected for cos > 0 {:+6.2}, .1 {:+6.2}, .17 {:+6.2}, .2 {:+6.2}, .25 {:+6.2} %",
                    truth * 1e6,
                    percent(voxels),
                    percent(mesh.area()),
                    100.0 * (corrected / truth - 1.0),
                    100.0 * (corrected / beyond(0.1) - 1.0),
                    100.0 * (corrected / beyond(0.17) - 1.0),
                    100.0 * (corrected / beyond(0.2) - 1.0),
                    100.0 * (corrected / beyond(0.25) - 1.0),
                );
            }
        }
    }
}

#[test]
#[ignore = "prints"]
fn measure_cell() {
    for size in ["1280x960", "640x480"] {
        for seed in 1..3 {
            let uri = format!("virtual:starter-motor?seed={seed}&views=12&size={size}&errors=none");
            let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
            let truth = cell.truth().expect("simulated").clone();
            let rays = semascan_simulation::raycast::RayScene::new(&truth.vertices, &truth.triangles);
            let views: Vec<_> = (0..12).filter_map(|i| cell.view(i)).collect();
            let pictures: Vec<_> = views
                .iter()
                .map(|v| semascan_evaluation::SeenFrom {
                    intrinsics: &v.intrinsics,
                    depth: &v.depth,
                    table_from_camera: v.truth.as_ref().expect("simulated").table_from_camera,
                })
                .collect();
            let seen = semascan_evaluation::SeenSurface::of(&truth, &rays, &pictures, 200_000, 1);
            for voxel in [None] {
                let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
                let mut spec =
                    InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() };
                spec.source.voxel_mm = voxel;
                let inspected = Inspection::new(spec, Box::new(cell)).expect("set up").start().wait().expect("a model");
                let voxel = inspected.record.voxel.expect("a voxel") as f32;
                let mesh = mesh_cloud(&inspected.cloud, voxel, &MeshOptions::default(), &()).expect("a mesh");
                let voxels: f64 = inspected.record.components.iter().filter_map(|c| c.area).sum();
                let corrected: f64 = semascan_geometry::measure::seen_vertex_areas(&mesh, voxel).iter().sum();
                let beyond = |cosine: f64| seen.each * seen.samples.iter().filter(|s| s.cosine > cosine).count() as f64;
                eprint!(
                    "cell {size} {seed} voxel {voxel}: truth {:.1} mm2, voxels {:+.2}, mesh {:+.2}; corrected",
                    seen.area() * 1e6,
                    100.0 * (voxels / seen.area() - 1.0),
                    100.0 * (mesh.area() / seen.area() - 1.0)
                );
                for c in [0.0, 0.1, 0.17, 0.2, 0.25] {
                    eprint!(" {c}: {:+.2}", 100.0 * (corrected / beyond(c) - 1.0));
                }
                eprintln!();
                let index = semascan_geometry::measure::SurfaceIndex::new(&mesh.vertices.positions, &mesh.triangles);
                let at: Vec<[f32; 3]> = seen.samples.iter().map(|s| s.position.map(|c| c as f32)).collect();
                let near = index.closest_of_all(&at);
                let share = 100.0 * seen.each / beyond(0.17);
                let mut missing = [0.0; 10];
                for (s, n) in seen.samples.iter().zip(near) {
                    if n.is_none_or(|n| n.distance > 0.7 * voxel) {
                        missing[((s.cosine * 10.0) as usize).min(9)] += share;
                    }
                }
                let grid = semascan_geometry::measure::NearestPoints::new(&at);
                let areas = semascan_geometry::measure::seen_vertex_areas(&mesh, voxel);
                let truth_index = semascan_geometry::measure::SurfaceIndex::new(&truth.vertices, &truth.triangles);
                let on_truth = truth_index.closest_of_all(&mesh.vertices.positions);
                let (mut far, mut unseen) = (0.0, 0.0);
                for ((p, a), t) in mesh.vertices.positions.iter().zip(areas).zip(on_truth) {
                    if t.is_none_or(|t| t.distance > 0.7 * voxel) {
                        far += 100.0 * a / beyond(0.17);
                    } else if grid.nearest(*p).is_none_or(|n| n.distance() > f64::from(1.2 * voxel)) {
                        unseen += 100.0 * a / beyond(0.17);
                    }
                }
                eprintln!(
                    "   missing by cosine {missing:.2?}, mesh off the truth {far:.2}, on what was not seen {unseen:.2} %"
                );
            }
        }
    }
}
