//! How true poses and surface of ten motors come out whose robot is off by up to a degree and 3 mm.
//!
//! `cargo bench -p semascan-tests --bench accuracy -- [MOTORS]`. Twelve views each at 1920x1200 with the noise of a
//! metrology camera; poses and surface are judged after one rigid alignment of the estimated to the true camera poses,
//! the surface point to triangle. One JSON object goes to stdout.

use anyhow::{Context, Result};
use semascan_evaluation::judge_inspection;
use semascan_tests::inspect::inspect;
use semascan_tests::sources::open;
use serde_json::json;
use std::io::Write as _;

/// Seeds of motors that nothing was tuned on.
const FIRST_SEED: u64 = 101;

fn main() -> Result<()> {
    let wanted = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let motors: u64 = wanted.unwrap_or(10);
    let mut all = Vec::new();
    let (mut worst_angle, mut worst_distance, mut worst_hd95, mut worst_mean) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut worse_than_kinematics = 0;
    for seed in FIRST_SEED..FIRST_SEED + motors {
        let uri = format!("virtual:starter-motor?seed={seed}&views=12&size=1920x1200&errors=rough&noise=zivid");
        let inspected = inspect(open(&uri)?)?;
        let truth = judge_inspection(&inspected).context("the virtual cell knows the truth")?;
        let aligned = truth.aligned.context("the virtual cell knows the poses")?;
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let angle = median(aligned.poses.iter().map(|p| p.rotation.to_degrees()).collect());
        let distance = median(aligned.poses.iter().map(|p| p.translation * 1e3).collect());
        let (hd95, mean) = (aligned.hd95.context("points")? * 1e3, aligned.mean_error.context("points")? * 1e3);
        let pairs = aligned.poses.iter().zip(&aligned.prior_poses);
        worse_than_kinematics += pairs
            .filter(|(pose, prior)| pose.rotation > prior.rotation || pose.translation > prior.translation)
            .count();
        eprintln!("motor {seed}: median {angle:.4} deg {distance:.4} mm, HD95 {hd95:.3} mm, ME {mean:.3} mm");
        worst_angle = worst_angle.max(angle);
        worst_distance = worst_distance.max(distance);
        worst_hd95 = worst_hd95.max(hd95);
        worst_mean = worst_mean.max(mean);
        all.push(json!({ "seed": seed, "median_deg": angle, "median_mm": distance, "hd95_mm": hd95, "mean_mm": mean }));
    }
    let figures = json!({
        "motors": all,
        "worst_median_deg": worst_angle, "worst_median_mm": worst_distance,
        "worst_hd95_mm": worst_hd95, "worst_mean_mm": worst_mean,
        "views_worse_than_kinematics": worse_than_kinematics,
    });
    writeln!(std::io::stdout(), "{figures}")?;
    Ok(())
}
