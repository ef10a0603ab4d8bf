//! The common offset: what is taken off coordinates before they become single precision.
//!
//! Georeferenced files have coordinates of millions of metres, of which `f32` keeps half a metre. Distances do not depend on
//! where the origin is, so all that is compared is moved by one offset, in `f64`, first.
//!
//! The rule leaves ordinary data as it is: there is no offset unless the median of the reference lies farther than 10 m from
//! the origin along some axis (at 10 m, `f32` keeps a micrometre). The offset is then that median, in whole metres. A median,
//! because a few wild points are common and must not move the rest.

/// Distance from the origin, in metres, from which on there is an offset.
const FAR: f64 = 10.0;

/// The offset in metres for `reference`, whose unit is `scale` metres, and all that is compared with it.
pub fn common_offset(reference: &[[f64; 3]], scale: f64) -> [f64; 3] {
    if !reference.iter().flatten().any(|c| (c * scale).abs() > FAR) {
        return [0.0; 3];
    }
    let middle = [0, 1, 2].map(|axis| median(reference.iter().map(|p| p[axis] * scale)));
    if middle.iter().any(|c| c.abs() > FAR) { middle.map(f64::round) } else { [0.0; 3] }
}

/// The shift, in the unit of `positions`, without which single precision would not keep a millionth of their extent: the
/// median in whole units, or zero. What is read at a shift is written back at it.
pub fn kept_shift(positions: &[[f64; 3]]) -> [f64; 3] {
    /// Single precision keeps this many times 1e-6 / 6e-8 of a length beside a coordinate.
    const TIMES: f64 = 16.0;
    let of_axis = |axis: usize| {
        let finite = || positions.iter().map(move |p| p[axis]).filter(|c| c.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
        (median(finite()), high - low)
    };
    let axes = [0, 1, 2].map(of_axis);
    let extent = axes.iter().map(|(_, extent)| *extent).fold(0.0, f64::max);
    let is_far = extent > 0.0 && axes.iter().any(|(middle, _)| middle.abs() > TIMES * extent);
    if is_far { axes.map(|(middle, _)| middle.round()) } else { [0.0; 3] }
}

/// Positions whose unit is `scale` metres, in metres from `offset`.
pub fn relative(positions: &[[f64; 3]], scale: f64, offset: [f64; 3]) -> Vec<[f32; 3]> {
    positions.iter().map(|p| [0, 1, 2].map(|axis| (p[axis] * scale - offset[axis]) as f32)).collect()
}

/// Positions in single precision as they are.
pub fn single(positions: &[[f64; 3]]) -> Vec<[f32; 3]> {
    positions.iter().map(|p| p.map(|c| c as f32)).collect()
}

/// The middle one of the finite values; 0 if there is none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let middle = finite.len() / 2;
    if finite.is_empty() { 0.0 } else { *finite.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_far_from_the_origin_is_moved() {
        let near = [[9.5, -3.0, 0.1], [0.25, 4e9, f64::NAN], [0.5, 2.0, 3.0]];
        assert_eq!(common_offset(&near, 1.0), [0.0; 3]);
        let far = [[500_000.125, 5_400_000.25, 431.5], [500_000.5, 5_400_000.75, 431.75], [f64::NAN; 3]];
        let offset = common_offset(&far, 1.0);
        assert_eq!(offset, [500_001.0, 5_400_001.0, 432.0]);
        assert_eq!(relative(&far[..1], 1.0, offset), [[-0.875, -0.75, -0.5]]);
        // The same in millimetres, and a file in millimetres that is not far.
        assert_eq!(common_offset(&far.map(|p| p.map(|c| c * 1e3)), 1e-3), offset);
        assert_eq!(common_offset(&[[9_000.0; 3]], 1e-3), [0.0; 3]);
        assert_eq!(common_offset(&[], 1.0), [0.0; 3]);
    }

    #[test]
    fn a_shift_is_kept_where_single_precision_would_lose_the_shape() {
        let cloud = |x: f64| [[x, 0.0, 0.0], [x + 0.04, 0.02, 0.0], [x + 0.02, 0.01, 0.0]];
        assert_eq!(kept_shift(&cloud(500_000.25)), [500_000.0, 0.0, 0.0]);
        assert_eq!(kept_shift(&cloud(0.3)), [0.0; 3]);
        assert_eq!((kept_shift(&[]), kept_shift(&[[7.0; 3]])), ([0.0; 3], [0.0; 3]));
    }

    #[test]
    fn without_an_offset_nothing_changes() {
        let p = [0.1_f32, -0.0, 3.7e-5];
        let moved = relative(&[p.map(f64::from)], 1.0, [0.0; 3]);
        assert_eq!(moved[0].map(f32::to_bits), p.map(f32::to_bits));
    }
}
