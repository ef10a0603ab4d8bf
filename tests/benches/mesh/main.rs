//! From 16 posed views of 640x480 to a mesh at 0.5 mm: map and mesher, and how far the mesh is from the true surface.
//!
//! `cargo bench -p semascan-tests --bench mesh -- [FOLDER]`. The views are those of the virtual cell, cut to the measuring
//! volume, with normal noise of 0.1 mm on otherwise exact depth and the true poses, so that the mesh alone is judged. With
//! a folder the inputs and the mesh are left there for `rivals.py`. A table goes to stderr, one JSON object to stdout.
#![allow(clippy::print_stdout)]

#[path = "../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::{Seconds, cheapest};
use nalgebra::{Isometry3, Point3};
use rand::{RngExt, SeedableRng};
use semascan_geometry::measure::SurfaceIndex;
use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_inspection::source::{Source, SourceInfo, TrueMesh};
use semascan_model::{SemanticCloud, SemanticMesh};
use semascan_perception::fuse::{LabelledView, MapConfig, OutlierFilter, SemanticMap};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::segment::{RecordedSegmenter, Segmentation, Segmenter};
use semascan_perception::view::{DepthImage, View};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde_json::json;
use std::path::Path;

const VIEWS: u32 = 16;
const SIZE: &str = "640x480";
/// Voxel edge, metres.
const VOXEL: f64 = 0.5e-3;
/// Standard deviation of the depth, metres.
const NOISE: f64 = 1e-4;
const SEED: u64 = 7;
const RUNS: u32 = 3;

/// One view as both programs get it.
struct Posed {
    view: View,
    segmentation: Segmentation,
    table_from_camera: Isometry3<f64>,
}

fn main() {
    let uri = format!("virtual:starter-motor?seed={SEED}&views={VIEWS}&size={SIZE}&errors=none&noise=none");
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a valid URI")).expect("opens");
    let truth = cell.truth().expect("the cell knows the truth").clone();
    let info = cell.info().clone();
    let views: Vec<Posed> = (0..VIEWS).map(|i| posed(&cell, &info, i)).collect();

    let mut report = serde_json::Map::new();
    report.insert("views".into(), VIEWS.into());
    report.insert("voxel_mm".into(), (VOXEL * 1e3).into());
    report.insert("noise_mm".into(), (NOISE * 1e3).into());
    let points: usize = views.iter().map(|v| v.view.depth.metres.iter().filter(|z| **z > 0.0).count()).sum();
    report.insert("points_in".into(), points.into());
    let mut made = None;
    // Both live to the end: the CPU time of a thread that is gone would be missing.
    let pools = [("one_thread", 1), ("all_threads", 0)]
        .map(|(name, threads)| (name, rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")));
    for (name, pool) in &pools {
        let (steps, cloud, mesh) = pool.install(|| run(&views, &info));
        let total = |of: fn(&Seconds) -> f64| steps.iter().map(|(_, s)| of(s)).sum::<f64>();
        let (cpu_s, wall_s) = (total(|s| s.cpu_s), total(|s| s.wall_s));
        for (step, s) in &steps {
            eprintln!("{name:<12} {step:<10} {:>8.1} ms CPU {:>8.1} ms wall", s.cpu_s * 1e3, s.wall_s * 1e3);
        }
        eprintln!("{name:<12} {:<10} {:>8.1} ms CPU {:>8.1} ms wall", "total", cpu_s * 1e3, wall_s * 1e3);
        let steps: serde_json::Map<_, _> = steps.into_iter().map(|(step, s)| (step.to_owned(), json!(s))).collect();
        report.insert((*name).into(), json!({ "steps": steps, "cpu_s": cpu_s, "wall_s": wall_s }));
        made = Some((cloud, mesh));
    }
    let (cloud, mesh) = made.expect("ran");
    let error = mean_error(&mesh, &truth);
    let (vertices, triangles) = (mesh.len(), mesh.triangles.len());
    eprintln!("{} voxels, {vertices} vertices, {triangles} triangles, mean error {:.4} mm", cloud.len(), error * 1e3);
    report.insert("voxels".into(), cloud.len().into());
    report.insert("vertices".into(), vertices.into());
    report.insert("triangles".into(), triangles.into());
    report.insert("vertices_mean_error_mm".into(), (error * 1e3).into());
    if let Some(folder) = std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        leave(Path::new(&folder), &views, &truth, &mesh).expect("the folder can be written");
    }
    println!("{}", serde_json::Value::Object(report));
}

/// View `i` with noise, cut to the measuring volume.
fn posed(cell: &VirtualCell, info: &SourceInfo, i: u32) -> Posed {
    let mut view = cell.view(i).expect("a view");
    let table_from_camera = view.truth.as_ref().expect("the cell knows the truth").table_from_camera;
    let (low, high) = info.volume.expect("the cell has a measuring volume");
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(SEED ^ u64::from(i));
    let k = view.intrinsics;
    let DepthImage { width, metres, .. } = std::sync::Arc::make_mut(&mut view.depth);
    for (pixel, z) in metres.iter_mut().enumerate().filter(|(_, z)| **z > 0.0) {
        let (u, v) = (pixel as u32 % *width, pixel as u32 / *width);
        let p: Point3<f64> = table_from_camera * k.unproject(u.into(), v.into(), f64::from(*z));
        let inside = (0..3).all(|a| p[a] >= low[a] && p[a] <= high[a]);
        // The sum of twelve uniform numbers is normal enough: mean 6, variance 1.
        let normal = (0..12).map(|_| random.random_range(0.0..1.0_f64)).sum::<f64>() - 6.0;
        *z = if inside { *z + (NOISE * normal) as f32 } else { 0.0 };
    }
    let segmentation = RecordedSegmenter.segment(&view).expect("the cell labels its views");
    Posed { view, segmentation, table_from_camera }
}

/// Every step on all views, each at its cheapest of several runs.
fn run(views: &[Posed], info: &SourceInfo) -> (Vec<(&'static str, Seconds)>, SemanticCloud, SemanticMesh) {
    let normals = || {
        let cloud = |v: &Posed| OrganizedCloud::new(v.view.intrinsics, &v.view.depth, None);
        views.iter().map(cloud).collect::<Vec<_>>()
    };
    let (normals_s, clouds) = cheapest(RUNS, normals);
    let labelled: Vec<LabelledView> = views
        .iter()
        .zip(clouds)
        .map(|(v, cloud)| LabelledView {
            index: v.view.index,
            cloud,
            rgb: v.view.rgb.clone(),
            segmentation: v.segmentation.clone(),
            table_from_camera: v.table_from_camera,
        })
        .collect();
    let integrate = || {
        let (components, defects) = (info.taxonomy.component_count(), info.taxonomy.defect_count());
        let mut map = SemanticMap::new(MapConfig::new(VOXEL, components, defects)).expect("valid settings");
        for view in &labelled {
            map.integrate(view).expect("integrates");
        }
        map
    };
    let (integrate_s, mut map) = cheapest(RUNS, integrate);
    let (outliers_s, _) = cheapest(RUNS, || map.mark_outliers(&OutlierFilter::default()));
    let (cloud_s, cloud) = cheapest(RUNS, || map.cloud());
    let options = MeshOptions::default();
    let (mesh_s, mesh) = cheapest(RUNS, || mesh_cloud(&cloud, VOXEL as f32, &options, &()).expect("usual settings"));
    let steps = vec![
        ("normals", normals_s),
        ("integrate", integrate_s),
        ("outliers", outliers_s),
        ("cloud", cloud_s),
        ("mesh", mesh_s),
    ];
    (steps, cloud, mesh)
}

/// Mean distance of the mesh's vertices from the true surface, metres.
fn mean_error(mesh: &SemanticMesh, truth: &TrueMesh) -> f64 {
    let index = SurfaceIndex::new(&truth.vertices, &truth.triangles);
    let distance = |p: &[f32; 3]| index.closest(*p).map(|n| f64::from(n.distance));
    mesh.vertices.positions.iter().filter_map(distance).sum::<f64>() / mesh.len().max(1) as f64
}

/// Leaves what the rival gets and what is judged beside it: little-endian columns, and the cameras as JSON.
fn leave(folder: &Path, views: &[Posed], truth: &TrueMesh, mesh: &SemanticMesh) -> std::io::Result<()> {
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.join(name), bytes);
    let floats = |rows: &[[f32; 3]]| rows.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let indices = |rows: &[[u32; 3]]| rows.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let mut cameras = Vec::new();
    for v in views {
        let depth = v.view.depth.metres.iter().flat_map(|z| z.to_le_bytes()).collect();
        write(&format!("depth-{}.f32", v.view.index), depth)?;
        let k = v.view.intrinsics;
        let camera_from_table = v.table_from_camera.inverse().to_homogeneous();
        let rows: Vec<Vec<f64>> = camera_from_table.row_iter().map(|r| r.iter().copied().collect()).collect();
        cameras.push(json!({
            "width": k.width, "height": k.height, "fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy,
            "camera_from_table": rows,
        }));
    }
    write("cameras.json", serde_json::to_vec(&cameras)?)?;
    write("truth-vertices.f32", floats(&truth.vertices))?;
    write("truth-triangles.u32", indices(&truth.triangles))?;
    write("mesh-vertices.f32", floats(&mesh.vertices.positions))?;
    write("mesh-triangles.u32", indices(&mesh.triangles))
}
