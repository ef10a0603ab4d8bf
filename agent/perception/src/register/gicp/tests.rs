//! Known motions, and clouds that cannot be aligned.

use super::*;
use crate::register::{CloudError, Facing};
use nalgebra::Point3;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Points on an L of two boxes, 10 cm long, `noise` metres off it.
pub(in crate::register) fn bracket(n: usize, noise: f64, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let (u, v) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
            let p = match rng.random_range(0..5) {
                0 => [0.1 * u, 0.05 * v, 0.0],
                1 => [0.0, 0.05 * v, 0.07 * u],
                2 => [0.1 * u, 0.0, 0.02 * v],
                3 => [0.03 * u, 0.05 * v, 0.07],
                _ => [0.03, 0.05 * v, 0.02 + 0.05 * u],
            };
            p.map(|c: f64| (c + noise * rng.random_range(-1.0..1.0)) as f32)
        })
        .collect()
}

fn moved(points: &[[f32; 3]], by: &Isometry3<f64>) -> Vec<[f32; 3]> {
    let place = |p: &[f32; 3]| {
        let q = by * Point3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        [q.x as f32, q.y as f32, q.z as f32]
    };
    points.iter().map(place).collect()
}

fn surfels(points: &[[f32; 3]]) -> SurfelCloud {
    SurfelCloud::new(points, Facing::Unknown, 0.002, 12).expect("a cloud")
}

fn error(found: &Isometry3<f64>, truth: &Isometry3<f64>, cloud: &SurfelCloud) -> f64 {
    (found * cloud.centroid - truth * cloud.centroid).norm() + found.rotation.angle_to(&truth.rotation) * cloud.radius
}

#[test]
fn a_motion_is_found_to_a_fraction_of_the_noise_although_half_is_missing() {
    let target = surfels(&bracket(40_000, 2e-4, 1));
    let truth = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.4, -1.1, 0.2));
    // What lies past the middle is not in the source, and a wall that is not in the target is.
    let mut part: Vec<_> = bracket(40_000, 2e-4, 2).into_iter().filter(|p| p[0] < 0.05).collect();
    part.extend((0..4000).map(|i| [0.06, (i % 64) as f32 * 1e-3, (i / 64) as f32 * 1e-3]));
    let source = surfels(&moved(&part, &truth.inverse()));
    let guess = Isometry3::new(Vector3::new(0.003, -0.002, 0.002), Vector3::new(0.03, 0.02, -0.04)) * truth;
    let fit = align(&source, &target, &guess, &GicpConfig::within(0.01)).expect("aligned");
    assert!(fit.converged, "{fit:?}");
    let off = error(&fit.target_from_source, &truth, &source);
    assert!(off < 2e-4 && off < 0.05 * error(&guess, &truth, &source), "{off:.2e} m");
    assert!(fit.rmse < 3e-4 && fit.overlap > 0.5, "{fit:?}");
    // The stated uncertainty is of the order of what the noise leaves.
    let sigma = fit.covariance.diagonal().map(f64::sqrt);
    assert!(sigma.iter().all(|s| (1e-7..1e-2).contains(s)), "{sigma}");
}

#[test]
fn one_and_many_threads_find_the_same_pose() {
    let (target, source) = (bracket(20_000, 2e-4, 1), bracket(20_000, 2e-4, 2));
    let guess = Isometry3::new(Vector3::new(0.002, 0.001, 0.0), Vector3::new(0.01, 0.02, -0.01));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| align(&surfels(&source), &surfels(&target), &guess, &GicpConfig::within(0.01)))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_cannot_be_aligned_is_named() {
    let cloud = surfels(&bracket(5000, 0.0, 1));
    let far = Isometry3::translation(3.0, 0.0, 0.0);
    let config = GicpConfig::within(0.01);
    assert!(matches!(align(&cloud, &cloud, &far, &config), Err(GicpError::TooFewPairs { pairs: 0, .. })));
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert_eq!(align(&cloud, &cloud, &nowhere, &config), Err(GicpError::Guess));
}

fn make(points: &[[f32; 3]]) -> Result<SurfelCloud, CloudError> {
    SurfelCloud::new(points, Facing::Unknown, 0.001, 10)
}

#[test]
fn clouds_without_a_surface_are_refused() {
    assert_eq!(make(&[]).err(), Some(CloudError::Empty));
    assert_eq!(make(&[[f32::NAN; 3]; 40]).err(), Some(CloudError::NoneFinite(40)));
    assert!(matches!(make(&[[0.5; 3]]).err(), Some(CloudError::TooFew { points: 1, .. })));
    assert!(matches!(make(&[[0.5; 3]; 900]).err(), Some(CloudError::TooFew { points: 1, .. })));
    let line: Vec<[f32; 3]> = (0..500).map(|i| [i as f32 * 0.01, i as f32 * 0.02, 0.3]).collect();
    assert_eq!(make(&line).err(), Some(CloudError::Collinear));
    for voxel in [0.0, -1.0, f64::NAN, 1e-12] {
        let cloud = SurfelCloud::new(&line, Facing::Unknown, voxel, 10);
        assert!(matches!(cloud.err(), Some(CloudError::Voxel { .. })), "{voxel}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_cloud_panics(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![
            4 => (-20_000..20_000_i32).prop_map(|k| k as f32 / 1e6), 1 => Just(f32::NAN), 1 => Just(0.0),
            1 => Just(1e30_f32), 1 => Just(f32::NEG_INFINITY)
        ]), 0..300),
        flat in any::<bool>(),
        shift in (-10_000..10_000_i32).prop_map(|k| f64::from(k) / 1e6),
    ) {
        let points: Vec<_> = points.into_iter().map(|p| if flat { [p[0], p[1], 0.0] } else { p }).collect();
        if let Ok(cloud) = make(&points) {
            let guess = Isometry3::translation(shift, 0.0, -shift);
            if let Ok(fit) = align(&cloud, &cloud, &guess, &GicpConfig::within(0.005)) {
                prop_assert!(fit.target_from_source.to_homogeneous().iter().all(|v| v.is_finite()));
                prop_assert!(fit.covariance.iter().all(|v| v.is_finite()));
            }
        }
    }
}
