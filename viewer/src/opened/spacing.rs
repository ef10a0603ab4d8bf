//! How far apart the points of a surface lie: what a voxel is to a measured model.

use std::collections::HashSet;

/// Points that are looked at.
const SAMPLE: usize = 50_000;
/// Points of a cell that spacings are read from: of a surface one cell of this many is as wide as two spacings.
const POINTS: f64 = 4.0;
/// Rounds of choosing the cell.
const ROUNDS: usize = 4;

/// Median length of the edges of triangles, metres; `None` without any.
pub(super) fn of_edges(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Option<f32> {
    let step = triangles.len().div_ceil(SAMPLE).max(1);
    let edges = triangles.iter().step_by(step).flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut lengths: Vec<f32> = edges
        .filter_map(|(a, b)| {
            let (a, b) = (positions.get(*a as usize)?, positions.get(*b as usize)?);
            Some(glam::Vec3::from(*a).distance((*b).into()))
        })
        .filter(|length| *length > 0.0 && length.is_finite())
        .collect();
    if lengths.is_empty() {
        return None;
    }
    let middle = lengths.len() / 2;
    Some(*lengths.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Typical distance of neighbouring points of a surface, metres; `None` where they all lie in one place.
///
/// The cell of a grid is chosen so that those that are not empty hold [`POINTS`] points: of a surface their number grows with the
/// square of the edge.
pub(super) fn of_points(positions: &[[f32; 3]], extent: f32) -> Option<f32> {
    if positions.len() < 2 || !(extent > 0.0 && extent.is_finite()) {
        return None;
    }
    let mut edge = f64::from(extent) / 64.0;
    for _ in 0..ROUNDS {
        let cells: HashSet<[i64; 3]> =
            positions.iter().map(|p| p.map(|c| (f64::from(c) / edge).floor() as i64)).collect();
        let per_cell = positions.len() as f64 / cells.len() as f64;
        edge *= (POINTS / per_cell).sqrt().clamp(0.05, 4.0);
    }
    Some((edge / POINTS.sqrt()) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_of_points_and_of_triangles_has_the_spacing_that_it_has() {
        let at = |i: usize| [(i % 100) as f32 * 2e-3, (i / 100) as f32 * 2e-3, 0.0];
        let points: Vec<[f32; 3]> = (0..10_000).map(at).collect();
        let spacing = of_points(&points, 0.198).expect("a surface");
        assert!((1.4e-3..2.8e-3).contains(&spacing), "{spacing}");
        let triangles: Vec<[u32; 3]> = (0..99).map(|i| [i, i + 1, i + 100]).collect();
        let edge = of_edges(&points, &triangles).expect("edges");
        assert!((edge - 2e-3).abs() < 1e-6, "{edge}");
        assert_eq!((of_points(&points[..1], 1.0), of_points(&points, 0.0), of_edges(&points, &[])), (None, None, None));
        assert_eq!(of_edges(&points, &[[0, 0, 0], [1, 99_999, 1]]), None);
    }
}
