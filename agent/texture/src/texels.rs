//! The texels of a triangle, with the weights of its corners there.

/// Calls `visit` with column, row and the weights of the corners for each texel of a rectangle whose middle lies in the triangle.
/// Corners are in texels; the middle of the first texel is `[0.5, 0.5]`.
pub(crate) fn for_each_texel(
    corners: [[f64; 2]; 3],
    (width, height): (u32, u32),
    mut visit: impl FnMut(u32, u32, [f64; 3]),
) {
    const SLACK: f64 = 1e-9;
    let [a, b, c] = corners;
    let doubled = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let area = doubled(a, b, c);
    if area.abs() < 1e-12 {
        return;
    }
    let span = |axis: usize, size: u32| {
        let of = corners.map(|corner| corner[axis]);
        let (low, high) = (of[0].min(of[1]).min(of[2]), of[0].max(of[1]).max(of[2]));
        let first = (low - 0.5).ceil().clamp(0.0, f64::from(size)) as u32;
        let end = ((high - 0.5).floor() + 1.0).clamp(0.0, f64::from(size)) as u32;
        first..end
    };
    for row in span(1, height) {
        for column in span(0, width) {
            let p = [f64::from(column) + 0.5, f64::from(row) + 0.5];
            let weights = [doubled(p, b, c), doubled(a, p, c), doubled(a, b, p)].map(|part| part / area);
            if weights.iter().all(|weight| *weight >= -SLACK) {
                visit(column, row, weights);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_cover_a_square_and_weights_give_the_place() {
        let corners = [[1.2, 1.0], [9.0, 1.5], [8.5, 8.0], [1.0, 7.5]];
        let mut count = [[0; 10]; 10];
        for triangle in [[0, 1, 2], [2, 3, 0]] {
            let places = triangle.map(|k| corners[k]);
            for_each_texel(places, (10, 10), |x, y, weights| {
                count[y as usize][x as usize] += 1;
                let at = [0, 1].map(|k| (0..3).map(|i| weights[i] * places[i][k]).sum::<f64>());
                assert!((at[0] - f64::from(x) - 0.5).abs() < 1e-9 && (at[1] - f64::from(y) - 0.5).abs() < 1e-9);
            });
        }
        assert!(count[2..7].iter().all(|row| row[2..8].iter().all(|n| *n >= 1)), "{count:?}");
        assert_eq!(count[0], [0; 10]);
        for_each_texel([[1.0, 1.0], [5.0, 5.0], [3.0, 3.0]], (10, 10), |_, _, _| panic!("a line has no texels"));
        // What lies outside is cut off.
        let mut visited = 0;
        for_each_texel([[-50.0, -50.0], [50.0, -50.0], [0.0, 50.0]], (3, 3), |_, _, _| visited += 1);
        assert_eq!(visited, 9);
    }
}
