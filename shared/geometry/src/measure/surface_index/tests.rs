//! Against brute force in f64, on sound and on broken triangles.

use super::*;
use glam::DVec3;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

/// A crumpled sheet.
fn sheet() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let n = 24_u32;
    let height = |_| rng.random_range(0.0..0.02_f32);
    let heights: Vec<f32> = (0..n * n).map(height).collect();
    let positions = (0..n * n).map(|i| [(i % n) as f32 * 0.01, (i / n) as f32 * 0.01, heights[i as usize]]).collect();
    let quads = (0..(n - 1) * (n - 1)).map(|i| i % (n - 1) + i / (n - 1) * n);
    (positions, quads.flat_map(|i| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]).collect())
}

/// Distance from `p` to a triangle: to its plane where the foot lies inside, or to its sides.
fn distance(p: [f32; 3], t: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = t.map(|v| DVec3::from_array(v.map(f64::from)));
    let p = DVec3::from_array(p.map(f64::from));
    let side = |a: DVec3, b: DVec3| {
        let t = (p - a).dot(b - a) / (b - a).length_squared();
        p.distance(a + (b - a) * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 })
    };
    let n = (b - a).cross(c - a);
    let inside = |a: DVec3, b: DVec3| n.dot((b - a).cross(p - a)) >= 0.0;
    let sides = side(a, b).min(side(b, c)).min(side(c, a));
    let plane = ((p - a).dot(n) / n.length()).abs();
    let solid = n.length() > 1e-12 && inside(a, b) && inside(b, c) && inside(c, a);
    if solid { plane.min(sides) } else { sides }
}

#[test]
fn closest_agrees_with_brute_force() {
    let (positions, triangles) = sheet();
    let index = SurfaceIndex::new(&positions, &triangles);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(2);
    let queries: Vec<[f32; 3]> = (0..400)
        .map(|_| [rng.random_range(-0.03..0.27), rng.random_range(-0.03..0.27), rng.random_range(-0.04..0.06)])
        .collect();
    let all = index.closest_of_all(&queries);
    for (p, batch) in queries.iter().zip(all) {
        let each = triangles.iter().map(|t| distance(*p, t.map(|i| positions[i as usize])));
        let expected = each.fold(f64::INFINITY, f64::min);
        for found in [batch.expect("found"), index.closest(*p).expect("found")] {
            assert!((f64::from(found.distance) - expected).abs() < 1e-7, "{} against {expected}", found.distance);
            assert!(triangles[found.triangle as usize].contains(&found.vertex));
            let there = DVec3::from_array(found.point.map(f64::from));
            assert!((there.distance(DVec3::from_array(p.map(f64::from))) - expected).abs() < 1e-6);
        }
    }
}

#[test]
fn without_a_usable_triangle_nothing_is_near() {
    let nan = [[f32::NAN, 0.0, 0.0], [0.0; 3], [1.0; 3]];
    for index in [SurfaceIndex::new(&[], &[]), SurfaceIndex::new(&nan, &[[0, 1, 2], [1, 2, 7]])] {
        assert!(index.is_empty() && index.closest([0.0; 3]).is_none());
        assert_eq!(index.closest_of_all(&[[0.0; 3]]), [None]);
    }
    let (positions, triangles) = sheet();
    assert!(SurfaceIndex::new(&positions, &triangles).closest([f32::NAN; 3]).is_none());
}

proptest! {
    /// Points, needles and slivers: the distance is that of the sides at least, and never NaN.
    #[test]
    fn thin_triangles_are_measured(
        corners in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-4..5_i8)), 1..12),
        flatten in any::<bool>(),
        query in prop::array::uniform3((-6_000_000..6_000_000_i32).prop_map(|k| k as f32 / 1e6)),
    ) {
        let scale = |p: [i8; 3]| [f32::from(p[0]), f32::from(p[1]), if flatten { 0.0 } else { f32::from(p[2]) * 1e-6 }];
        let positions: Vec<[f32; 3]> = corners.iter().flatten().map(|p| scale(*p)).collect();
        let triangles: Vec<[u32; 3]> = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let index = SurfaceIndex::new(&positions, &triangles);
        let found = index.closest(query).expect("triangles");
        let each = triangles.iter().map(|t| distance(query, t.map(|i| positions[i as usize])));
        let expected = each.fold(f64::INFINITY, f64::min);
        prop_assert!((f64::from(found.distance) - expected).abs() < 1e-4, "{} against {expected}", found.distance);
        prop_assert!(found.point.iter().all(|c| c.is_finite()));
    }
}

#[test]
fn many_triangles_in_one_place_count_once() {
    // The same corners in every order, with vertices of their own, and one triangle elsewhere.
    let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.03]];
    let mut positions: Vec<[f32; 3]> = (0..20_000).flat_map(|_| corners).collect();
    let mut triangles: Vec<[u32; 3]> =
        (0..20_000).map(|i| [3 * i + i % 3, 3 * i + (i + 1) % 3, 3 * i + (i + 2) % 3]).collect();
    let last = positions.len() as u32;
    positions.extend([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, 0.1, 1.0]]);
    triangles.push([last, last + 1, last + 2]);
    let index = SurfaceIndex::new(&positions, &triangles);
    assert_eq!(index.ids.len(), 2);
    let near = |p| index.closest(p).map(|n| (n.triangle, n.distance)).expect("a surface");
    assert_eq!(near([0.0, 0.0, -0.5]), (0, 0.5));
    assert_eq!(near([0.0, 0.0, 1.25]), (20_000, 0.25));
}

#[test]
fn many_triangles_in_almost_one_place_count_a_few_times_and_leave_others_alone() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    // Oblique, so that its box is far larger than it is; at 0.1 m a micrometre is 1e-5 of its size.
    let triangle = [[0.0, 0.0, 0.0], [0.1, 0.02, 0.05], [0.03, 0.1, 0.08_f32]];
    for (count, jitter) in [(128_000, 1e-7_f32), (128_000, 0.0), (20_000, 3e-7)] {
        let mut positions: Vec<[f32; 3]> = Vec::new();
        for _ in 0..count {
            for corner in triangle {
                positions.push(corner.map(|c| c + if jitter > 0.0 { rng.random_range(-jitter..jitter) } else { 0.0 }));
            }
        }
        // A fine sheet beside it, of triangles that are smaller than the other one's grid allows for.
        let (fine, of_fine) = sheet();
        let scale = 1e-3;
        let stacked = positions.len() as u32;
        positions.extend(fine.iter().map(|p| [p[0] * scale + 0.3, p[1] * scale, p[2] * scale]));
        let triangles: Vec<[u32; 3]> = (0..stacked / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .chain(of_fine.iter().map(|t| t.map(|i| i + stacked)))
            .collect();
        let index = SurfaceIndex::new(&positions, &triangles);
        let of_stack = index.ids.iter().filter(|(t, _)| t[0] < stacked).count();
        assert_eq!(index.ids.len() - of_stack, of_fine.len(), "the sheet is as it was");
        // Each of nine coordinates may lie at the edge of two cells.
        assert!(of_stack <= 512, "{of_stack} of {count} triangles with {jitter} m between them are kept");
        eprintln!("{count} triangles within {jitter} m: {of_stack} are kept");
        for _ in 0..20 {
            let p: [f32; 3] = std::array::from_fn(|_| rng.random_range(-0.05..0.35));
            let each = triangles.iter().map(|t| distance(p, t.map(|i| positions[i as usize])));
            let expected = each.fold(f64::INFINITY, f64::min);
            let found = f64::from(index.closest(p).expect("found").distance);
            assert!((found - expected).abs() < 2e-6, "{found} against {expected}");
        }
    }
}
