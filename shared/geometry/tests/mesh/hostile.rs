//! Clouds that are no surfaces: an error or a mesh that is still one, never a panic.

use super::meshed;
use super::shapes::{VOXEL, check_manifold};
use proptest::prelude::*;
use semascan_geometry::mesh::{MeshError, MeshOptions, Mesher, mesh_cloud};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};

fn point(position: [f32; 3], normal: [f32; 3]) -> SemanticPoint {
    SemanticPoint {
        position,
        normal,
        color: [1, 2, 3],
        label: 1,
        confidence: 1.0,
        defect: 0,
        defect_confidence: 1.0,
        sigma: 0.0,
        defect_sigma: 0.0,
        instance: 0,
        views: 1,
        flags: PointFlags::default(),
    }
}

fn cloud(points: impl IntoIterator<Item = SemanticPoint>) -> SemanticCloud {
    points.into_iter().collect()
}

#[test]
fn no_surface_no_mesh() {
    let up = [0.0, 0.0, 1.0];
    assert!(meshed(&SemanticCloud::default()).is_empty());
    assert!(meshed(&cloud((0..500).map(|_| point([f32::NAN; 3], up)))).is_empty());
    assert!(meshed(&cloud((0..500).map(|_| point([f32::INFINITY, 0.0, 0.0], up)))).is_empty());
    assert!(meshed(&cloud([point([1e30, 0.0, 0.0], up)])).is_empty());
    // Without normals nothing says which side is out.
    let flat = (0..400).map(|i| point([(i / 20) as f32 * VOXEL, (i % 20) as f32 * VOXEL, 0.0], [0.0; 3]));
    assert!(meshed(&cloud(flat)).is_empty());
    let bad = (0..400).map(|i| point([(i / 20) as f32 * VOXEL, (i % 20) as f32 * VOXEL, 0.0], [f32::NAN, 1.0, 0.0]));
    assert!(meshed(&cloud(bad)).is_empty());
}

#[test]
fn a_point_and_a_line_stay_small() {
    let one = meshed(&cloud([point([0.01; 3], [0.0, 0.6, 0.8])]));
    check_manifold(&one);
    assert!(one.area() <= f64::from(9.0 * VOXEL * VOXEL), "{}", one.area());
    let line = meshed(&cloud((0..200).map(|i| point([i as f32 * 0.5 * VOXEL, 0.0, 0.0], [0.0, 0.0, 1.0]))));
    check_manifold(&line);
    assert!(line.vertices.positions.iter().all(|p| p[1].abs() < 2.0 * VOXEL));
}

#[test]
fn points_without_a_normal_are_tolerated_among_others() {
    let plane = (0..900).map(|i| {
        let normal = if i % 11 == 0 { [0.0; 3] } else { [0.0, 0.0, 1.0] };
        point([(i / 30) as f32 * VOXEL, (i % 30) as f32 * VOXEL, 0.0003], normal)
    });
    let mesh = meshed(&cloud(plane));
    check_manifold(&mesh);
    assert!(mesh.area() > f64::from(27.0 * 27.0 * VOXEL * VOXEL));
}

#[test]
fn settings_out_of_range_are_refused() {
    let usual = MeshOptions::default;
    assert!(matches!(Mesher::new(0.0, usual()), Err(MeshError::Voxel { .. })));
    assert!(matches!(Mesher::new(f32::NAN, usual()), Err(MeshError::Voxel { .. })));
    for options in [
        MeshOptions { pitch: 0.0, ..usual() },
        MeshOptions { pitch: f32::NAN, ..usual() },
        MeshOptions { radius: 1.0, ..usual() },
        MeshOptions { radius: 40.0, ..usual() },
        MeshOptions { normal_gate: 2.0, ..usual() },
    ] {
        let refused = mesh_cloud(&SemanticCloud::default(), VOXEL, &options, &());
        assert!(matches!(refused, Err(MeshError::Options { .. })), "{options:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Points and normals at random, dense enough for every kind of cell to occur.
    #[test]
    fn noise_gives_a_manifold(
        points in prop::collection::vec(
            (
                prop::array::uniform3((-500_000..500_000_i32).prop_map(|k| k as f32 / 1e6)),
                prop::array::uniform3((-1_000_000..1_000_000_i32).prop_map(|k| k as f32 / 1e6)),
            ),
            0..3000,
        ),
        size in (40_000..360_000_i32).prop_map(|k| k as f32 / 1e4),
        gate in prop::sample::select(vec![-1.0_f32, 0.0, 0.5]),
    ) {
        let points = points.into_iter().map(|(p, n)| point(p.map(|c| c * size * VOXEL), n));
        let options = MeshOptions { normal_gate: gate, ..MeshOptions::default() };
        let mesh = mesh_cloud(&cloud(points), VOXEL, &options, &()).expect("usual settings");
        check_manifold(&mesh);
    }
}
