//! The mesher at work, to be timed from outside: built for wasm32 and run by `benches/mesh_wasm.mjs`.
//!
//! The first call of `main` makes a rippled ring of half a million voxels; every further call meshes it from scratch.

use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use std::cell::RefCell;
use std::collections::BTreeMap;

const VOXEL: f32 = 0.0005;
/// Radii of the ring, metres.
const MAJOR: f32 = 0.1;
const MINOR: f32 = 0.027;
/// Points that the benchmark promises to be meshed, at least.
const POINTS: usize = 500_000;

thread_local! {
    static CLOUD: RefCell<SemanticCloud> = RefCell::default();
}

fn main() {
    CLOUD.with_borrow_mut(|cloud| {
        if cloud.is_empty() {
            *cloud = ring();
            assert!(cloud.len() > POINTS, "{} points", cloud.len());
            return;
        }
        let mesh = mesh_cloud(cloud, VOXEL, &MeshOptions::default(), &()).expect("usual settings");
        assert!(mesh.triangles.len() > POINTS);
        assert!(mesh.boundary.iter().all(|b| !b), "the ring is closed");
    });
}

/// One point a voxel, with noise and six labels.
fn ring() -> SemanticCloud {
    let steps = |length: f32| (length / VOXEL * 3.0) as u32;
    let tau = std::f32::consts::TAU;
    let (around, across) = (steps(tau * (MAJOR + MINOR)), steps(tau * MINOR));
    let mut voxels: BTreeMap<[i32; 3], SemanticPoint> = BTreeMap::new();
    for i in 0..around * across {
        let u = (i / across) as f32 / around as f32 * tau;
        let v = (i % across) as f32 / across as f32 * tau;
        let noise = (i.wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0 - 0.5;
        let minor = MINOR + 0.0008 * (12.0 * u).sin() + 0.1 * VOXEL * noise;
        let normal = [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()];
        let middle = [MAJOR * u.cos(), MAJOR * u.sin(), 0.0];
        let position: [f32; 3] = std::array::from_fn(|a| middle[a] + minor * normal[a]);
        let shade = (120.0 + 40.0 * noise) as u8;
        let point = SemanticPoint {
            position,
            normal,
            color: [shade; 3],
            label: (u / tau * 6.0) as u16,
            confidence: 0.9,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.1,
            defect_sigma: 0.0,
            instance: 0,
            views: 4,
            flags: PointFlags(0),
        };
        voxels.entry(position.map(|c| (c / VOXEL).floor() as i32)).or_insert(point);
    }
    voxels.into_values().collect()
}
