//! Geometric metrics of one model against another, each with its convention.
//!
//! All of them follow from the distances of A's points to B and of B's points to A, in metres. They are computed as
//! [Remanufacturing paper], Table 1, and [Eye-in-hand 2020], Tables 3 to 5, compute theirs.

use super::nearest_points::NearestPoints;
use serde::{Deserialize, Serialize};

/// [Eye-in-hand 2020] calls the share of points within this distance "3D IoU".
pub const PRECISION_DISTANCE: f64 = 1e-3;

/// How each figure of a [`Comparison`] is computed.
pub const CONVENTIONS: [(&str, &str); 9] = [
    ("mean_error", "ME: mean of d(a, B) over the points a of A, d(a, B) = distance to the nearest of B; metres"),
    ("mean_square_error", "MSE: mean of d(a, B) squared, also called MCE; square metres"),
    ("hd95", "HD95: 95th percentile of d(a, B), linear between ranks; metres"),
    ("hausdorff", "largest d(a, B); metres"),
    ("chamfer", "CD: sum of the two means, A to B and B to A, not squared; metres"),
    ("c2c", "C2C: mean of d(a, B), A to B; metres"),
    ("precision_1mm", "share of A's points with d(a, B) <= 1 mm, also called 3D IoU"),
    ("precision, recall", "share of A's points within tau of B; of B's points within tau of A"),
    ("f_score", "2 precision recall / (precision + recall)"),
];

/// Distances of one model's points to another model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneWay {
    /// Points measured.
    pub points: u64,
    /// Mean distance.
    pub mean_error: f64,
    /// Mean squared distance.
    pub mean_square_error: f64,
    /// 95th percentile, linear between ranks.
    pub hd95: f64,
    /// Largest distance.
    pub hausdorff: f64,
}

impl OneWay {
    /// Summary of `distances`, of which those that are not finite are passed over; `None` if there is no other.
    pub fn of(distances: &[f64]) -> Option<Self> {
        let mut finite: Vec<f64> = distances.iter().copied().filter(|d| d.is_finite()).collect();
        let n = finite.len() as f64;
        let mean_error = finite.iter().sum::<f64>() / n;
        let mean_square_error = finite.iter().map(|d| d * d).sum::<f64>() / n;
        let hausdorff = finite.iter().copied().fold(0.0, f64::max);
        let hd95 = percentile(&mut finite, 0.95)?;
        Some(Self { points: finite.len() as u64, mean_error, mean_square_error, hd95, hausdorff })
    }
}

/// A model A against a reference B.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// From A's points to B.
    pub a_to_b: OneWay,
    /// From B's points to A.
    pub b_to_a: OneWay,
    /// Sum of the two means.
    pub chamfer: f64,
    /// Mean of A to B.
    pub c2c: f64,
    /// Share of A's points within 1 mm of B.
    pub precision_1mm: f64,
    /// Distance of precision, recall and F-score, metres.
    pub tau: f64,
    /// Share of A's points within tau of B.
    pub precision: f64,
    /// Share of B's points within tau of A.
    pub recall: f64,
    /// Harmonic mean of precision and recall.
    pub f_score: f64,
}

impl Comparison {
    /// From the distances of A's points to B and of B's points to A; `None` if either holds no finite one.
    pub fn new(a_to_b: &[f64], b_to_a: &[f64], tau: f64) -> Option<Self> {
        let (from_a, from_b) = (OneWay::of(a_to_b)?, OneWay::of(b_to_a)?);
        let (precision, recall) = (share_within(a_to_b, tau), share_within(b_to_a, tau));
        let sum = precision + recall;
        Some(Self {
            a_to_b: from_a,
            b_to_a: from_b,
            chamfer: from_a.mean_error + from_b.mean_error,
            c2c: from_a.mean_error,
            precision_1mm: share_within(a_to_b, PRECISION_DISTANCE),
            tau,
            precision,
            recall,
            f_score: if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 },
        })
    }

    /// Cloud against cloud, nearest points both ways; `None` if either has no usable point.
    pub fn of_clouds(a: &NearestPoints, b: &NearestPoints, tau: f64) -> Option<Self> {
        Self::new(&b.distances_from(a), &a.distances_from(b), tau)
    }
}

/// Share of the finite distances that are at most `limit`; 0 where there is none.
fn share_within(distances: &[f64], limit: f64) -> f64 {
    let (mut within, mut all) = (0_u64, 0_u64);
    for d in distances.iter().filter(|d| d.is_finite()) {
        all += 1;
        within += u64::from(*d <= limit);
    }
    if all == 0 { 0.0 } else { within as f64 / all as f64 }
}

/// The value below which `share` (0..=1) of `values` lie, linear between ranks as in NumPy; reorders them. `None` if
/// there is none.
pub fn percentile(values: &mut [f64], share: f64) -> Option<f64> {
    let rank = share.clamp(0.0, 1.0) * values.len().checked_sub(1)? as f64;
    let (_, low, above) = values.select_nth_unstable_by(rank as usize, f64::total_cmp);
    let next = above.iter().copied().fold(f64::INFINITY, f64::min);
    let next = if above.is_empty() { *low } else { next };
    Some(*low + (next - *low) * rank.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_follow_their_conventions() {
        // A: three points on a line; B: the same and one 4 mm off the end.
        let a = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0005]];
        let b = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.004, 0.0, 0.0], [f32::NAN, 0.0, 0.0]];
        let m = Comparison::of_clouds(&NearestPoints::new(&a), &NearestPoints::new(&b), 0.0004).expect("points");
        let close = |x: f64, y: f64| (x - y).abs() < 1e-7;
        let off = (0.004_f64.powi(2) + 0.0005_f64.powi(2)).sqrt();
        assert_eq!((m.a_to_b.points, m.b_to_a.points), (3, 4));
        assert!(close(m.c2c, 0.0005 / 3.0) && close(m.a_to_b.mean_error, m.c2c), "{m:?}");
        assert!(close(m.chamfer, 0.0005 / 3.0 + (0.0005 + off) / 4.0), "{m:?}");
        assert!(close(m.a_to_b.mean_square_error, 0.0005_f64.powi(2) / 3.0), "{m:?}");
        assert!(close(m.b_to_a.hausdorff, off), "{m:?}");
        // numpy.percentile([0, 0, 0.0005], 95)
        assert!(close(m.a_to_b.hd95, 0.00045), "{m:?}");
        assert_eq!(m.precision_1mm, 1.0);
        assert!(close(m.precision, 2.0 / 3.0) && close(m.recall, 0.5), "{m:?}");
        assert!(close(m.f_score, 2.0 * (2.0 / 3.0) * 0.5 / (2.0 / 3.0 + 0.5)), "{m:?}");
    }

    #[test]
    fn nothing_to_measure_is_no_figure() {
        let one = NearestPoints::new(&[[0.0; 3]]);
        for points in [vec![], vec![[f32::NAN; 3]; 4]] {
            let none = NearestPoints::new(&points);
            assert!(Comparison::of_clouds(&one, &none, 1e-3).is_none());
            assert!(Comparison::of_clouds(&none, &one, 1e-3).is_none());
        }
        assert_eq!(Comparison::of_clouds(&one, &one, 1e-3).map(|m| (m.f_score, m.b_to_a.hd95)), Some((1.0, 0.0)));
        assert_eq!(percentile(&mut [], 0.95), None);
        assert_eq!(percentile(&mut [4.0, 1.0, 2.0, 3.0], 0.5), Some(2.5));
        assert_eq!(percentile(&mut [4.0, 1.0], 1.0), Some(4.0));
    }
}
