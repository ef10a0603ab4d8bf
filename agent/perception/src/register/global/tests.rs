//! Poses from nothing, and the word that there is none.

use super::*;
use crate::register::gicp::tests::bracket;
use nalgebra::{Point3, Vector3};

fn moved(points: &[[f32; 3]], by: &Isometry3<f64>) -> Vec<[f32; 3]> {
    let place = |p: &[f32; 3]| {
        let q = by * Point3::from(vector(*p));
        [q.x as f32, q.y as f32, q.z as f32]
    };
    points.iter().map(place).collect()
}

fn input(points: &[[f32; 3]]) -> CloudInput<'_> {
    CloudInput { points, facing: Facing::Unknown }
}

#[test]
fn any_pose_is_found_by_any_seed() {
    let target = bracket(30_000, 1e-4, 1);
    let source = bracket(30_000, 1e-4, 2);
    for seed in 0..4 {
        let turn = Vector3::new(0.9, -1.3, 0.4) * (1.0 + seed as f64);
        let truth = Isometry3::new(Vector3::new(0.2, -0.1, 0.4), turn);
        let source = moved(&source, &truth.inverse());
        let config = GlobalConfig { seed, ..GlobalConfig::default() };
        let found = register_globally(&input(&source), &input(&target), &config).expect("a match");
        let between = truth.inverse() * found.target_from_source;
        assert!(between.rotation.angle() < 0.01, "seed {seed}: {found:?}");
        assert!(found.overlap > 0.9, "{found:?}");
        // The same seed, the same answer, on any number of threads.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
        let again = pool.install(|| register_globally(&input(&source), &input(&target), &config));
        assert_eq!(again.as_ref(), Ok(&found));
    }
}

#[test]
fn things_that_do_not_match_are_told_apart() {
    let target = bracket(30_000, 1e-4, 1);
    // A ball of the bracket's size.
    let ball: Vec<[f32; 3]> = (0..20_000)
        .map(|i| {
            let (z, a) = (1.0 - 2.0 * (i as f32 + 0.5) / 20_000.0, i as f32 * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            [0.05 * r * a.cos(), 0.05 * r * a.sin(), 0.05 * z]
        })
        .collect();
    let found = register_globally(&input(&ball), &input(&target), &GlobalConfig::default());
    assert!(matches!(found, Err(GlobalError::NoMatch { .. })), "{found:?}");
}

#[test]
fn clouds_that_are_none_are_named() {
    let good = bracket(5000, 0.0, 1);
    let line: Vec<[f32; 3]> = (0..500).map(|i| [i as f32 * 0.01, 0.0, 0.0]).collect();
    for bad in [vec![], vec![[f32::NAN; 3]; 20], vec![[1.0; 3]], vec![[1.0; 3]; 500], line] {
        let as_source = register_globally(&input(&bad), &input(&good), &GlobalConfig::default());
        assert!(matches!(as_source, Err(GlobalError::Source(_))), "{as_source:?}");
        let as_target = register_globally(&input(&good), &input(&bad), &GlobalConfig::default());
        assert!(matches!(as_target, Err(GlobalError::Target(_))), "{as_target:?}");
    }
}
