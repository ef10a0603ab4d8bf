//! Supervoxels of scenes whose borders are known; any cloud is divided without loss.

use super::*;
use proptest::prelude::*;

/// A floor of 40 x 40 points 5 mm apart with a wall on one side, seen from the origin.
fn corner() -> ColoredPoints {
    let mut points = ColoredPoints::default();
    for i in 0..40 {
        for j in 0..40 {
            let (u, v) = (i as f32 * 0.005 - 0.1, j as f32 * 0.005);
            points.positions.push([u, 0.1, 0.4 + v]);
            points.positions.push([u, 0.1 - v, 0.6]);
            points.colors.extend([[200, 0, 0], [0, 200, 0]]);
        }
    }
    points
}

#[test]
fn supervoxels_cover_the_surface_and_stop_at_the_crease() {
    let points = corner();
    let grown = Supervoxels::grow(&points, &VccsConfig::new(0.0075));
    assert!(grown.of_point.iter().all(|&p| p != NONE));
    assert!((60..140).contains(&grown.patches.len()), "{}", grown.patches.len());
    for (patch, i) in grown.patches.iter().zip(0..) {
        let members: Vec<usize> = (0..points.len()).filter(|&k| grown.of_point[k] == i).collect();
        assert!(!members.is_empty());
        let far =
            members.iter().map(|&k| squared_distance(points.positions[k], patch.position).sqrt()).fold(0.0, f32::max);
        assert!(far < 2.0 * 0.03, "a supervoxel reaches {far} m");
    }
    // Nearly all hold one side only.
    let mixed = (0..grown.patches.len() as u32).filter(|&i| {
        let sides = [0, 1].map(|s| (s..points.len()).step_by(2).filter(|&k| grown.of_point[k] == i).count());
        sides[0].min(sides[1]) * 4 > sides[0].max(sides[1])
    });
    assert!(mixed.count() * 10 < grown.patches.len());
}

#[test]
fn edges_join_supervoxels_that_touch() {
    let grown = Supervoxels::grow(&corner(), &VccsConfig::new(0.0075));
    assert!(grown.edges.windows(2).all(|e| e[0] < e[1]));
    for [a, b] in &grown.edges {
        let d = squared_distance(grown.patches[*a as usize].position, grown.patches[*b as usize].position).sqrt();
        assert!(a < b && d < 0.09, "{a} and {b} are {d} m apart");
    }
    let mut joined = vec![false; grown.patches.len()];
    grown.edges.iter().flatten().for_each(|&p| joined[p as usize] = true);
    assert!(joined.iter().all(|&j| j), "the surface is in one piece");
}

#[test]
fn refinement_keeps_the_cover() {
    let config = VccsConfig { refinements: 3, ..VccsConfig::new(0.0075) };
    let grown = Supervoxels::grow(&corner(), &config);
    let reached = grown.of_point.iter().filter(|&&p| p != NONE).count();
    assert!(reached * 100 >= grown.of_point.len() * 99, "{reached}");
}

proptest! {
    #[test]
    fn any_points_and_settings_are_accepted(
        bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..40),
        near in prop::collection::vec(
            prop::array::uniform3((-50_000..50_000_i32).prop_map(|k| k as f32 / 1e6)),
            0..60,
        ),
        lengths in prop::array::uniform2(prop::num::f32::ANY),
    ) {
        let mut positions: Vec<[f32; 3]> = bits.iter().map(|p| p.map(f32::from_bits)).collect();
        positions.extend(near);
        let points = ColoredPoints { positions, colors: Vec::new() };
        for config in [VccsConfig::new(0.01), VccsConfig { voxel: lengths[0], seed: lengths[1], ..VccsConfig::new(0.01) }] {
            let grown = Supervoxels::grow(&points, &config);
            prop_assert_eq!(grown.of_point.len(), points.len());
            prop_assert!(grown.of_point.iter().all(|&p| p == NONE || (p as usize) < grown.patches.len()));
        }
    }
}
