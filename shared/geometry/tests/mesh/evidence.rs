//! Closed surfaces come out closed and true; open ones stay open; two sides stay two sides.

use super::meshed;
use super::shapes::{VOXEL, check_manifold, cross, dot, sphere, square, sub, torus, voxelized};
use semascan_model::{PointFlags, SemanticMesh};

/// Mean and largest of a signed distance over the vertices, in voxels, and their mean absolute.
fn errors(mesh: &SemanticMesh, distance: impl Fn([f32; 3]) -> f32) -> (f32, f32, f32) {
    let n = mesh.len() as f32;
    let all = || mesh.vertices.positions.iter().map(|p| distance(*p) / VOXEL);
    (all().sum::<f32>() / n, all().map(f32::abs).fold(0.0, f32::max), all().map(f32::abs).sum::<f32>() / n)
}

#[test]
fn a_sphere_is_closed_and_true() {
    for (centre, radius) in [([0.0; 3], 0.010), ([0.0213, -0.0377, 0.0502], 0.0222), ([0.2, 0.2, 0.2], 0.0031)] {
        let mesh = meshed(&voxelized(sphere(centre, radius), 0.0, 1));
        assert_eq!(check_manifold(&mesh), 0);
        assert!(mesh.boundary.iter().all(|b| !b));
        // Euler's formula for a sphere: V - E + F = 2 with E = 3/2 F.
        assert_eq!(mesh.len() as i64 - mesh.triangles.len() as i64 / 2, 2);
        let (bias, worst, mean) = errors(&mesh, |p| dot(sub(p, centre), sub(p, centre)).sqrt() - radius);
        // A voxel's mean lies inside a curved surface, and so does what is interpolated on the grid: a quarter of a voxel
        // over the radius in voxels.
        let curved = 0.3 * VOXEL / radius;
        assert!(
            bias.abs() < curved && mean < curved + 0.005 && worst < 2.0 * curved + 0.01,
            "{radius}: {bias} {mean} {worst} voxels"
        );
        let outwards = mesh.triangles.iter().all(|t| {
            let [a, b, c] = mesh.corners(*t).expect("there");
            dot(cross(sub(b, a), sub(c, a)), sub(a, centre)) > 0.0
        });
        assert!(outwards);
        let area = mesh.area() / (4.0 * std::f64::consts::PI * f64::from(radius).powi(2));
        assert!((area - 1.0).abs() < f64::from(2.0 * curved + 0.01), "{area}");
    }
}

#[test]
fn noise_is_averaged_away() {
    let radius = 0.02;
    let cloud = voxelized(sphere([0.003, 0.0, 0.0], radius), 0.2 * VOXEL, 3);
    let of_points = cloud
        .positions
        .iter()
        .map(|p| (dot(sub(*p, [0.003, 0.0, 0.0]), sub(*p, [0.003, 0.0, 0.0])).sqrt() - radius).abs());
    let of_points = of_points.sum::<f32>() / cloud.len() as f32 / VOXEL;
    let mesh = meshed(&cloud);
    assert_eq!(check_manifold(&mesh), 0);
    let (bias, _, mean) = errors(&mesh, |p| dot(sub(p, [0.003, 0.0, 0.0]), sub(p, [0.003, 0.0, 0.0])).sqrt() - radius);
    assert!(mean < 0.6 * of_points && bias.abs() < 0.02, "{mean} against {of_points}, bias {bias}");
}

#[test]
fn a_torus_is_closed_and_true() {
    let (major, minor) = (0.02, 0.006);
    let mesh = meshed(&voxelized(torus(major, minor), 0.0, 1));
    assert_eq!(check_manifold(&mesh), 0);
    // V - E + F = 0.
    assert_eq!(mesh.len() as i64 - mesh.triangles.len() as i64 / 2, 0);
    let distance = |p: [f32; 3]| (p[0].hypot(p[1]) - major).hypot(p[2]) - minor;
    let (bias, worst, mean) = errors(&mesh, distance);
    assert!(bias.abs() < 0.03 && mean < 0.03 && worst < 0.06, "{bias} {mean} {worst} voxels");
}

#[test]
fn a_sheet_stays_open_and_its_rim_is_marked() {
    let edge = 0.03;
    let mesh = meshed(&voxelized(square(edge, 0.0004, true), 0.0, 1));
    assert!(check_manifold(&mesh) > 80);
    for (p, boundary) in mesh.vertices.positions.iter().zip(&mesh.boundary) {
        let inwards = edge / 2.0 - p[0].abs().max(p[1].abs());
        assert!(inwards > -VOXEL, "nothing lies {} voxels outside", -inwards / VOXEL);
        assert!(*boundary == (inwards < 1.3 * VOXEL) || inwards < 2.0 * VOXEL, "{p:?} {boundary}");
        assert!((p[2] - 0.0004).abs() < 0.02 * VOXEL);
    }
    let area = mesh.area() / f64::from(edge * edge);
    assert!((0.93..1.07).contains(&area), "{area}");
}

#[test]
fn a_thin_sheet_keeps_its_sides() {
    for thickness in [1.5, 2.0, 3.0] {
        let z = 0.5 * thickness * VOXEL;
        let both = square(0.03, z, true).chain(square(0.03, -z, false));
        let mesh = meshed(&voxelized(both, 0.05 * VOXEL, 5));
        check_manifold(&mesh);
        let inner = |p: &[f32; 3]| p[0].abs() < 0.013 && p[1].abs() < 0.013;
        let mut count = 0;
        for (p, n) in mesh.vertices.positions.iter().zip(&mesh.vertices.normals).filter(|(p, _)| inner(p)) {
            assert!((p[2].abs() - z).abs() < 0.25 * VOXEL, "{thickness}: {p:?}");
            assert!(n[2] * p[2] > 0.0);
            count += 1;
        }
        let expected = 2.0 * (0.026 / VOXEL).powi(2);
        assert!(count as f32 > 0.95 * expected, "{thickness}: {count} of {expected}");
    }
}

#[test]
fn parallel_layers_have_nothing_between_them() {
    let layers = square(0.02, 0.0, true).chain(square(0.02, 3.3 * VOXEL, true));
    let mesh = meshed(&voxelized(layers, 0.0, 1));
    check_manifold(&mesh);
    for p in &mesh.vertices.positions {
        assert!(p[2].abs().min((p[2] - 3.3 * VOXEL).abs()) < 0.1 * VOXEL, "{p:?}");
    }
}

#[test]
fn labels_and_colors_follow_the_evidence() {
    let mut cloud = voxelized(sphere([0.0; 3], 0.015), 0.0, 1);
    // One point in eight lies about its class, and is not believed.
    for i in (0..cloud.len()).filter(|i| (*i as u32).wrapping_mul(2_654_435_761) >> 28 < 2) {
        cloud.labels[i] = 3;
        cloud.confidence[i] = 0.4;
    }
    let mesh = meshed(&cloud);
    let mut wrong = 0;
    for v in mesh.vertices.iter() {
        let above = if v.position[2] > 0.0 { 1 } else { 2 };
        if v.position[2].abs() > VOXEL {
            wrong += u32::from(v.label != above);
            assert!(v.confidence > 0.2 && v.confidence <= 1.0);
            if v.label == above {
                assert_eq!(v.instance, above);
            }
        }
        assert!(v.color[0] >= 10 && v.color[0] <= 20 && v.color[1..] == [100, 200]);
    }
    assert!(wrong < mesh.len() as u32 / 500, "{wrong} of {}", mesh.len());
    let border = mesh.vertices.iter().filter(|v| v.position[2].abs() < 0.8 * VOXEL).count();
    assert!(border > 60);
}

#[test]
fn a_crack_keeps_its_area_whatever_its_width_and_direction() {
    for width in [1.0, 1.5, 3.0] {
        for angle in [0.0_f32, 0.3, 0.785] {
            let mut cloud = voxelized(square(0.06, 0.3 * VOXEL, true), 0.0, 1);
            let (sine, cosine) = angle.sin_cos();
            let mut cracked = 0_u32;
            for i in 0..cloud.len() {
                let [x, y, _] = cloud.positions[i];
                // Confidences of defects are rarely those of components.
                cloud.defect_confidence[i] = 0.8;
                if (cosine * y - sine * x).abs() < 0.5 * width * VOXEL && (cosine * x + sine * y).abs() < 0.02 {
                    cloud.defects[i] = 3;
                    cracked += 1;
                }
            }
            let mesh = meshed(&cloud);
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| mesh.vertices.positions[v as usize]);
                let across = cross(sub(b, a), sub(c, a));
                let share = t.iter().filter(|v| mesh.vertices.defects[**v as usize] == 3).count();
                0.5 * dot(across, across).sqrt() * share as f32 / 3.0
            };
            // In voxels: each point stands for one.
            let said: f32 = mesh.triangles.iter().map(area).sum::<f32>() / (VOXEL * VOXEL);
            let error = said / cracked as f32 - 1.0;
            assert!(
                error.abs() < 0.15,
                "{width} voxels at {angle}: {said} for {cracked} points, {:+.0} %",
                100.0 * error
            );
            let sure = mesh.vertices.defect_confidence.iter().copied().fold(0.0, f32::max);
            assert!((sure - 0.8).abs() < 1e-3, "{sure}");
        }
    }
}

#[test]
fn marked_points_are_left_out() {
    let mut cloud = voxelized(sphere([0.0; 3], 0.01).chain(sphere([0.04, 0.0, 0.0], 0.01)), 0.0, 1);
    for i in 0..cloud.len() {
        if cloud.positions[i][0] > 0.02 {
            cloud.flags[i] = PointFlags(PointFlags::BACKGROUND);
        }
    }
    let mesh = meshed(&cloud);
    assert!(mesh.vertices.positions.iter().all(|p| p[0] < 0.012));
    assert_eq!(check_manifold(&mesh), 0);
}
