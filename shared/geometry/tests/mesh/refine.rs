//! Smoothing, filling, decimation and point simplification: what they must change and what they must not.

use super::meshed;
use super::shapes::{VOXEL, check_manifold, dot, sphere, square, sub, voxelized};
use semascan_geometry::mesh::{MeshError, decimate, fill_holes, simplify_points, smooth};
use semascan_model::{SemanticCloud, SemanticMesh};
use std::ops::ControlFlow;

fn radial_error(positions: &[[f32; 3]], radius: f32) -> f32 {
    let off = |p: &[f32; 3]| (dot(*p, *p).sqrt() - radius).abs() / VOXEL;
    positions.iter().map(off).sum::<f32>() / positions.len() as f32
}

/// Vertices whose neighbours carry another label: how far they are from z = 0, in voxels, at most and in the mean.
fn border(mesh: &SemanticMesh) -> (f32, f32) {
    let mixed = mesh
        .triangles
        .iter()
        .filter(|t| t.iter().any(|&v| mesh.vertices.labels[v as usize] != mesh.vertices.labels[t[0] as usize]));
    let heights: Vec<f32> = mixed.flatten().map(|&v| mesh.vertices.positions[v as usize][2] / VOXEL).collect();
    (heights.iter().map(|h| h.abs()).fold(0.0, f32::max), heights.iter().sum::<f32>() / heights.len() as f32)
}

#[test]
fn smoothing_takes_noise_and_keeps_size_border_and_rim() {
    let radius = 0.02;
    let mut mesh = meshed(&voxelized(sphere([0.0; 3], radius), 0.0, 4));
    // The mesher leaves little noise: rough it up.
    for (i, p) in mesh.vertices.positions.iter_mut().enumerate() {
        let noise = ((i as u32).wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0 - 0.5;
        *p = p.map(|c| c * (1.0 + 0.4 * noise * VOXEL / radius));
    }
    let mut smoothed = mesh.clone();
    smooth(&mut smoothed, 5);
    let (before, after) =
        (radial_error(&mesh.vertices.positions, radius), radial_error(&smoothed.vertices.positions, radius));
    assert!(after < 0.6 * before, "{before} -> {after}");
    let mean = |m: &SemanticMesh| m.vertices.positions.iter().map(|p| dot(*p, *p).sqrt()).sum::<f32>() / m.len() as f32;
    let grown = (mean(&smoothed) - mean(&mesh)) / VOXEL;
    assert!(grown.abs() < 0.02, "{grown}");
    assert!((border(&smoothed).1 - border(&mesh).1).abs() < 0.02);
    assert_eq!(check_manifold(&smoothed), 0);

    let sheet = meshed(&voxelized(square(0.02, 0.0, true), 0.1 * VOXEL, 4));
    let mut smoothed = sheet.clone();
    smooth(&mut smoothed, 5);
    let rim = (0..sheet.len()).filter(|&v| sheet.boundary[v]);
    assert!(rim.clone().count() > 50);
    rim.for_each(|v| assert_eq!(sheet.vertices.positions[v], smoothed.vertices.positions[v]));
}

#[test]
fn holes_are_filled_only_when_asked_and_only_small_ones() {
    let hole = |p: &[f32; 3], n: [f32; 3], r: f32| {
        dot(sub(*p, n.map(|c| c * 0.015)), sub(*p, n.map(|c| c * 0.015))).sqrt() < r
    };
    let cloud = voxelized(sphere([0.0; 3], 0.015), 0.0, 1);
    let cloud: SemanticCloud = cloud
        .iter()
        .filter(|p| !hole(&p.position, [0.0, 0.0, 1.0], 0.003) && !hole(&p.position, [1.0, 0.0, 0.0], 0.007))
        .collect();
    let mesh = meshed(&cloud);
    let open = check_manifold(&mesh);
    assert!(open > 40);
    let mut filled = mesh.clone();
    assert_eq!(fill_holes(&mut filled, 0.035), 1);
    let left = check_manifold(&filled);
    assert!(left < open && left > 20);
    let new = filled.len() - 1;
    assert_eq!(filled.len(), mesh.len() + 1);
    assert!(filled.boundary[new] && filled.vertices.confidence[new] == 0.0);
    assert!(filled.vertices.positions[new][2] > 0.013);
    assert_eq!(fill_holes(&mut filled, 1.0), 1);
    assert_eq!(check_manifold(&filled), 0);
}

#[test]
fn decimation_keeps_shape_border_and_topology() {
    let radius = 0.02;
    let mesh = meshed(&voxelized(sphere([0.0; 3], radius), 0.0, 1));
    let target = mesh.triangles.len() / 5;
    let small = decimate(&mesh, target, &()).expect("nobody cancels");
    assert!(small.triangles.len() <= target);
    assert_eq!(check_manifold(&small), 0);
    assert_eq!(small.len() as i64 - small.triangles.len() as i64 / 2, 2);
    assert!(radial_error(&small.vertices.positions, radius) < 0.08);
    let ((worst, mean), (worst_before, mean_before)) = (border(&small), border(&mesh));
    assert!(worst < worst_before + 1.0 && (mean - mean_before).abs() < 0.3, "{worst} {mean}");
    assert!(small.vertices.labels.contains(&1) && small.vertices.labels.contains(&2));
    // The same again, bit by bit.
    assert!(decimate(&mesh, target, &()).expect("nobody cancels") == small);
}

#[test]
fn decimation_keeps_the_rim() {
    let mesh = meshed(&voxelized(square(0.03, 0.0, true), 0.0, 1));
    let small = decimate(&mesh, 60, &()).expect("nobody cancels");
    check_manifold(&small);
    assert!(small.triangles.len() < mesh.triangles.len() / 8, "{}", small.triangles.len());
    assert!((small.area() / mesh.area() - 1.0).abs() < 0.01, "{}", small.area() / mesh.area());
    // A plane stays one, and the two components keep their halves.
    assert!(small.vertices.positions.iter().all(|p| p[2].abs() < 0.02 * VOXEL));
    let half = small.select(|t| small.triangle_label(t) == 1);
    assert!((half.area() / small.area() - 0.5).abs() < 0.03, "{}", half.area() / small.area());
}

#[test]
fn simplified_points_stay_on_the_surface() {
    let radius = 0.02;
    let cloud = voxelized(sphere([0.0; 3], radius), 0.0, 1);
    let target = cloud.len() / 6;
    let small = simplify_points(&cloud, VOXEL, target, &()).expect("nobody cancels");
    assert_eq!(small.len(), target);
    let error = radial_error(&small.positions, radius);
    assert!(error < 0.12, "{error}");
    for p in small.iter() {
        assert!((dot(p.normal, p.normal) - 1.0).abs() < 1e-3);
        if p.position[2].abs() > 2.0 * VOXEL {
            assert_eq!(p.label, if p.position[2] > 0.0 { 1 } else { 2 });
        }
    }
    // Nothing is left bare: every point of the cloud has one of the simplified near by.
    let bare = cloud
        .positions
        .iter()
        .filter(|p| small.positions.iter().all(|q| dot(sub(**p, *q), sub(**p, *q)) > (6.0 * VOXEL).powi(2)));
    assert_eq!(bare.count(), 0);
}

#[test]
fn curved_places_keep_more_points_than_flat_ones() {
    // A plane with a ball on it.
    let ball = sphere([0.0, 0.0, 0.003], 0.003).filter(|(p, _, _)| p[2] > 0.0005);
    let cloud =
        voxelized(square(0.04, 0.0, true).map(|(p, n, _)| (p, n, 1)).chain(ball.map(|(p, n, _)| (p, n, 1))), 0.0, 1);
    let small = simplify_points(&cloud, VOXEL, cloud.len() / 8, &()).expect("nobody cancels");
    let share = |c: &SemanticCloud| c.positions.iter().filter(|p| p[2] > 0.001).count() as f32 / c.len() as f32;
    assert!(share(&small) > 2.5 * share(&cloud), "{} from {}", share(&small), share(&cloud));
}

#[test]
fn both_simplifications_stop_when_told_to() {
    let cloud = voxelized(sphere([0.0; 3], 0.02), 0.0, 1);
    let stop = |_: usize, _: usize| ControlFlow::Break(());
    assert_eq!(simplify_points(&cloud, VOXEL, 10, &stop), Err(MeshError::Cancelled));
    assert_eq!(decimate(&meshed(&cloud), 10, &stop).err(), Some(MeshError::Cancelled));
    assert_eq!(simplify_points(&SemanticCloud::default(), VOXEL, 10, &()), Ok(SemanticCloud::default()));
    assert!(decimate(&SemanticMesh::default(), 10, &()).expect("nothing to do").is_empty());
}
