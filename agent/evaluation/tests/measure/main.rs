//! Measurements on models of simulated motors against truth: their stated intervals hold it. The full run is `semascan tables
//! measure`, on more motors and larger pictures; the figures here are what so few reach.

use semascan_evaluation::tables::measure::{Config, Kind, run};

#[test]
fn stated_intervals_hold_the_truth_and_distances_are_finer_than_voxels() {
    let config = Config { motors: vec![3001, 3002], views: 8, size: (640, 480) };
    let report = run(&config, &|_, _| {}).expect("motors");
    let summary = &report.summary;
    assert!(summary.measurements >= 40, "{summary:?}");
    assert!(summary.covered as f64 >= 0.85 * summary.measurements as f64, "{report:#?}");
    assert!(summary.distance_error_voxels.is_some_and(|error| error < 0.5), "{summary:?}");
    // Intervals that hold everything say nothing: half of them are less than a voxel and a quarter.
    let lengths: Vec<f64> = report
        .motors
        .iter()
        .flat_map(|m| m.measurements.iter().filter(|one| one.kind != Kind::Angle).map(|one| one.expanded / m.voxel))
        .collect();
    let narrow = lengths.iter().filter(|expanded| **expanded < 1.25).count();
    assert!(2 * narrow > lengths.len(), "{narrow} of {}", lengths.len());
}
