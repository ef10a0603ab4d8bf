//! Thinning and normals of known surfaces.

use super::*;

/// A sphere of radius 0.1 about (1, 2, 3).
fn sphere() -> Vec<[f32; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..60_000)
        .map(|i| {
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 60_000.0;
            let (r, a) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
            [1.0 + 0.1 * r * a.cos(), 2.0 + 0.1 * r * a.sin(), 3.0 + 0.1 * z].map(|c| c as f32)
        })
        .collect()
}

#[test]
fn one_point_a_voxel_with_the_normal_of_the_surface() {
    let points = sphere();
    let outwards: Vec<[f32; 3]> = points.iter().map(|p| [p[0] - 1.0, p[1] - 2.0, p[2] - 3.0]).collect();
    let centre = Point3::new(1.0, 2.0, 3.0);
    for (facing, sign) in [(Facing::Normals(&outwards), 1.0), (Facing::From(centre), -1.0)] {
        let cloud = SurfelCloud::new(&points, facing, 0.004, 12).expect("a sphere");
        // About a crossing of the surface a voxel: 3/2 of area / edge^2.
        let expected = 1.5 * 4.0 * std::f64::consts::PI * 0.01 / 1.6e-5;
        let n = cloud.points.len() as f64;
        assert!((0.7..1.4).contains(&(n / expected)), "{n} points for {expected}");
        assert!((cloud.centroid - centre).norm() < 1e-3 && (cloud.radius - 0.1).abs() < 1e-3);
        for (p, n) in cloud.points.iter().zip(&cloud.normals) {
            let radial = (Point3::from(vector(*p)) - centre).normalize();
            assert!(sign * radial.dot(&vector(*n)) > 0.99, "{p:?}: {n:?}");
        }
    }
    let unsigned = SurfelCloud::new(&points, Facing::Unknown, 0.004, 12).expect("a sphere");
    assert!(!unsigned.oriented);
}

#[test]
fn the_least_direction_is_that_of_the_eigenvalues() {
    let mut seed = 1_u32;
    let mut draw = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1 << 24) - 0.5
    };
    for scale in [1.0, 1e-9] {
        for _ in 0..500 {
            let a = Matrix3::from_fn(|_, _| draw());
            let m = a * a.transpose() * scale;
            let eigen = m.symmetric_eigen();
            let least = eigen.eigenvalues.imin();
            let found = least_direction(&m).expect("a plane");
            let rest = (m * found - eigen.eigenvalues[least] * found).norm();
            assert!(rest < 1e-7 * eigen.eigenvalues.amax(), "{m}: {rest:.1e}");
        }
    }
    // A line, a point, a ball, nonsense.
    for m in [
        Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 0.0)),
        Matrix3::zeros(),
        Matrix3::identity(),
        Matrix3::from_element(f64::NAN),
    ] {
        assert!(least_direction(&m).is_none(), "{m}");
    }
}
