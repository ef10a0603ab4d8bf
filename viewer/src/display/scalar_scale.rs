//! The scale of a share that colours mean: from where to where the ramp goes. It follows the data, because networks agree
//! or disagree by very different amounts, and on a fixed scale of 0 to 1 most models are of one colour.

/// Steps of a histogram of shares: what the stream keeps of them, 1/255.
const STEPS: usize = 256;
/// Share of the points that may lie beyond either end.
const BEYOND: f64 = 0.02;
/// Distances of the marks between which a scale ends.
const MARKS: [f64; 5] = [0.01, 0.02, 0.05, 0.1, 0.2];
/// A scale has about so many marks.
const MARKS_IN_SCALE: f64 = 4.0;

/// How many points have which share, 0..=1 in steps of 1/255.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShareHistogram([u64; STEPS]);

impl Default for ShareHistogram {
    fn default() -> Self {
        Self([0; STEPS])
    }
}

impl ShareHistogram {
    /// Counts a point.
    pub fn add(&mut self, share: f32) {
        self.0[step(share)] += 1;
    }

    /// Takes back a point that was counted.
    pub fn remove(&mut self, share: f32) {
        let count = &mut self.0[step(share)];
        *count = count.saturating_sub(1);
    }

    /// Whether some point has a share above 0.
    pub fn is_any_positive(&self) -> bool {
        self.0[1..].iter().any(|count| *count > 0)
    }

    /// The share that `part` of the points lie below; `None` without points.
    fn quantile(&self, part: f64) -> Option<f64> {
        let total: u64 = self.0.iter().sum();
        let rank = (part * total.checked_sub(1)? as f64).round() as u64;
        let mut below = 0;
        let step = self.0.iter().position(|count| {
            below += count;
            below > rank
        })?;
        Some(step as f64 / (STEPS - 1) as f64)
    }
}

/// The step of the histogram that a share falls into; NaN counts as 0.
fn step(share: f32) -> usize {
    (share.clamp(0.0, 1.0) * (STEPS - 1) as f32).round() as usize
}

/// Where the ramp begins and ends; shares beyond have the colours of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarScale {
    /// Share at the begin of the ramp.
    pub low: f32,
    /// Share at its end, above `low`.
    pub high: f32,
    /// Whether there are points below `low`.
    pub reaches_below: bool,
    /// Whether there are points above `high`.
    pub reaches_above: bool,
}

impl ScalarScale {
    /// The scale between round marks that all but 2 % of the points at either end lie on; `None` without points.
    pub fn of(histogram: &ShareHistogram) -> Option<Self> {
        let (low, high) = (histogram.quantile(BEYOND)?, histogram.quantile(1.0 - BEYOND)?);
        let wanted = (high - low) / MARKS_IN_SCALE;
        let mark = MARKS.into_iter().find(|mark| *mark >= wanted).unwrap_or(MARKS[MARKS.len() - 1]);
        let all = (1.0 / mark).round();
        // Half a step inwards, so that a share on a mark does not reach for the next one.
        let half = 0.5 / (STEPS - 1) as f64;
        let mut first = ((low + half) / mark).floor().clamp(0.0, all - 1.0);
        let last = ((high - half) / mark).ceil().clamp(first + 1.0, all);
        // One mark says nothing of small differences.
        if last - first < 2.0 && first > 0.0 {
            first -= 1.0;
        }
        let (low, high) = (first * mark, last * mark);
        let (least, most) = (histogram.quantile(0.0)?, histogram.quantile(1.0)?);
        let (reaches_below, reaches_above) = (least < low - half, most > high + half);
        Some(Self { low: low as f32, high: high as f32, reaches_below, reaches_above })
    }

    /// The share in the middle of the scale.
    pub fn middle(self) -> f32 {
        (self.low + self.high) / 2.0
    }
}

/// The scales of the colours that mean shares; `None` where nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShareScales {
    /// Of the confidence.
    pub confidence: Option<ScalarScale>,
    /// Of the uncertainty; `None` also where every one is 0, which is what labels have that nobody estimated one for.
    pub sigma: Option<ScalarScale>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scale(shares: &[(f32, usize)]) -> Option<ScalarScale> {
        let mut histogram = ShareHistogram::default();
        shares.iter().for_each(|(share, n)| (0..*n).for_each(|_| histogram.add(*share)));
        ScalarScale::of(&histogram)
    }

    #[test]
    fn small_differences_fill_the_scale_and_a_few_wild_points_do_not_stretch_it() {
        let sigma = scale(&[(0.02, 500), (0.05, 400), (0.08, 98), (0.9, 2)]).expect("points");
        assert!((sigma.low - 0.02).abs() < 1e-6 && (sigma.high - 0.08).abs() < 1e-6, "{sigma:?}");
        assert_eq!((sigma.reaches_below, sigma.reaches_above), (false, true), "which the legend says");
    }

    #[test]
    fn a_single_share_has_a_scale_and_no_points_have_none() {
        assert_eq!(scale(&[]), None);
        let sure = scale(&[(1.0, 10)]).expect("points");
        assert!(sure.high == 1.0 && sure.low < 1.0 && sure.low > 0.9, "{sure:?}");
        let never = scale(&[(0.0, 10)]).expect("points");
        assert!(never.low == 0.0 && never.high > 0.0 && never.high < 0.1, "{never:?}");
    }

    #[test]
    fn what_is_taken_back_was_never_there() {
        let mut histogram = ShareHistogram::default();
        histogram.add(0.5);
        histogram.add(f32::NAN);
        assert!(histogram.is_any_positive());
        histogram.remove(0.5);
        histogram.remove(0.7);
        assert!(!histogram.is_any_positive());
        histogram.remove(0.0);
        assert_eq!(histogram, ShareHistogram::default());
    }

    proptest! {
        #[test]
        fn every_scale_is_sound_and_holds_most_points(shares in proptest::collection::vec(0.0_f32..=1.0, 1..300)) {
            let s = scale(&shares.iter().map(|share| (*share, 1)).collect::<Vec<_>>()).expect("points");
            prop_assert!(0.0 <= s.low && s.low < s.high && s.high <= 1.0 + 1e-6, "{s:?}");
            let beyond = shares.iter().filter(|v| **v < s.low - 0.003 || **v > s.high + 0.003).count();
            prop_assert!(beyond as f64 <= 0.05 * shares.len() as f64 + 1.0, "{beyond} beyond {s:?}");
        }
    }
}
