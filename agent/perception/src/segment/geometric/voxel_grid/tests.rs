//! Voxels and neighbours against a search through all points.

use super::*;
use proptest::prelude::*;

fn points(positions: Vec<[f32; 3]>) -> ColoredPoints {
    ColoredPoints { colors: vec![[10, 20, 30]; positions.len()], positions }
}

proptest! {
    #[test]
    fn voxels_and_neighbours_agree_with_brute_force(
        positions in prop::collection::vec(
            prop::array::uniform3((-50_000..50_000_i32).prop_map(|k| k as f32 / 1e6)),
            1..200,
        ),
    ) {
        let size = 0.01;
        let cloud = points(positions);
        let grid = VoxelGrid::new(&cloud, size);
        let centre = centre(&cloud.positions, size).expect("finite");
        let cell = |p: &[f32; 3]| [0, 1, 2].map(|a| ((f64::from(p[a]) - centre[a]) / f64::from(size)).floor() as i64);
        for (i, p) in cloud.positions.iter().enumerate() {
            for (j, q) in cloud.positions.iter().enumerate() {
                let (a, b) = (grid.of_point[i], grid.of_point[j]);
                let apart = (0..3).map(|k| (cell(p)[k] - cell(q)[k]).abs()).max().expect("three axes");
                prop_assert_eq!(a == b, apart == 0);
                prop_assert_eq!(grid.neighbours(a).contains(&b), apart == 1);
            }
        }
        prop_assert_eq!(grid.counts.iter().sum::<u32>() as usize, cloud.len());
    }

    #[test]
    fn any_bits_are_accepted(
        bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..60),
        size in any::<u32>(),
    ) {
        let cloud = points(bits.iter().map(|p| p.map(f32::from_bits)).collect());
        let grid = VoxelGrid::new(&cloud, f32::from_bits(size));
        let placed = grid.of_point.iter().filter(|&&v| v != NONE).count();
        prop_assert_eq!(grid.counts.iter().sum::<u32>() as usize, placed);
        prop_assert!(grid.of_point.iter().all(|&v| v == NONE || (v as usize) < grid.len()));
    }

    #[test]
    fn the_radix_sort_sorts(keys in prop::collection::vec(any::<u64>(), 0..300)) {
        let mut items: Vec<(u64, u32)> = keys.iter().enumerate().map(|(i, &k)| (k >> (k % 50), i as u32)).collect();
        let mut expected = items.clone();
        expected.sort();
        sort_by_key(&mut items);
        prop_assert_eq!(items, expected);
    }
}

#[test]
fn a_voxel_holds_the_mean_of_its_points() {
    let nan = [f32::NAN; 3];
    let mut cloud = points(vec![[0.001, 0.0, 0.0], nan, [0.003, 0.0, 0.0], [0.002, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    cloud.colors[2] = [40, 20, 30];
    let grid = VoxelGrid::new(&cloud, 0.01);
    let v = grid.of_point[0];
    assert_eq!(grid.of_point, [v, NONE, v, v, grid.of_point[4]]);
    assert_eq!(grid.counts[v as usize], 3);
    assert!((grid.positions[v as usize][0] - 0.002).abs() < 1e-7);
    assert!((grid.colors[v as usize][0] - 20.0).abs() < 1e-4);
    assert!(grid.neighbours(v).is_empty());
}
