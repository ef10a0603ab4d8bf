//! Memory and time of whole inspections: 5, 12 and 48 views of 2.3 M points with six class probabilities are fused, marked,
//! and made anew under other poses.
//!
//! `cargo bench -p semascan-perception --bench kept_views [-- VIEWS ...]`. Two synthetic views are taken over and over from
//! places where the surface looks the same, so that the model grows as it does in an inspection and the benchmark need
//! not render. Peak memory is that of the process (VmHWM); the two views are dropped before the model is made anew, as in
//! an inspection, where by then all views have come. A table goes to stderr, one JSON object
//! to stdout.
#![allow(clippy::print_stdout)]

#[path = "../../../shared/geometry/benches/metrics/cpu.rs"]
#[allow(dead_code)]
mod cpu;
#[path = "integrate/synthetic.rs"]
#[allow(dead_code)]
mod synthetic;

use nalgebra::{Isometry3, Translation3, Vector3};
use semascan_perception::fuse::{LabelledView, MapConfig, OutlierFilter, SemanticMap};
use serde_json::{Value, json};
use synthetic::{Labels, PERIOD, SyntheticScene};

/// Peak memory that the project promises for 48 views, MB.
const PROMISED_MB: f64 = 2000.0;

fn main() {
    let named: Vec<u32> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let counts = if named.is_empty() { vec![5, 12, 48] } else { named };
    let scene = SyntheticScene::new(7, 1920, 1200);
    let runs: Vec<Value> = counts.into_iter().map(|views| inspection(views, &scene)).collect();
    println!("{}", json!({ "threads": rayon::current_num_threads(), "promised_mb": PROMISED_MB, "inspections": runs }));
}

/// Where view `index` is taken from: eight places over the surface, in turns.
fn place(index: u32, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let step = index / 2 % 8;
    let shift = Vector3::new(PERIOD * f64::from(step % 4), PERIOD * f64::from(step / 4), 0.0);
    Translation3::from(shift) * pose
}

fn inspection(views: u32, scene: &SyntheticScene) -> Value {
    let mut originals: [LabelledView; 2] = [0, 1].map(|i| scene.view(i, Labels::Soft));
    let poses = originals.each_ref().map(|v| v.table_from_camera);
    let mut map = SemanticMap::new(MapConfig::new(0.5e-3, 6, 4)).expect("valid settings");
    let filter = OutlierFilter::default();
    let mut fuse = Timer::default();
    let mut used = Vec::new();
    for index in 0..views {
        let which = index as usize % 2;
        let view = &mut originals[which];
        view.index = index;
        view.table_from_camera = place(index, &poses[which]);
        used.push(view.table_from_camera);
        fuse.time(|| map.integrate(view).expect("integrates"));
    }
    let (mut mark, mut rebuild) = (Timer::default(), Timer::default());
    mark.time(|| map.mark_outliers(&filter));
    let voxels = map.len();
    // When poses are refined all views have come.
    drop(originals);
    // What a refinement would do: a tenth of a voxel, and a little rotation.
    let refined: Vec<_> = used
        .iter()
        .enumerate()
        .map(|(i, pose)| pose * Isometry3::new(Vector3::new(4e-5, -3e-5, 2e-5) * (i as f64).sin(), Vector3::z() * 1e-5))
        .collect();
    rebuild.time(|| {
        map.rebuild(&refined).expect("rebuilds");
        map.mark_outliers(&filter);
    });
    let peak = peak_mb();
    let kept = map.kept_views();
    let (memory, disk) = (kept.bytes_in_memory() as f64 / 1e6, kept.bytes_on_disk() as f64 / 1e6);
    eprintln!(
        "{views} views: fuse {:.1} s CPU {:.1} s wall, mark {:.1} s, rebuild {:.1} s CPU {:.1} s wall; {:.2} M voxels; \
         kept {memory:.0} MB in memory, {disk:.0} MB on disk; peak {}",
        fuse.cpu,
        fuse.wall,
        mark.cpu,
        rebuild.cpu,
        rebuild.wall,
        voxels as f64 / 1e6,
        peak.map_or("unknown".into(), |p| format!("{p:.0} MB")),
    );
    json!({
        "views": views, "voxels": voxels, "peak_mb": peak, "kept_in_memory_mb": memory, "kept_on_disk_mb": disk,
        "fuse_cpu_s": fuse.cpu, "fuse_wall_s": fuse.wall, "mark_cpu_s": mark.cpu, "mark_wall_s": mark.wall,
        "rebuild_cpu_s": rebuild.cpu, "rebuild_wall_s": rebuild.wall,
        "fuse_cpu_s_a_view": fuse.cpu / f64::from(views), "rebuild_cpu_s_a_view": rebuild.cpu / f64::from(views),
    })
}

/// Seconds of all threads together, and on the wall.
#[derive(Default)]
struct Timer {
    cpu: f64,
    wall: f64,
}

impl Timer {
    fn time<T>(&mut self, work: impl FnOnce() -> T) {
        let (took, _) = cpu::measure(work);
        self.wall += took.wall_s;
        self.cpu += took.cpu_s;
    }
}

/// Largest resident memory of this process so far; `None` where the system does not report it.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1.024e-3)
}
