//! Against brute force, on clouds of every awkward kind.

use super::*;
use proptest::prelude::*;

/// Points on a sphere, and every so often one that is nowhere.
fn sphere(n: u32, seed: u64) -> Vec<[f32; 3]> {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..n)
        .map(|i| {
            let p = glam::Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0_f32)));
            if i % 97 == 5 { [f32::NAN, 0.0, 0.0] } else { p.normalize_or(glam::Vec3::X).to_array() }
        })
        .collect()
}

fn brute(points: &[[f32; 3]], p: [f32; 3]) -> Vec<f64> {
    let mut all: Vec<f64> = points.iter().filter(|q| usable(q)).map(|q| exact(p, *q)).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Equal up to the rounding of f32.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.max(1e-30)
}

#[test]
fn agrees_with_brute_force() {
    let (points, queries) = (sphere(3000, 1), sphere(700, 2));
    let index = NearestPoints::new(&points);
    let all = index.nearest_of_all(&queries);
    let distances = index.distances_from(&NearestPoints::new(&queries));
    let mut several = Vec::new();
    for ((q, n), d) in queries.iter().zip(&all).zip(&distances) {
        if !usable(q) {
            assert!(n.is_none() && d.is_nan() && index.nearest(*q).is_none());
            continue;
        }
        let expected = brute(&points, *q);
        let n = n.expect("found");
        assert!(same(n.distance_squared, expected[0]), "{n:?} for {}", expected[0]);
        assert_eq!(n.distance_squared, exact(*q, points[n.index as usize]));
        assert!(same(d * d, expected[0]));
        assert!(same(index.nearest(*q).expect("found").distance_squared, expected[0]));
        index.nearest_k(*q, 7, &mut several);
        assert_eq!(several.len(), 7);
        for (found, expected) in several.iter().zip(&expected) {
            assert!(same(found.distance_squared, *expected));
        }
        let mut within = 0;
        index.within(*q, 0.2, |_| within += 1);
        assert_eq!(within, expected.iter().filter(|d| **d < 0.04).count());
        assert_eq!(index.nearest_within(*q, 0.02).is_some(), expected[0] < 0.0004);
        for mut guess in [Guess::NONE, Guess(17), Guess(u32::MAX - 1), Guess(3000)] {
            let found = index.nearest_from(*q, 0.02, &mut guess);
            assert_eq!(found.is_some(), expected[0] < 0.0004);
            assert!(found.is_none_or(|n| same(n.distance_squared, expected[0])));
        }
    }
}

#[test]
fn neighbourhoods_are_the_nearest_k_of_each_point() {
    let points = sphere(1000, 3);
    let index = NearestPoints::new(&points);
    let rows = index.neighbourhoods(9);
    for (p, row) in points.iter().zip(rows.chunks(9)) {
        if !usable(p) {
            assert!(row.iter().all(|i| *i == u32::MAX));
            continue;
        }
        let expected = brute(&points, *p);
        for (i, expected) in row.iter().zip(expected) {
            assert!(same(exact(*p, points[*i as usize]), expected));
        }
    }
    let few = NearestPoints::new(&[[0.0; 3], [1.0, 0.0, 0.0]]).neighbourhoods(3);
    assert_eq!(few, [0, 1, u32::MAX, 1, 0, u32::MAX]);
}

#[test]
fn nothing_one_and_many_at_one_place() {
    for points in [vec![], vec![[f32::NAN; 3]; 9], vec![[f32::INFINITY, 0.0, 0.0], [1e30, 0.0, 0.0]]] {
        let index = NearestPoints::new(&points);
        assert!(index.is_empty() && index.nearest([0.0; 3]).is_none());
        assert!(index.distances_from(&NearestPoints::new(&[[0.0; 3]]))[0].is_nan());
        let mut found = Vec::new();
        index.nearest_k([0.0; 3], 3, &mut found);
        assert!(found.is_empty());
    }
    let one = NearestPoints::new(&[[1.0, 2.0, 2.0]]);
    assert_eq!(one.nearest([0.0; 3]), Some(Neighbour { index: 0, distance_squared: 9.0 }));
    // A tree that looked at every equal point would take minutes here.
    let many = NearestPoints::new(&vec![[0.5; 3]; 300_000]);
    assert!(many.distances_from(&many).iter().all(|d| *d == 0.0));
    assert!(many.neighbourhoods(10).iter().all(|i| *i < 300_000));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let (points, queries) = (sphere(40_000, 4), sphere(20_000, 5));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let index = NearestPoints::new(&points);
            (index.nearest_of_all(&queries), index.neighbourhoods(5))
        })
    };
    assert!(on(1) == on(4));
}

proptest! {
    #[test]
    fn any_cloud_is_safe(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![
            (-2_000_000..2_000_000_i32).prop_map(|k| k as f32 / 1e6), Just(0.0), Just(f32::NAN),
            Just(f32::INFINITY), Just(1e17), Just(-1e20), Just(1e-40)
        ]), 0..60),
        query in prop::array::uniform3(
            prop_oneof![(-3_000_000..3_000_000_i32).prop_map(|k| k as f32 / 1e6), Just(f32::NAN), Just(1e17)],
        ),
        k in 0..12_usize,
    ) {
        let index = NearestPoints::new(&points);
        let expected = if usable(&query) { brute(&points, query) } else { Vec::new() };
        let mut found = Vec::new();
        index.nearest_k(query, k, &mut found);
        prop_assert_eq!(found.len(), expected.len().min(k));
        for (n, e) in found.iter().zip(&expected) {
            // What underflows in f32 is as good as equal.
            prop_assert!(same(n.distance_squared, *e) || n.distance_squared < 1e-36, "{n:?} for {e}");
        }
        prop_assert_eq!(index.nearest(query).is_some(), !expected.is_empty());
        prop_assert_eq!(index.nearest_of_all(&[query])[0].is_some(), !expected.is_empty());
        prop_assert_eq!(index.neighbourhoods(k).len(), k * points.len());
    }
}
