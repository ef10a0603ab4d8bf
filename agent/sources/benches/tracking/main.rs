//! A handheld camera tracked frame by frame, on a recorded sequence whose poses are known, and lost for two seconds on it.
//!
//! `SEMASCAN_TRACKING=SEQUENCE cargo bench -p semascan-sources --bench tracking -- [FOLDER]`. SEQUENCE is any recording with poses
//! that the agent opens (7-Scenes, TUM RGB-D ...); `SEMASCAN_TRACKING_FRAMES` takes that many of its frames. Without one nothing is
//! measured, which is said. The frames are left in FOLDER/sequence as a TUM RGB-D folder, so that Open3D reads the same files
//! (`rivals.py`). Printed are the absolute trajectory error (root mean square after the best rigid motion), the error over a second,
//! and milliseconds a frame: those of the tracker, without reading files.
#![allow(clippy::print_stdout)]

#[allow(dead_code)] // Other benchmarks compare the cheapest of several runs.
#[path = "../../../../shared/geometry/benches/metrics/cpu.rs"]
mod cpu;

use cpu::measure;
use image::{ImageBuffer, ImageEncoder, Luma};
use nalgebra::{Isometry3, Matrix3, Vector3};
use semascan_perception::register::tracking::Tracker;
use semascan_perception::view::{DepthImage, View};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// Frames a second.
const RATE: usize = 30;
/// Units of depth a metre in a TUM RGB-D folder.
const UNITS: f32 = 5000.0;

fn main() {
    let Ok(uri) = std::env::var("SEMASCAN_TRACKING") else {
        eprintln!("SEMASCAN_TRACKING names no sequence with poses: nothing is measured");
        return;
    };
    let most = std::env::var("SEMASCAN_TRACKING_FRAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(usize::MAX);
    if let Some(folder) = std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        write_sequence(&uri, most, &Path::new(&folder).join("sequence"));
    }
    let undisturbed = track(&uri, most, 0..0);
    let frames = undisturbed["frames"].as_u64().unwrap_or(0) as usize;
    let begin = frames / 2;
    let darkness = track(&uri, most, begin..begin + 2 * RATE);
    let result = json!({ "tracker": undisturbed, "two_seconds_of_darkness": darkness });
    println!("{}", serde_json::to_string_pretty(&result).expect("plain data"));
}

/// The frames of a sequence, each with its true pose.
fn frames(uri: &str, most: usize) -> impl Iterator<Item = (View, Isometry3<f64>)> {
    let mut source = semascan_sources::open(uri, semascan_sources::OpenOptions::default())
        .expect("SEMASCAN_TRACKING is a recording");
    let views = std::iter::from_fn(move || source.next_view());
    views.map(|view| view.expect("a whole frame")).take(most).map(|view| {
        let pose = view.pose.table_from_camera().expect("the sequence has poses");
        (view, pose)
    })
}

/// Tracks the sequence, nothing being seen in the frames of `dark`.
fn track(uri: &str, most: usize, dark: std::ops::Range<usize>) -> Value {
    let mut tracker = Tracker::default();
    let (mut truth, mut online, mut times) = (Vec::new(), Vec::new(), Vec::new());
    let (mut loops, mut found) = (0, None);
    for (i, (view, pose)) in frames(uri, most).enumerate() {
        let view = if dark.contains(&i) { darkened(view) } else { view };
        let (seconds, tracked) = measure(|| tracker.track(&view));
        if let Err(why) = &tracked.health {
            eprintln!("   frame {i}: {why}");
        }
        if tracked.found_again && i >= dark.end && found.is_none() {
            found = Some(i);
        }
        loops += tracked.loops;
        times.push(seconds);
        online.push(tracked.world_from_camera);
        truth.push(pose);
    }
    let count = truth.len() as f64;
    let mut processor: Vec<f64> = times.iter().map(|t| 1e3 * t.cpu_s).collect();
    processor.sort_by(f64::total_cmp);
    let trajectory = tracker.trajectory();
    let mut figures = json!({
        "frames": truth.len(),
        "tracked": online.iter().flatten().count(),
        "keyframes": tracker.keyframes(),
        "loops": loops,
        "ate_mm": absolute_error(&trajectory, &truth),
        "ate_as_it_went_mm": absolute_error(&online, &truth),
        "rpe_1s_mm": error_over_a_second(&trajectory, &truth),
        "wall_ms": times.iter().map(|t| 1e3 * t.wall_s).sum::<f64>() / count,
        "processor_ms": processor.iter().sum::<f64>() / count,
        "processor_95_percent_ms": processor.get(processor.len() * 95 / 100),
    });
    if !dark.is_empty() {
        // Those that come after the darkness, by the motion that the frames before it are aligned with.
        let after = found.unwrap_or(truth.len());
        figures["frames_until_found"] = found.map_or(Value::Null, |found| json!(found - dark.end));
        figures["ate_after_mm"] = absolute_error(&online[after..], &truth[after..]).into();
    }
    figures
}

fn darkened(view: View) -> View {
    let mut rgb = view.rgb.as_ref().clone();
    rgb.fill(0);
    let depth = DepthImage { metres: vec![0.0; view.depth.metres.len()], ..view.depth.as_ref().clone() };
    View { rgb: Arc::new(rgb), depth: Arc::new(depth), ..view }
}

/// Root mean square distance of the cameras after the best rigid motion, millimetres.
fn absolute_error(found: &[Option<Isometry3<f64>>], truth: &[Isometry3<f64>]) -> Option<f64> {
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = found
        .iter()
        .zip(truth)
        .filter_map(|(found, truth)| Some((found.as_ref()?.translation.vector, truth.translation.vector)))
        .collect();
    let count = pairs.len() as f64;
    let means =
        pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (p, q)| (a + p / count, b + q / count));
    let product: Matrix3<f64> = pairs.iter().map(|(p, q)| (p - means.0) * (q - means.1).transpose()).sum();
    let svd = product.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (v_t.transpose() * u.transpose()).determinant().signum();
    let turn = v_t.transpose() * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
    let squares: f64 = pairs.iter().map(|(p, q)| (turn * (p - means.0) - (q - means.1)).norm_squared()).sum();
    (count > 2.0).then(|| 1e3 * (squares / count).sqrt())
}

/// Root mean square of the translation's error over a second, millimetres.
fn error_over_a_second(found: &[Option<Isometry3<f64>>], truth: &[Isometry3<f64>]) -> Option<f64> {
    let errors: Vec<f64> = (0..truth.len().saturating_sub(RATE))
        .filter_map(|i| {
            let way = found[i]?.inverse() * found[i + RATE]?;
            let true_way = truth[i].inverse() * truth[i + RATE];
            Some((true_way.inverse() * way).translation.vector.norm_squared())
        })
        .collect();
    (!errors.is_empty()).then(|| 1e3 * (errors.iter().sum::<f64>() / errors.len() as f64).sqrt())
}

/// Leaves the sequence in `folder` as a TUM RGB-D folder.
fn write_sequence(uri: &str, most: usize, folder: &Path) {
    for part in ["rgb", "depth"] {
        fs::create_dir_all(folder.join(part)).expect("the folder can be written");
    }
    let (mut rgb, mut depth, mut poses) = (String::new(), String::new(), String::new());
    for (i, (view, pose)) in frames(uri, most).enumerate() {
        let stamp = format!("{:.6}", i as f64 / RATE as f64);
        write_png(&folder.join(format!("rgb/{stamp}.png")), |file| {
            let (width, height) = view.rgb.dimensions();
            fast(file).write_image(view.rgb.as_raw(), width, height, image::ExtendedColorType::Rgb8)
        });
        let units = view.depth.metres.iter().map(|z| (z * UNITS).round().min(f32::from(u16::MAX)) as u16).collect();
        let picture: ImageBuffer<Luma<u16>, Vec<u16>> =
            ImageBuffer::from_raw(view.depth.width, view.depth.height, units).expect("a value a pixel");
        write_png(&folder.join(format!("depth/{stamp}.png")), |file| picture.write_with_encoder(fast(file)));
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let _ = writeln!(rgb, "{stamp} rgb/{stamp}.png");
        let _ = writeln!(depth, "{stamp} depth/{stamp}.png");
        let _ = writeln!(poses, "{stamp} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
        if i == 0 {
            let k = view.intrinsics;
            let camera = json!({
                "width": k.width,
                "height": k.height,
                "intrinsic_matrix": [k.fx, 0.0, 0.0, 0.0, k.fy, 0.0, k.cx, k.cy, 1.0],
            });
            fs::write(folder.join("camera_intrinsic.json"), camera.to_string()).expect("written");
        }
    }
    for (name, text) in [("rgb.txt", rgb), ("depth.txt", depth), ("groundtruth.txt", poses)] {
        fs::write(folder.join(name), text).expect("written");
    }
}

fn write_png(path: &Path, write: impl FnOnce(fs::File) -> image::ImageResult<()>) {
    write(fs::File::create(path).expect("the folder can be written")).expect("the picture can be written");
}

fn fast(file: fs::File) -> image::codecs::png::PngEncoder<std::io::BufWriter<fs::File>> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    PngEncoder::new_with_quality(std::io::BufWriter::new(file), CompressionType::Fast, FilterType::Adaptive)
}
