use super::super::brick::Brick;
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
        let key = BrickKey(voxel.map(|c| c.div_euclid(BRICK_EDGE)));
        let at = *map.index.entry(key).or_insert_with(|| {
            map.keys.push(key);
            map.bricks.push(Brick::default());
            map.bricks.len() - 1
        });
        let local = voxel.iter().fold(0, |local, c| local << 3 | c.rem_euclid(BRICK_EDGE) as u16);
        let (made, _, _) = map.bricks[at].entry(local, 2);
        let offset = std::array::from_fn(|a| 2.0 * (point[a] - voxel[a] as f32));
        *made = Voxel { weight: 2.0, offset, local, ..Voxel::default() };
    }
    (map, points)
}

#[test]
fn the_survey_is_that_of_a_walk_over_all_neighbours() {
    let (map, points) = strewn();
    for (radius, neighbours) in [(1, 3), (2, 8), (4, 16)] {
        let filter = OutlierFilter { radius, neighbours, ..OutlierFilter::default() };
        let surveyed = map.survey(&filter);
        for ((key, brick), surveys) in map.keys.iter().zip(&map.bricks).zip(&surveyed) {
            for (voxel, survey) in brick.voxels.iter().zip(surveys.iter().flatten()) {
                let own = key.voxel(voxel.local.into());
                let mut near: Vec<f32> = points
                    .iter()
                    .filter(|(v, _)| **v != own && (0..3).all(|a| v[a].abs_diff(own[a]) <= radius as u32))
                    .map(|(_, p)| (0..3).map(|a| (p[a] - points[&own][a]).powi(2)).sum::<f32>().sqrt())
                    .collect();
                assert_eq!(survey.neighbours as usize, near.len());
                near.resize(near.len().max(neighbours) + neighbours, (radius + 1) as f32);
                near.sort_by(f32::total_cmp);
                let mean = near[..neighbours].iter().sum::<f32>() / neighbours as f32;
                assert!((survey.distance - mean).abs() < 1e-3, "{own:?}: {} for {mean}", survey.distance);
            }
        }
    }
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
