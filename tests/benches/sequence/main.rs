//! Long recordings: 50, 200 and 1000 views of 640x480 that a handheld camera takes of a made room, as the product inspects
//! them: time, memory, and how far the model is from what is true.
//!
//! `cargo bench -p semascan-tests --bench sequence -- [FOLDER] [VIEWS ...]`. The views are written to FOLDER (a temporary
//! one if absent) and read from there by an inspection in a process of its own, once with the poses that come with them and
//! once registered, and by `rivals.py`. The error is that of the depth which a ray finds on the finished mesh, from true
//! poses of every tenth of the recording, to the true depth; peak memory is that of the process (VmHWM). A table goes to
//! stderr, one JSON object to stdout.
#![allow(clippy::print_stdout)]

#[path = "../../../shared/geometry/benches/metrics/cpu.rs"]
#[allow(dead_code)]
mod cpu;
mod room;

use cpu::measure;
use glam::Vec3;
use image::RgbImage;
use nalgebra::{Isometry3, Matrix4};
use room::{CAMERA, POSE_SIGMA, Room, STEP};
use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_inspection::Inspection;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_model::record::LabelSource;
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_perception::view::{DepthImage, PoseEvidence, View, covariance_of_prior};
use semascan_simulation::raycast::RayScene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

const SEED: u64 = 11;
const COUNTS: [u32; 3] = [50, 200, 1000];
/// Voxel edge, metres.
const VOXEL: f64 = 5e-3;
/// Views that the model is judged from.
const JUDGES: u32 = 10;
/// Largest error that counts, metres: a ray that hits another surface says nothing more of how far this one is off.
const LARGEST: f64 = 0.05;
/// An argument that makes this program the process that inspects.
const INSPECT: &str = "--inspect";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [mode, folder, views, method] = arguments.as_slice()
        && mode == INSPECT
    {
        println!("{}", inspect(Path::new(folder), views.parse().expect("a number"), method));
        return;
    }
    let named: Vec<u32> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let counts = if named.is_empty() { COUNTS.to_vec() } else { named };
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let folder =
        arguments.iter().find(|a| a.parse::<u32>().is_err()).map_or_else(|| temporary.path().to_owned(), PathBuf::from);
    let room = Room::new(SEED);
    record(&room, &folder, &counts);
    let mut runs = Vec::new();
    for &views in &counts {
        for method in ["given", "registered"] {
            let this = std::env::current_exe().expect("this program");
            let run = Command::new(this)
                .args([INSPECT, &folder.display().to_string(), &views.to_string(), method])
                .stderr(Stdio::inherit())
                .output()
                .expect("runs");
            let mut run: Value = serde_json::from_slice(&run.stdout).expect("one JSON object");
            let error = judge(&room, views, &folder.join(format!("mesh-{views}-{method}")));
            run["error_mm"] = json!(error * 1e3);
            eprintln!(
                "{views:>5} views {method:<10} {:>8.1} s CPU {:>8.1} s wall {:>7.0} MB {:>6.2} mm, poses {:.2} mm",
                run["cpu_s"].as_f64().unwrap_or(f64::NAN),
                run["wall_s"].as_f64().unwrap_or(f64::NAN),
                run["peak_mb"].as_f64().unwrap_or(f64::NAN),
                error * 1e3,
                run["poses_mm"].as_f64().unwrap_or(f64::NAN),
            );
            runs.push(run);
        }
    }
    println!("{}", json!({ "voxel_mm": VOXEL * 1e3, "threads": rayon::current_num_threads(), "runs": runs }));
}

/// Writes the views: colours, depth in steps, and the poses that come with them as JSON.
fn record(room: &Room, folder: &Path, counts: &[u32]) {
    let write =
        |name: String, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("the folder can be written");
    let mut poses = Vec::new();
    for index in 0..counts.iter().copied().max().unwrap_or(0) {
        let shot = room.shot(index);
        let steps: Vec<u8> = shot.depth.metres.iter().flat_map(|z| ((z / STEP).round() as u16).to_le_bytes()).collect();
        write(format!("depth-{index}.u16"), &steps);
        write(format!("color-{index}.rgb"), shot.rgb.as_raw());
        let rows = |pose: &Isometry3<f64>| -> Vec<Vec<f64>> {
            pose.to_homogeneous().row_iter().map(|row| row.iter().copied().collect()).collect()
        };
        poses.push(json!({ "given": rows(&shot.table_from_camera), "true": rows(&shot.true_pose) }));
        if counts.iter().any(|views| index < *views && index % (views / JUDGES).max(1) == 0) {
            let depth: Vec<u8> = shot.true_depth.iter().flat_map(|z| z.to_le_bytes()).collect();
            write(format!("true-depth-{index}.f32"), &depth);
        }
    }
    write("poses.json".into(), &serde_json::to_vec(&poses).expect("JSON"));
}

fn poses(folder: &Path, which: &str) -> Vec<Isometry3<f64>> {
    let text = std::fs::read(folder.join("poses.json")).expect("written");
    let all: Vec<Value> = serde_json::from_slice(&text).expect("JSON");
    let pose = |rows: &Value| {
        let rows: Vec<Vec<f64>> = serde_json::from_value(rows.clone()).expect("a matrix");
        let matrix = Matrix4::from_fn(|r, c| rows[r][c]);
        let rotation = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        Isometry3::from_parts(
            nalgebra::Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]),
            nalgebra::UnitQuaternion::from_matrix(&rotation),
        )
    };
    all.iter().map(|both| pose(&both[which])).collect()
}

/// The recording as a source.
struct Recording {
    folder: PathBuf,
    poses: Vec<Isometry3<f64>>,
    next: u32,
    views: u32,
    info: SourceInfo,
}

impl Source for Recording {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let index = self.next;
        if index == self.views {
            return None;
        }
        self.next += 1;
        let read = |name: String| std::fs::read(self.folder.join(name)).expect("written");
        let metres = read(format!("depth-{index}.u16"))
            .chunks_exact(2)
            .map(|two| f32::from(u16::from_le_bytes([two[0], two[1]])) * STEP)
            .collect();
        let rgb = RgbImage::from_raw(CAMERA.width, CAMERA.height, read(format!("color-{index}.rgb")));
        let (metres_sigma, radians_sigma) = POSE_SIGMA;
        Some(Ok(View {
            index,
            stamp: Some(f64::from(index) / 30.0),
            intrinsics: CAMERA,
            rgb: Arc::new(rgb.expect("one colour a pixel")),
            depth: Arc::new(DepthImage { width: CAMERA.width, height: CAMERA.height, metres }),
            pose: PoseEvidence::World {
                table_from_camera: self.poses[index as usize],
                covariance: covariance_of_prior(radians_sigma, metres_sigma),
            },
            labels: None,
            truth: None,
        }))
    }
}

/// Inspects the first views of the recording and leaves the mesh; figures of the process.
fn inspect(folder: &Path, views: u32, method: &str) -> Value {
    let taxonomy = Taxonomy::from_names::<&str>(&[], &[]);
    let recording = Recording {
        folder: folder.to_owned(),
        poses: poses(folder, "given"),
        next: 0,
        views,
        info: SourceInfo {
            uri: folder.display().to_string(),
            part: "a room".into(),
            taxonomy,
            view_count: Some(views),
            turntable: None,
            volume: None,
            no_labels: None,
            settings: Vec::new(),
        },
    };
    let registration = if method == "given" { RegistrationMethod::Kinematic } else { RegistrationMethod::Auto };
    let mut spec = InspectionSpec { labels: LabelSource::None, registration, ..InspectionSpec::default() };
    spec.source.voxel_mm = Some(VOXEL * 1e3);
    let (seconds, (inspected, mesh)) = measure(|| {
        let inspected = Inspection::new(spec, Box::new(recording)).expect("valid").start().wait().expect("inspected");
        let mesh = mesh_cloud(&inspected.cloud, VOXEL as f32, &MeshOptions::default(), &()).expect("usual settings");
        (inspected, mesh)
    });
    leave(folder, &format!("mesh-{views}-{method}"), &mesh);
    let truth = poses(folder, "true");
    let mut off: Vec<f64> = inspected
        .record
        .views
        .iter()
        .filter_map(|view| {
            let pose = semascan_inspection::record::isometry(&view.pose?);
            Some((pose.translation.vector - truth[view.index as usize].translation.vector).norm())
        })
        .collect();
    off.sort_unstable_by(f64::total_cmp);
    json!({
        "views": views,
        "method": method,
        "cpu_s": seconds.cpu_s,
        "wall_s": seconds.wall_s,
        "peak_mb": peak_mb(),
        "accepted": inspected.record.views.iter().filter(|v| v.accepted).count(),
        "poses_mm": off.get(off.len() / 2).map(|m| m * 1e3),
        "triangles": mesh.triangles.len(),
    })
}

fn leave(folder: &Path, name: &str, mesh: &SemanticMesh) {
    let write =
        |kind: &str, bytes: Vec<u8>| std::fs::write(folder.join(format!("{name}{kind}")), bytes).expect("written");
    write("-vertices.f32", mesh.vertices.positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect());
    write("-triangles.u32", mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect());
}

/// Mean error of the depth that rays find on the mesh called `name`, cut at [`LARGEST`], metres; a ray that finds nothing
/// where something was measured counts as one at the bound.
fn judge(room: &Room, views: u32, name: &Path) -> f64 {
    let read = |kind: &str| std::fs::read(format!("{}{kind}", name.display())).expect("left");
    let four = |bytes: &[u8]| [bytes[0], bytes[1], bytes[2], bytes[3]];
    let vertices: Vec<f32> = read("-vertices.f32").chunks_exact(4).map(|b| f32::from_le_bytes(four(b))).collect();
    let triangles: Vec<u32> = read("-triangles.u32").chunks_exact(4).map(|b| u32::from_le_bytes(four(b))).collect();
    let vertices: Vec<[f32; 3]> = vertices.as_chunks::<3>().0.to_vec();
    let triangles: Vec<[u32; 3]> = triangles.as_chunks::<3>().0.to_vec();
    let scene = RayScene::new(&vertices, &triangles);
    let (mut sum, mut count) = (0.0, 0_u32);
    for index in (0..views).step_by((views / JUDGES).max(1) as usize) {
        let shot = room.shot(index);
        let eye = shot.true_pose.translation.vector.map(|c| c as f32);
        for (i, _) in shot.depth.metres.iter().enumerate().step_by(7).filter(|(_, z)| **z > 0.0) {
            let (u, v) = (i as u32 % CAMERA.width, i as u32 / CAMERA.width);
            let ray = shot.true_pose.rotation * CAMERA.unproject(u.into(), v.into(), 1.0).coords;
            let hit =
                scene.first_hit(Vec3::new(eye.x, eye.y, eye.z), Vec3::new(ray.x as f32, ray.y as f32, ray.z as f32));
            let error = hit.map_or(LARGEST, |hit| f64::from((hit.t - shot.true_depth[i]).abs()).min(LARGEST));
            sum += error;
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Peak memory of this process, MB; NaN where the system does not say.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1e3)
}
