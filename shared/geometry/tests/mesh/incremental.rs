//! Meshed in any pieces and order, on any number of threads, the mesh is the same.

use super::meshed;
use super::shapes::{VOXEL, sphere, torus, voxelized};
use proptest::prelude::*;
use semascan_geometry::mesh::{MeshError, MeshOptions, Mesher, mesh_cloud};
use semascan_model::SemanticCloud;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// The cloud by chunk of 32 voxels.
fn chunks(cloud: &SemanticCloud) -> BTreeMap<[i32; 3], SemanticCloud> {
    let mut chunks: BTreeMap<_, SemanticCloud> = BTreeMap::new();
    for p in cloud.iter() {
        let id = p.position.map(|c| (f64::from(c) / (32.0 * f64::from(VOXEL))).floor() as i32);
        chunks.entry(id).or_default().push(p);
    }
    chunks
}

fn model() -> SemanticCloud {
    voxelized(sphere([0.01, 0.02, -0.03], 0.04).chain(torus(0.06, 0.01)), 0.1 * VOXEL, 9)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn chunks_in_any_order_give_the_mesh_of_the_whole(
        order in Just((0..27_usize).collect::<Vec<_>>()).prop_shuffle(),
        every in 1_usize..6,
        pitch in prop::sample::select(vec![1.0_f32, 1.3, 0.75]),
    ) {
        let cloud = model();
        let options = MeshOptions { pitch, radius: 2.0 * pitch, ..MeshOptions::default() };
        let whole = mesh_cloud(&cloud, VOXEL, &options, &()).expect("usual settings");
        let chunks: Vec<_> = chunks(&cloud).into_iter().collect();
        let mut mesher = Mesher::new(VOXEL, options).expect("usual settings");
        for (n, i) in order.iter().chain(&(27..chunks.len()).collect::<Vec<_>>()).enumerate() {
            let Some((id, points)) = chunks.get(*i) else { continue };
            // First half of a chunk's points, in reverse: what comes later replaces it.
            let half: SemanticCloud = points.iter().skip(points.len() / 2).collect();
            mesher.set_chunk(*id, &half);
            if n % every == 0 {
                mesher.update(&()).expect("nobody cancels");
            }
            let mut turned: Vec<_> = points.iter().collect();
            turned.reverse();
            mesher.set_chunk(*id, &turned.into_iter().collect());
        }
        while mesher.step(3) > 0 {}
        prop_assert!(mesher.mesh() == whole);
    }
}

#[test]
fn only_what_a_change_reaches_is_computed_again() {
    let cloud = model();
    let mut mesher = Mesher::new(VOXEL, MeshOptions::default()).expect("usual settings");
    mesher.set_cloud(&cloud);
    let all = mesher.pending();
    mesher.update(&()).expect("nobody cancels");
    assert_eq!(mesher.pending(), 0);
    let chunks = chunks(&cloud);
    let (id, points) = chunks.iter().next().expect("chunks");
    mesher.set_chunk(*id, &SemanticCloud::default());
    assert!(mesher.pending() > 0 && mesher.pending() <= 27 && mesher.pending() < all);
    mesher.update(&()).expect("nobody cancels");
    assert!(mesher.mesh().boundary.iter().any(|b| *b));
    mesher.set_chunk(*id, points);
    mesher.update(&()).expect("nobody cancels");
    assert!(mesher.mesh() == meshed(&cloud));
}

#[test]
fn one_thread_or_many_give_the_same() {
    let cloud = model();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| meshed(&cloud))
    };
    assert!(on(1) == on(4));
}

#[test]
fn progress_is_told_and_can_end_the_work() {
    let cloud = model();
    let mut mesher = Mesher::new(VOXEL, MeshOptions::default()).expect("usual settings");
    mesher.set_cloud(&cloud);
    let all = mesher.pending();
    let stop = |done: usize, total: usize| {
        assert!(done <= total);
        if done >= 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert_eq!(mesher.update(&stop), Err(MeshError::Cancelled));
    assert!(mesher.pending() < all && mesher.pending() > 0);
    mesher.update(&()).expect("nobody cancels now");
    assert!(mesher.mesh() == meshed(&cloud));
}
