//! Whole-cell tests at small sizes.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use nalgebra::Point3;

use super::*;
use semascan_geometry::measure::SurfaceIndex;

fn open(query: &str) -> VirtualCell {
    let uri = format!("virtual:starter-motor?size=160x120&cell=2.5&{query}");
    VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a valid URI")).expect("a motor needs no file")
}

fn ideal() -> &'static VirtualCell {
    static CELL: OnceLock<VirtualCell> = OnceLock::new();
    CELL.get_or_init(|| open("seed=7&views=12&errors=none&noise=none"))
}

#[test]
fn same_seed_same_bytes_on_any_number_of_threads() {
    let capture = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let cell = open(&format!("seed={seed}&views=2"));
            (cell.view(1).expect("two views"), cell.truth().expect("truth").vertices.clone())
        })
    };
    let ((one, mesh_one), (three, mesh_three)) = (capture(1, 7), capture(3, 7));
    assert_eq!(one.rgb, three.rgb);
    assert_eq!(one.depth, three.depth);
    assert_eq!((one.labels, one.pose, mesh_one), (three.labels, three.pose, mesh_three));
    assert_ne!(one.rgb, capture(2, 8).0.rgb, "another seed is another motor");
}

#[test]
fn another_cell_can_see_the_same_motor() {
    let (a, b, c) = (open("seed=3"), open("seed=9&part-seed=3"), open("seed=9"));
    let mesh = |cell: &VirtualCell| cell.truth().expect("truth").vertices.clone();
    assert_eq!(mesh(&a), mesh(&b));
    assert_ne!(mesh(&a), mesh(&c));
    assert_ne!(a.view(0).expect("a view").rgb, b.view(0).expect("a view").rgb);
}

#[test]
fn depth_and_labels_agree_with_the_true_mesh() {
    let cell = ideal();
    let truth = cell.truth().expect("truth");
    let index = SurfaceIndex::new(&truth.vertices, &truth.triangles);
    let (low, high) = cell.info().volume.expect("a volume");
    let (mut checked, mut right) = (0, 0);
    for i in [0, 4, 9] {
        let view = cell.view(i).expect("twelve views");
        let pose = view.truth.expect("truth").table_from_camera;
        let labels = view.labels.expect("labels");
        for (k, z) in view.depth.metres.iter().enumerate().filter(|(_, z)| **z > 0.0) {
            let (u, v) = (k as u32 % 160, k as u32 / 160);
            let p = pose * view.intrinsics.unproject(f64::from(u), f64::from(v), f64::from(*z));
            if !(0..3).all(|a| p[a] > low[a] && p[a] < high[a]) {
                assert!(labels.components[k] == 0 || p.z <= low.z, "the part is inside its volume");
                continue;
            }
            let near = index.closest([p.x as f32, p.y as f32, p.z as f32]).expect("a mesh");
            assert!(near.distance < 2e-5, "{} m off the true surface", near.distance);
            checked += 1;
            right +=
                usize::from(truth.labels[truth.triangles[near.triangle as usize][0] as usize] == labels.components[k]);
        }
    }
    assert!(checked > 3000, "{checked} points");
    assert!(right * 200 > checked * 199, "{right} of {checked} labels agree");
}

#[test]
fn noise_stays_near_the_surface_and_leaves_gaps() {
    let cell = open("seed=7&views=3&errors=none");
    let (mut errors, mut gaps, mut part) = (Vec::new(), 0, 0);
    for i in 0..3 {
        let noisy = cell.view(i).expect("three views");
        let mut exact_camera = cell.camera.clone();
        exact_camera.sensor = None;
        let pose = noisy.truth.as_ref().expect("truth").table_from_camera;
        let angle = cell.station.move_to(&viewpoint(cell.spec.sampling, 7, i, 3, &cell.target), i).table_angle;
        let exact = exact_camera.capture(&cell.scene, &pose, angle, 1);
        let labels = noisy.labels.expect("labels");
        for (k, (z, true_z)) in noisy.depth.metres.iter().zip(&exact.depth.metres).enumerate() {
            if labels.components[k] != 0 {
                part += 1;
                if *z > 0.0 { errors.push((z - true_z).abs()) } else { gaps += 1 }
            }
        }
    }
    errors.sort_by(f32::total_cmp);
    let (median, p95) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
    assert!((4e-5..4e-4).contains(&median) && p95 < 2e-3, "median {median}, 95 % {p95}");
    let share = f64::from(gaps) / f64::from(part);
    assert!((0.02..0.45).contains(&share), "{share} of the part is missing");
}

#[test]
fn every_component_and_defects_are_seen() {
    for seed in [1, 2, 3] {
        let cell = open(&format!("seed={seed}&views=12&noise=none&size=160x120").replace("&size=160x120", ""));
        let (mut pixels, mut defects) = ([0_usize; 6], BTreeSet::new());
        for i in 0..12 {
            let labels = cell.view(i).expect("twelve views").labels.expect("labels");
            for (c, d) in labels.components.iter().zip(&labels.defects) {
                pixels[usize::from(*c)] += 1;
                defects.insert(*d);
                assert!(*c != 0 || *d == 0, "defects are on the part");
            }
        }
        assert!(pixels.iter().all(|n| *n > 150), "seed {seed}: {pixels:?}");
        assert!(defects.len() >= 3, "seed {seed}: {defects:?}");
        let truth = cell.truth().expect("truth");
        let classes: BTreeSet<u16> = truth.labels.iter().copied().collect();
        assert_eq!(classes, (0..6).collect(), "true labels");
        assert!(truth.defects.iter().any(|d| *d != 0));
        assert_eq!(truth.labels.len(), truth.vertices.len());
    }
}

#[test]
fn the_part_fills_the_picture_and_the_table_is_below_its_volume() {
    let cell = ideal();
    let info = cell.info();
    assert_eq!((info.view_count, info.taxonomy.component_count(), info.taxonomy.defect_count()), (Some(12), 6, 4));
    assert!(info.settings.contains(&("seed".into(), "7".into())));
    let table = info.turntable.expect("a turntable");
    assert!(info.volume.expect("a volume").0.z > table.height);
    for i in 0..12 {
        let view = cell.view(i).expect("twelve views");
        let labels = view.labels.expect("labels");
        let share = labels.components.iter().filter(|c| **c != 0).count() as f64 / 19200.0;
        assert!((0.06..0.6).contains(&share), "view {i}: the part takes {share} of the picture");
        let rim = (0..120).flat_map(|v| [v * 160, v * 160 + 159]).chain(0..160);
        assert!(rim.into_iter().all(|k| labels.components[k] == 0), "view {i}: the part is cut off");
        let middle = view.truth.expect("truth").table_from_camera.inverse() * Point3::new(0.0, 0.0, cell.target.height);
        let (u, v) = view.intrinsics.project(&middle).expect("before the camera");
        assert!((u - 80.0).abs() < 6.0 && (v - 60.0).abs() < 6.0, "the camera looks at the part: {u} {v}");
    }
}

#[test]
fn views_come_in_order_and_end() {
    let mut cell = open("seed=3&views=2&sampling=random");
    let first = cell.next_view().expect("first").expect("no view fails");
    let second = cell.next_view().expect("second").expect("no view fails");
    assert_eq!((first.index, second.index), (0, 1));
    assert!(first.stamp.is_some() && second.stamp > first.stamp);
    assert!(cell.next_view().is_none() && cell.next_view().is_none());
}

#[test]
fn errors_move_the_true_camera_off_the_reported_one() {
    let off = |query: &str| {
        let view = open(query).view(0).expect("a view");
        let PoseEvidence::Chain { chain: c, covariance } = view.pose else { panic!("a chain") };
        let turned = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), -c.table_angle);
        let in_table = c.base_from_tablebase.inverse() * c.base_from_ee * c.ee_from_camera * Point3::new(0.0, 0.0, 0.5);
        let seen = view.truth.expect("truth").table_from_camera * Point3::new(0.0, 0.0, 0.5);
        ((turned * in_table - seen).norm(), covariance.trace())
    };
    let (exact, none) = off("seed=4&views=1&errors=none");
    assert!(exact < 1e-12 && none < 1e-11, "{exact}");
    let (moved, some) = off("seed=4&views=1");
    assert!((2e-4..5e-3).contains(&moved) && some > 1e-7, "a point moves by {moved} m");
}

#[test]
fn a_mesh_file_is_a_part_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("wedge.obj");
    let wedge = "v 0 0 0\nv 80 0 0\nv 0 60 0\nv 0 0 50\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(&path, wedge).expect("written");
    let uri = |scale: &str| format!("virtual:mesh?path={}&size=160x120&views=3{scale}", path.display());
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri("&scale=0.001")).expect("valid")).expect("a wedge");
    assert_eq!(cell.info().taxonomy.components[1].name, "wedge");
    let labels = cell.view(1).expect("three views").labels.expect("labels");
    assert!(labels.components.iter().filter(|c| **c == 1).count() > 200);
    // No part is 80 m long: without a scale one unit is taken for a millimetre, and a metre is refused.
    let assumed = VirtualCell::open(&VirtualCellSpec::parse(&uri("")).expect("valid")).expect("millimetres");
    assert!(assumed.info().settings.contains(&("scale".into(), "0.001".into())), "{:?}", assumed.info().settings);
    let refused = VirtualCell::open(&VirtualCellSpec::parse(&uri("&scale=1")).expect("valid"));
    assert!(refused.err().is_some_and(|error| error.to_string().contains("scale")), "80 m long");
}

/// Datum features are what measurements are judged by: their surfaces are those of the mesh that the camera sees.
#[test]
fn datum_features_lie_on_the_true_mesh() {
    for seed in [7, 8, 9] {
        let uri = format!("virtual:starter-motor?size=160x120&cell=1.2&seed={seed}");
        let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
        let truth = cell.truth().expect("truth");
        let index = SurfaceIndex::new(&truth.vertices, &truth.triangles);
        assert!(cell.datums().len() > 15, "{}", cell.datums().len());
        for datum in cell.datums() {
            let near = places(&datum.surface).into_iter().filter(|place| {
                let place = place.map(|c| c as f32);
                index.closest_of_all(&[place])[0].is_some_and(|nearest| nearest.distance < 6e-5)
            });
            // Much of some is cut away or grown over: the rear cover has vents, an ear end its boss.
            let share = near.count() as f64 / places(&datum.surface).len() as f64;
            assert!(share > 0.25, "seed {seed}, {}: {share} of it on the mesh", datum.name);
        }
    }
    let square = "virtual:starter-motor?size=160x120&cell=2.5&seed=7&part-seed=8";
    let cell = VirtualCell::open(&VirtualCellSpec::parse(square).expect("a URI")).expect("a motor");
    assert_eq!(cell.datums(), open("seed=8&part-seed=8").datums(), "those of the motor, whichever cell sees it");
}

/// Places of a datum feature, metres.
fn places(surface: &DatumSurface) -> Vec<[f64; 3]> {
    let turns = |k: u32| (f64::from(k % 40) / 40.0 * std::f64::consts::TAU).sin_cos();
    let share = |k: u32| (f64::from(k / 40) + 0.5) / 5.0;
    let place = |k: u32| match *surface {
        DatumSurface::Plane { middle, normal, inner, outer } => {
            let (u, v) = glam::Vec3::from_array(normal.map(|c| c as f32)).any_orthonormal_pair();
            let ((sine, cosine), out) = (turns(k), inner + (outer - inner) * share(k));
            [0, 1, 2].map(|i| middle[i] + out * (cosine * f64::from(u[i]) + sine * f64::from(v[i])))
        }
        DatumSurface::Cylinder { middle, axis, radius, half, .. } => {
            let (u, v) = glam::Vec3::from_array(axis.map(|c| c as f32)).any_orthonormal_pair();
            let ((sine, cosine), along) = (turns(k), half * (2.0 * share(k) - 1.0));
            [0, 1, 2]
                .map(|i| middle[i] + along * axis[i] + radius * (cosine * f64::from(u[i]) + sine * f64::from(v[i])))
        }
    };
    (0..200).map(place).collect()
}
