//! One view registered against a fused model, every step counted: normals, rendering of the model, ICP.
//!
//! `cargo bench -p semascan-perception --bench registration -- [FOLDER]`. Simulated starter motors: eleven views with their
//! true poses make the model, the twelfth is aligned from a prior that is off by a degree and 3 mm. Once as a metrology
//! camera sees it (1920x1200), and three motors at 640x480 with 1 mm of noise, five views each. The clouds, priors and true poses are left in FOLDER
//! for small_gicp and Open3D (`rivals.py`). Errors are those of the object: rotation, and where its centre comes to lie.
#![allow(clippy::print_stdout)]

#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::Seconds;
use nalgebra::{Isometry3, Point3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use semascan_inspection::source::Source;
use semascan_model::{PointFlags, SemanticCloud};
use semascan_perception::fuse::{LabelledView, MapConfig, SemanticMap, voxel_for};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::{IcpConfig, SourcePoints, align, se3};
use semascan_perception::segment::{RecordedSegmenter, Segmenter};
use semascan_perception::view::{View, covariance_of_prior};
use semascan_simulation::{VirtualCell, VirtualCellSpec};

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
    /// The views that are registered, each against the model that the others make.
    views: &'static [u32],
}

fn main() {
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--")).map(PathBuf::from);
    let motor = |seed: u32, size: &str, noise: &str| {
        format!("virtual:starter-motor?seed={seed}&views={VIEWS}&size={size}&errors=none&noise={noise}")
    };
    let noisy = |name, seed| {
        let uri = motor(seed, "640x480", "none");
        Case { name, uri, voxel: None, noise: 1e-3, views: &[1, 3, 5, 8, 10] }
    };
    let metrology = motor(31, "1920x1200", "zivid");
    let cases = [
        Case { name: "metrology", uri: metrology, voxel: Some(0.38e-3), noise: 0.0, views: &[5] },
        noisy("noisy_1", 41),
        noisy("noisy_2", 42),
        noisy("noisy_3", 43),
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

/// The case's figures: sums of the costs' smallest values, root mean squares of the errors.
fn measure(case: &Case, folder: Option<&Path>) -> serde_json::Value {
    let spec = VirtualCellSpec::parse(&case.uri).expect("a valid source");
    let cell = VirtualCell::open(&spec).expect("opens");
    let mut random = Pcg64::seed_from_u64(17);
    let views: Vec<View> = (0..VIEWS)
        .map(|index| {
            let mut view = cell.view(index).expect("a view");
            add_noise(&mut view, case.noise, &mut random);
            view
        })
        .collect();
    let taxonomy = &cell.info().taxonomy;
    let classes = (taxonomy.component_count(), taxonomy.defect_count());
    let trials: Vec<Trial> = case.views.iter().map(|&wanted| trial(case, &views, wanted, classes, folder)).collect();
    let mean = |of: fn(&Trial) -> f64| trials.iter().map(of).sum::<f64>() / trials.len() as f64;
    let rms = |of: fn(&Trial) -> f64| (trials.iter().map(|t| of(t).powi(2)).sum::<f64>() / trials.len() as f64).sqrt();
    json!({
        "views": case.views, "voxel_mm": trials[0].voxel * 1e3,
        "normals_cpu_s": mean(|t| t.normals), "rendering_cpu_s": mean(|t| t.rendering),
        "cpu_s": mean(|t| t.cost.cpu_s), "wall_s": mean(|t| t.cost.wall_s), "rounds": mean(|t| t.rounds),
        "view_points": mean(|t| t.points), "model_points": mean(|t| t.model_points),
        "error_deg": rms(|t| t.error.0.to_degrees()), "error_mm": rms(|t| t.error.1 * 1e3),
        "prior_deg": rms(|t| t.prior.0.to_degrees()), "prior_mm": rms(|t| t.prior.1 * 1e3),
    })
}

/// One view against the model that the others make.
struct Trial {
    /// Metres.
    voxel: f64,
    /// CPU seconds.
    normals: f64,
    /// CPU seconds.
    rendering: f64,
    cost: Seconds,
    rounds: f64,
    points: f64,
    model_points: f64,
    /// Radians and metres.
    error: (f64, f64),
    /// The prior's.
    prior: (f64, f64),
}

fn trial(
    case: &Case,
    views: &[View],
    wanted: u32,
    (components, defects): (usize, usize),
    folder: Option<&Path>,
) -> Trial {
    let mut map: Option<SemanticMap> = None;
    for view in views.iter().filter(|view| view.index != wanted) {
        let segmentation = RecordedSegmenter.segment(view).expect("labels");
        let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, None);
        let map = map.get_or_insert_with(|| {
            let voxel = case.voxel.or_else(|| voxel_for(&cloud)).expect("depth");
            SemanticMap::new(MapConfig::new(voxel, components, defects)).expect("a map")
        });
        let (table_from_camera, rgb) = (true_pose(view), view.rgb.clone());
        map.integrate(&LabelledView { index: view.index, cloud, rgb, segmentation, table_from_camera }).expect("fuses");
    }
    let (mut map, view) = (map.expect("a model"), &views[wanted as usize]);
    map.mark_outliers(&Default::default());
    let truth = true_pose(view);
    let off = Vector6::new(0.010, -0.012, 0.008, 1.7e-3, -1.7e-3, 1.8e-3);
    let prior = truth * se3::exp(&off);
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
            let file = folder.join(format!("{}.{wanted}.{name}", case.name));
            std::fs::write(file, bytes).expect("the folder can be written to");
        };
        save("view.f32", bytemuck::cast_slice(&object));
        save("model.f32", bytemuck::cast_slice(&model));
        let poses = json!({ "prior": matrix(&prior), "truth": matrix(&truth), "voxel_m": map.config().voxel });
        save("json", poses.to_string().as_bytes());
    }
    let trial = Trial {
        voxel: map.config().voxel,
        normals: normals.cpu_s,
        rendering: rendering.cpu_s,
        cost,
        rounds: f64::from(aligned.report.iterations),
        points: object.len() as f64,
        model_points: model.len() as f64,
        error: error(&aligned.table_from_camera, &truth, &centre),
        prior: error(&prior, &truth, &centre),
    };
    let (rotation, shift) = trial.error;
    eprintln!("{} view {wanted}: {:.4} deg {:.4} mm", case.name, rotation.to_degrees(), shift * 1e3);
    trial
}

fn true_pose(view: &View) -> Isometry3<f64> {
    view.truth.as_ref().expect("truth").table_from_camera
}

fn add_noise(view: &mut View, sigma: f64, random: &mut Pcg64) {
    if sigma > 0.0 {
        for z in std::sync::Arc::make_mut(&mut view.depth).metres.iter_mut().filter(|z| **z > 0.0) {
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
