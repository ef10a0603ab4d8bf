//! One view registered against a fused model, every step counted: normals, rendering of the model, ICP.
//!
//! `cargo bench -p semascan-agent --bench registration -- [FOLDER]`. Simulated starter motors: eleven views with their
//! true poses make the model, the twelfth is aligned from a prior that is off by a degree and 3 mm. Once as a metrology
//! camera sees it (1920x1200), thrice at 640x480 with 1 mm of noise. The clouds, priors and true poses are left in FOLDER
//! for small_gicp and Open3D (`rivals.py`). Errors are those of the object: rotation, and where its centre comes to lie.
#![allow(clippy::print_stdout)]

#[path = "../../../shared/benches/metrics/cpu.rs"]
mod cpu;

use nalgebra::{Isometry3, Point3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_agent::acquire::virtual_cell::{VirtualCell, VirtualCellSpec};
use semascan_agent::acquire::{Source, View, covariance_of_prior};
use semascan_agent::fuse::{LabelledView, MapConfig, SemanticMap, voxel_for};
use semascan_agent::register::{IcpConfig, OrganizedCloud, SourcePoints, align, twist};
use semascan_agent::segment::{RecordedSegmenter, Segmenter};
use semascan_shared::model::{PointFlags, SemanticCloud};
use serde_json::json;
use std::path::{Path, PathBuf};

const RUNS: u32 = 5;
const VIEWS: u32 = 12;
/// Points that take part, as in the product.
const POINTS: usize = 80_000;

/// What is registered.
struct Case {
    name: &'static str,
    uri: String,
    /// Metres; as the product chooses it if absent.
    voxel: Option<f64>,
    /// Gaussian depth noise that is added, metres.
    noise: f64,
    /// The view that is registered; the others make the model.
    view: u32,
}

fn main() {
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--")).map(PathBuf::from);
    let motor = |seed: u32, size: &str, noise: &str| {
        format!("virtual:starter-motor?seed={seed}&views={VIEWS}&size={size}&errors=none&noise={noise}")
    };
    let case = |name, uri, voxel, noise| Case { name, uri, voxel, noise, view: 5 };
    let cases = [
        case("metrology", motor(31, "1920x1200", "zivid"), Some(0.38e-3), 0.0),
        case("noisy_1", motor(41, "640x480", "none"), None, 1e-3),
        case("noisy_2", motor(42, "640x480", "none"), None, 1e-3),
        case("noisy_3", motor(43, "640x480", "none"), None, 1e-3),
    ];
    let mut report = serde_json::Map::new();
    report.insert("threads".into(), rayon::current_num_threads().into());
    for case in cases {
        let figures = measure(&case, folder.as_deref());
        eprintln!("{}: {figures}", case.name);
        report.insert(case.name.into(), figures);
    }
    println!("{}", serde_json::Value::Object(report));
}

fn measure(case: &Case, folder: Option<&Path>) -> serde_json::Value {
    let spec = VirtualCellSpec::parse(&case.uri).expect("a valid source");
    let cell = VirtualCell::open(&spec).expect("opens");
    let mut random = Pcg64::seed_from_u64(17);
    let mut map: Option<SemanticMap> = None;
    let mut wanted = None;
    for index in 0..VIEWS {
        let mut view = cell.view(index).expect("a view");
        add_noise(&mut view, case.noise, &mut random);
        if index == case.view {
            wanted = Some(view);
            continue;
        }
        let segmentation = RecordedSegmenter { required: true }.segment(&view).expect("labels");
        let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, None);
        let map = map.get_or_insert_with(|| {
            let voxel = case.voxel.or_else(|| voxel_for(&cloud)).expect("depth");
            let taxonomy = &cell.info().taxonomy;
            SemanticMap::new(MapConfig::new(voxel, taxonomy.component_count(), taxonomy.defect_count())).expect("a map")
        });
        let pose = view.truth.as_ref().expect("truth").table_from_camera;
        let rgb = view.rgb;
        map.integrate(&LabelledView { index, cloud, rgb, segmentation, table_from_camera: pose }).expect("fuses");
    }
    let (mut map, view) = (map.expect("a model"), wanted.expect("the view"));
    map.mark_outliers(&Default::default());
    let truth = view.truth.as_ref().expect("truth").table_from_camera;
    let off = Vector6::new(0.010, -0.012, 0.008, 1.7e-3, -1.7e-3, 1.8e-3);
    let prior = truth * twist::motion(&off);
    let covariance = covariance_of_prior(0.0078, 1.35e-3);
    let labels = view.labels.as_ref().expect("labels").components.clone();
    // Only the object is registered, on both sides: what is masked out costs nothing.
    let others: Vec<bool> = labels.iter().map(|&c| c == 0).collect();

    let mut source = SourcePoints::default();
    let (cost, aligned) = cpu::cheapest(RUNS, || {
        let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, Some(&others));
        let stride = (cloud.len() as f64 / POINTS as f64).sqrt().ceil() as usize;
        source = SourcePoints::select(&cloud, stride, |i| labels[i], |i| labels[i] != 0);
        align(&source, &view.intrinsics, &map, &prior, &covariance, &IcpConfig::default()).expect("aligns")
    });
    // What the steps cost by themselves.
    let (normals, cloud) = cpu::cheapest(RUNS, || OrganizedCloud::new(view.intrinsics, &view.depth, Some(&others)));
    let centre = source.centroid().expect("points");
    let camera = map.model_camera(&view.intrinsics, centre.z);
    let (rendering, _) = cpu::cheapest(RUNS, || map.render(camera, &prior));
    let object: Vec<[f32; 3]> =
        (0..labels.len()).filter_map(|i| cloud.point(i).map(|p| [p.x as f32, p.y as f32, p.z as f32])).collect();
    let model = kept(&map.cloud());
    if let Some(folder) = folder {
        let save = |name: &str, bytes: &[u8]| {
            std::fs::write(folder.join(format!("{}.{name}", case.name)), bytes).expect("the folder can be written to");
        };
        save("view.f32", bytemuck::cast_slice(&object));
        save("model.f32", bytemuck::cast_slice(&model));
        let poses = json!({ "prior": matrix(&prior), "truth": matrix(&truth), "voxel_m": map.config().voxel });
        save("json", poses.to_string().as_bytes());
    }
    let (rotation, shift) = error(&aligned.table_from_camera, &truth, &centre);
    let (rotation_before, shift_before) = error(&prior, &truth, &centre);
    json!({
        "normals_cpu_s": normals.cpu_s, "rendering_cpu_s": rendering.cpu_s,
        "cpu_s": cost.cpu_s, "wall_s": cost.wall_s, "rounds": aligned.report.iterations,
        "view_points": object.len(), "model_points": model.len(), "voxel_mm": map.config().voxel * 1e3,
        "error_deg": rotation.to_degrees(), "error_mm": shift * 1e3,
        "prior_deg": rotation_before.to_degrees(), "prior_mm": shift_before * 1e3,
    })
}

fn add_noise(view: &mut View, sigma: f64, random: &mut Pcg64) {
    if sigma > 0.0 {
        for z in view.depth.metres.iter_mut().filter(|z| **z > 0.0) {
            let gauss: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            *z += (sigma * gauss) as f32;
        }
    }
}

/// Positions of the model's points that no filter has marked.
fn kept(cloud: &SemanticCloud) -> Vec<[f32; 3]> {
    let good = |i: &usize| !cloud.flags[*i].has(PointFlags::OUTLIER);
    (0..cloud.len()).filter(good).map(|i| cloud.positions[i]).collect()
}

/// Angle (radians) between two poses, and how far apart they put the object's centre (metres).
fn error(a: &Isometry3<f64>, b: &Isometry3<f64>, centre: &Point3<f64>) -> (f64, f64) {
    (a.rotation.angle_to(&b.rotation), (a * centre - b * centre).norm())
}

/// Rows of a homogeneous matrix.
fn matrix(pose: &Isometry3<f64>) -> Vec<Vec<f64>> {
    pose.to_homogeneous().row_iter().map(|r| r.iter().copied().collect()).collect()
}
