//! The filters against a walk over all neighbours.

use super::super::brick::Brick;
use super::super::keys::{BrickKey, local_index};
use super::super::{MapConfig, SemanticMap};
use super::*;
use rand::{RngExt, SeedableRng};
use std::collections::HashMap;

/// Voxels strewn at random, thick in one corner, over several blocks on either side of the origin.
fn strewn() -> (SemanticMap, HashMap<[i32; 3], [f32; 3]>) {
    let mut map = SemanticMap::new(MapConfig::new(1.0, 1, 1)).expect("valid settings");
    let mut random = rand_pcg::Pcg32::seed_from_u64(5);
    let mut points = HashMap::new();
    for _ in 0..6000 {
        let reach = if random.random_bool(0.5) { -20..20 } else { 3..12 };
        let voxel: [i32; 3] = std::array::from_fn(|_| random.random_range(reach.clone()));
        let offset: [f32; 3] = std::array::from_fn(|_| random.random());
        if points.insert(voxel, std::array::from_fn(|a| voxel[a] as f32 + offset[a])).is_some() {
            points.insert(voxel, std::array::from_fn(|a| voxel[a] as f32 + 0.5));
        }
    }
    for (voxel, point) in &points {
        let offset = std::array::from_fn(|a| 2.0 * (point[a] - voxel[a] as f32));
        put(&mut map, *voxel, Voxel { weight: 2.0, offset, ..Voxel::default() });
    }
    (map, points)
}

/// Brick of a voxel, and its place in it.
fn address(voxel: [i32; 3]) -> (BrickKey, u16) {
    (BrickKey::containing(voxel), local_index(voxel))
}

fn put(map: &mut SemanticMap, voxel: [i32; 3], content: Voxel) {
    let (key, local) = address(voxel);
    let at = *map.index.entry(key).or_insert_with(|| {
        map.keys.push(key);
        map.bricks.push(Brick::default());
        map.bricks.len() - 1
    });
    *map.bricks[at].entry(local, 2).0 = Voxel { local, ..content };
}

#[test]
fn neighbours_are_those_of_a_walk_over_all_voxels() {
    let (map, points) = strewn();
    for (radius, neighbours) in [(1, 3), (2, 8), (4, 16)] {
        let mut around = Surroundings::new(radius);
        let look = if neighbours <= 8 { look::<8> } else { look::<16> };
        for (key, brick) in map.keys.iter().zip(&map.bricks) {
            around.read(&map, block_of(*key));
            for voxel in &brick.voxels {
                let own = key.voxel(voxel.local);
                let mut near: Vec<f32> = points
                    .iter()
                    .filter(|(v, _)| **v != own && (0..3).all(|a| v[a].abs_diff(own[a]) <= radius as u32))
                    .map(|(_, p)| (0..3).map(|a| (p[a] - points[&own][a]).powi(2)).sum::<f32>().sqrt())
                    .collect();
                let place = around.place(*key, voxel.local).expect("in its block");
                let mut seen = |min_neighbours: usize| {
                    let min_neighbours = min_neighbours as u32;
                    look(
                        &mut around,
                        place,
                        &OutlierFilter { radius, neighbours, min_neighbours, ..OutlierFilter::default() },
                        0.0,
                    )
                };
                let (distance, flags) = seen(near.len());
                assert_eq!([flags, seen(near.len() + 1).1], [0, PointFlags::RADIUS_OUTLIER], "{own:?}");
                near.resize(near.len().max(neighbours) + neighbours, (radius + 1) as f32);
                near.sort_by(f32::total_cmp);
                let mean = near[..neighbours].iter().sum::<f32>() / neighbours as f32;
                assert!((distance - mean).abs() < 1e-3, "{own:?}: {distance} for {mean}");
            }
        }
    }
}

#[test]
fn a_light_voxel_beside_a_heavy_surface_is_noise() {
    let mut map = SemanticMap::new(MapConfig::new(0.5e-3, 1, 1)).expect("valid settings");
    let mut put = |voxel: [i32; 3], height: f32, weight: f32| {
        let offset = [0.5 * weight, 0.5 * weight, height * weight];
        put(&mut map, voxel, Voxel { weight, offset, normal: [0.0, 0.0, weight], ..Voxel::default() });
    };
    for x in 0..20 {
        for y in 0..20 {
            put([x, y, 10], 0.9, 3.0);
        }
    }
    // 0.4 voxels above the surface, which a weight of 0.05 explains and one of 2 does not; and 2.1 above.
    put([4, 4, 11], 0.3, 0.05);
    put([9, 9, 11], 0.3, 2.0);
    put([14, 14, 13], 0.0, 0.05);
    map.mark_outliers(&OutlierFilter::default());
    let noisy = |voxel: [i32; 3]| {
        let (key, local) = address(voxel);
        map.bricks[map.index[&key]].voxel(local).expect("occupied").flags.has(PointFlags::NOISE)
    };
    assert!(noisy([4, 4, 11]) && !noisy([9, 9, 11]) && !noisy([14, 14, 13]) && !noisy([4, 4, 10]));
}

#[test]
fn settings_out_of_range_do_no_harm() {
    let (mut map, _) = strewn();
    let filter = OutlierFilter {
        radius: 90,
        min_neighbours: 1,
        neighbours: 0,
        deviations: f64::NAN,
        ..OutlierFilter::default()
    };
    map.mark_outliers(&filter);
    assert!(map.bricks.iter().flat_map(|b| &b.voxels).all(|v| !v.flags.has(PointFlags::STATISTICAL_OUTLIER)));
}
