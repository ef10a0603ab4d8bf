//! Whether a view is of the world that a model was trained for. A network labels whatever it is shown, and is most sure of
//! itself where it has learned nothing: its own confidence cannot tell.
//!
//! Each view's picture becomes a few numbers ([`super::picture_statistics`]); how far these are from those of views of the
//! right world is Mahalanobis's distance, as [Lee 2018] takes it on a network's features. Where the members of an ensemble
//! disagree about most of what they see, they do not know it either ([Lakshminarayanan 2017]). Mean, whitening and thresholds are
//! measured (`semascan models calibrate`) and stand in the model's manifest. A model without them does not judge.
//!
//! Both thresholds are quantiles of what views of the right world show, by their rank among these ([Vovk 2005], conformal
//! prediction): a new view of the same world exceeds each with a probability of at most [`FALSE_ALARMS`]. One odd view of the
//! calibration does not move them, and pictures from elsewhere have no part in them: those only check them.

use super::picture_statistics::{NAME, STATISTICS, statistics};
use super::region::{Sight, Volume, Window};
use crate::view::View;
use nalgebra::{DMatrix, DVector};
use semascan_model::record::{DomainRecord, UncertaintyFigures};
use serde::{Deserialize, Serialize};

/// Share of the views of the right world that each threshold may mark.
pub const FALSE_ALARMS: f64 = 0.02;
/// Fewest values for a threshold: with `n` of them, the largest but one is exceeded with a probability of 2 / (n + 1).
const FEWEST: usize = 99;
/// Share of each number's own variance that is added to it: few views know their covariances badly.
const RIDGE: f64 = 0.05;
/// Fewest pixels taken for components about which an ensemble can disagree.
const FEWEST_FOREGROUND: u64 = 500;

/// The numbers of a view that are compared: of the window that networks look at, `margin` pixels wider than what is in
/// `volume`; of the whole picture where that is unknown. `None` where the part is out of sight or its window too small.
pub fn numbers_of(view: &View, volume: Option<&Volume>, margin: u32) -> Option<[f64; STATISTICS]> {
    let window = match Window::of_volume(view, volume, margin) {
        Sight::In(window) => window,
        Sight::Unknown => Window::whole(view.intrinsics.width, view.intrinsics.height),
        Sight::None => return None,
    };
    statistics(&view.rgb, window)
}

/// `[domain]` of a manifest: the views that a model's labels can be believed for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Which numbers, by name.
    pub statistics: String,
    /// Views that it was calibrated on.
    pub views: usize,
    /// Where these came from.
    #[serde(default)]
    pub sources: Vec<String>,
    /// Share of the views of the right world that each threshold may mark: the thresholds are quantiles. Absent in manifests
    /// whose thresholds were set otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub false_alarms: Option<f64>,
    /// Largest score of the views, each judged by a calibration without its source.
    pub largest: f64,
    /// Photographs from elsewhere that the threshold was checked on; they do not set it.
    #[serde(default)]
    pub photographs: usize,
    /// Smallest score of these; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smallest_outside: Option<f64>,
    /// A view with a larger score is out of domain.
    pub threshold: f64,
    /// Views that the model's ensemble was asked about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asked: Option<usize>,
    /// Its largest disagreement on one of these: mean standard uncertainty of the pixels that it takes for components. Absent
    /// where its networks were not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_disagreement: Option<f64>,
    /// A view with a larger disagreement is out of domain; absent where its networks were not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disagreement_threshold: Option<f64>,
    /// Mean of each number.
    pub mean: Vec<f64>,
    /// Rows of the lower triangle that makes deviations from the mean uncorrelated and of variance 1.
    pub whitening: Vec<Vec<f64>>,
}

/// How far an ensemble disagrees about a view, by the figures of its components; `None` where it takes too little for
/// components.
pub fn disagreement(figures: &UncertaintyFigures) -> Option<f64> {
    (figures.foreground >= FEWEST_FOREGROUND).then_some(figures.sigma)
}

/// What a calibration cannot do with its views.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CalibrationError {
    /// There are too few.
    #[error("{found} views are too few to calibrate on: {FEWEST} are needed")]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// Without a second source nothing says how far views of the right world scatter.
    #[error("views of one source only: name two at least, so that each can be judged by the others")]
    OneSource,
    /// Some number is the same in all views.
    #[error("the views are too much alike to calibrate on")]
    Alike,
}

impl Domain {
    /// The calibration on the numbers of views, source after source, checked on those of photographs from elsewhere.
    ///
    /// # Errors
    /// [`CalibrationError`] if the views are too few, of one source, or too much alike.
    pub fn calibrated(
        views: &[(String, Vec<[f64; STATISTICS]>)],
        photographs: &[[f64; STATISTICS]],
    ) -> Result<Self, CalibrationError> {
        let all: Vec<&[f64; STATISTICS]> = views.iter().flat_map(|(_, numbers)| numbers).collect();
        if all.len() < FEWEST {
            return Err(CalibrationError::TooFew { found: all.len() });
        }
        if views.len() < 2 {
            return Err(CalibrationError::OneSource);
        }
        let mut domain = Self::fitted(&all)?;
        let mut inside = Vec::with_capacity(all.len());
        for (left_out, (_, numbers)) in views.iter().enumerate() {
            let others: Vec<_> =
                views.iter().enumerate().filter(|(i, _)| *i != left_out).flat_map(|(_, (_, n))| n).collect();
            let without = Self::fitted(&others)?;
            inside.extend(numbers.iter().map(|n| without.score(n)));
        }
        domain.false_alarms = Some(FALSE_ALARMS);
        domain.largest = rounded(inside.iter().copied().fold(0.0, f64::max));
        domain.sources = views.iter().map(|(source, _)| source.clone()).collect();
        domain.photographs = photographs.len();
        domain.smallest_outside = photographs.iter().map(|n| domain.score(n)).reduce(f64::min).map(rounded);
        let found = inside.len();
        domain.threshold = rounded(quantile(inside).ok_or(CalibrationError::TooFew { found })?);
        Ok(domain)
    }

    /// Mean and whitening alone.
    fn fitted(views: &[&[f64; STATISTICS]]) -> Result<Self, CalibrationError> {
        let count = views.len() as f64;
        let mean =
            views.iter().fold(DVector::zeros(STATISTICS), |sum, n| sum + DVector::from_column_slice(&n[..])) / count;
        let mut covariance = DMatrix::zeros(STATISTICS, STATISTICS);
        for numbers in views {
            let d = DVector::from_column_slice(&numbers[..]) - &mean;
            covariance += &d * d.transpose() / (count - 1.0).max(1.0);
        }
        for k in 0..STATISTICS {
            covariance[(k, k)] *= 1.0 + RIDGE;
        }
        // Covariance = L L^T; L^-1 makes deviations uncorrelated.
        let lower = covariance.cholesky().ok_or(CalibrationError::Alike)?.l();
        let whitening =
            lower.solve_lower_triangular(&DMatrix::identity(STATISTICS, STATISTICS)).ok_or(CalibrationError::Alike)?;
        let rows = (0..STATISTICS).map(|r| (0..=r).map(|c| rounded(whitening[(r, c)])).collect()).collect();
        Ok(Self {
            statistics: NAME.into(),
            views: views.len(),
            sources: Vec::new(),
            false_alarms: None,
            largest: 0.0,
            photographs: 0,
            smallest_outside: None,
            threshold: 0.0,
            asked: None,
            largest_disagreement: None,
            disagreement_threshold: None,
            mean: mean.iter().copied().map(rounded).collect(),
            whitening: rows,
        })
    }

    /// The same with a threshold of disagreement, from the disagreements on views of the right world.
    ///
    /// # Errors
    /// [`CalibrationError::TooFew`] if these are too few for a quantile.
    pub fn with_disagreement(mut self, inside: Vec<f64>) -> Result<Self, CalibrationError> {
        let found = inside.len();
        self.asked = Some(found);
        self.largest_disagreement = inside.iter().copied().reduce(f64::max).map(rounded);
        let threshold = quantile(inside).ok_or(CalibrationError::TooFew { found })?;
        self.disagreement_threshold = Some(rounded(threshold));
        Ok(self)
    }

    /// The verdict on a view with these `numbers`, about which the ensemble disagrees by so much (where that is known and was
    /// calibrated).
    pub(super) fn judge(&self, numbers: &[f64; STATISTICS], disagreement: Option<f64>) -> DomainRecord {
        let score = self.score(numbers);
        let disagrees = disagreement.zip(self.disagreement_threshold).is_some_and(|(found, most)| found > most);
        DomainRecord {
            score,
            threshold: self.threshold,
            disagreement,
            disagreement_threshold: self.disagreement_threshold,
            outside: score > self.threshold || disagrees,
        }
    }

    /// How far a view's numbers are from those of the calibration: root mean square of the whitened deviations, about 1 for
    /// a view like these.
    pub fn score(&self, numbers: &[f64; STATISTICS]) -> f64 {
        let deviation: Vec<f64> = numbers.iter().zip(&self.mean).map(|(n, mean)| n - mean).collect();
        let squares =
            self.whitening.iter().map(|row| row.iter().zip(&deviation).map(|(w, d)| w * d).sum::<f64>().powi(2));
        (squares.sum::<f64>() / STATISTICS as f64).sqrt()
    }

    /// What is wrong with the table, as (field, reason).
    ///
    /// # Errors
    /// The field at fault.
    pub(super) fn validate(&self) -> Result<(), (String, String)> {
        let fault = |field: &str, reason: String| Err((format!("domain.{field}"), reason));
        if self.statistics != NAME {
            return fault("statistics", format!("{:?} is not known, only {NAME:?} is", self.statistics));
        }
        if !(self.threshold.is_finite() && self.threshold > 0.0) {
            return fault("threshold", format!("{} is not positive", self.threshold));
        }
        if self.disagreement_threshold.is_some_and(|t| !(t.is_finite() && t > 0.0)) {
            return fault("disagreement_threshold", "is not positive".into());
        }
        if self.mean.len() != STATISTICS || self.mean.iter().any(|m| !m.is_finite()) {
            return fault("mean", format!("has not {STATISTICS} finite numbers"));
        }
        let whole = |(r, row): (usize, &Vec<f64>)| row.len() == r + 1 && row.iter().all(|w| w.is_finite());
        if self.whitening.len() != STATISTICS || !self.whitening.iter().enumerate().all(whole) {
            return fault("whitening", format!("is no lower triangle of {STATISTICS} rows of finite numbers"));
        }
        Ok(())
    }
}

/// What a new value like `values` exceeds with a probability of at most [`FALSE_ALARMS`]; `None` where these are too few to
/// say. Of `n` values and a new one each is the largest with the same probability, so that the new one exceeds the `k`-th
/// smallest with that of `(n + 1 - k) / (n + 1)`.
fn quantile(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    // The product is a whole number for some n, which rounding must not lift over itself.
    let above = ((values.len() + 1) as f64 * FALSE_ALARMS + 1e-9).floor() as usize;
    let place = values.len().checked_sub(above)?;
    values.get(place).copied().filter(|_| values.len() >= FEWEST)
}

/// Seven digits: more would be noise in a file that people read.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Views whose numbers scatter around `middle`, neighbours correlated.
    fn views(count: usize, middle: f64, seed: u64) -> Vec<[f64; STATISTICS]> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut view = || {
            let shared: f64 = random.random_range(-1.0..1.0);
            std::array::from_fn(|k| middle + shared + (1.0 + k as f64) * random.random_range(-0.5..0.5))
        };
        (0..count).map(|_| view()).collect()
    }

    fn sources(seed: u64) -> Vec<(String, Vec<[f64; STATISTICS]>)> {
        (0..4).map(|s| (format!("source {s}"), views(40, 3.0, seed + s))).collect()
    }

    #[test]
    fn views_like_those_of_the_calibration_are_inside_and_others_outside() {
        let elsewhere = views(20, 9.0, 90);
        let domain = Domain::calibrated(&sources(1), &elsewhere).expect("enough views");
        assert_eq!((domain.views, domain.photographs), (160, 20));
        // Of 1000 new views of the same world no more are marked than is stated, but for chance.
        let marked = views(1000, 3.0, 50).iter().filter(|n| domain.score(n) > domain.threshold).count();
        assert!((1..=50).contains(&marked), "{marked} of 1000 for a rate of {FALSE_ALARMS}");
        for numbers in &elsewhere {
            assert!(domain.score(numbers) > domain.threshold, "a view of another world");
        }
        let mean = views(200, 3.0, 60).iter().map(|n| domain.score(n)).sum::<f64>() / 200.0;
        assert!((mean - 1.0).abs() < 0.15, "scores are about 1: {mean}");
    }

    #[test]
    fn one_number_off_is_seen_whatever_its_own_scatter() {
        let domain = Domain::calibrated(&sources(1), &[]).expect("enough views");
        let mut numbers: [f64; STATISTICS] = [3.0; STATISTICS];
        assert!(domain.score(&numbers) < 0.2);
        // The first number scatters by less than 0.7, correlated with all others.
        numbers[0] += 12.0;
        assert!(domain.score(&numbers) > domain.threshold);
    }

    #[test]
    fn an_ensemble_that_disagrees_more_than_it_ever_did_inside_is_outside() {
        let domain = Domain::calibrated(&sources(1), &[]).expect("enough views");
        let inside = [3.0; STATISTICS];
        assert!(!domain.judge(&inside, Some(0.9)).outside, "not calibrated");
        // One odd view sets no threshold.
        let asked = (0..98).map(|k| 0.06 * f64::from(k) / 97.0).chain([0.4]).collect();
        let domain = domain.with_disagreement(asked).expect("enough views");
        assert_eq!((domain.asked, domain.largest_disagreement), (Some(99), Some(0.4)));
        assert_eq!(domain.disagreement_threshold, Some(0.06));
        assert!(!domain.judge(&inside, Some(0.05)).outside && !domain.judge(&inside, None).outside);
        let few = domain.clone().with_disagreement(vec![0.1; 98]);
        assert_eq!(few, Err(CalibrationError::TooFew { found: 98 }));
        let verdict = domain.judge(&inside, Some(0.3));
        assert!(verdict.outside && verdict.score < verdict.threshold);
        let figures = UncertaintyFigures { foreground: 499, sigma: 0.3, ..UncertaintyFigures::default() };
        assert_eq!(disagreement(&figures), None, "too little to disagree about");
        assert_eq!(disagreement(&UncertaintyFigures { foreground: 500, ..figures }), Some(0.3));
    }

    #[test]
    fn pictures_from_elsewhere_do_not_move_the_threshold() {
        let [far, near] = [9.0, 4.0].map(|middle| Domain::calibrated(&sources(1), &views(20, middle, 90)));
        let alone = Domain::calibrated(&sources(1), &[]).expect("enough views");
        assert_eq!([far, near].map(|d| d.expect("enough views").threshold), [alone.threshold; 2]);
        assert_eq!(alone.smallest_outside, None);
        // 160 views: three may be above, and the odd one of them has no weight.
        assert!(alone.threshold < alone.largest);
    }

    #[test]
    fn a_table_comes_back_and_a_broken_one_names_its_field() {
        let domain = Domain::calibrated(&sources(1), &[]).expect("enough views");
        domain.validate().expect("right");
        let text = toml::to_string(&domain).expect("writes");
        assert_eq!(toml::from_str::<Domain>(&text).expect("reads"), domain);
        let field = |change: fn(&mut Domain)| {
            let mut broken = domain.clone();
            change(&mut broken);
            broken.validate().expect_err("broken").0
        };
        assert_eq!(field(|d| d.statistics = "picture-9".into()), "domain.statistics");
        assert_eq!(field(|d| d.threshold = 0.0), "domain.threshold");
        assert_eq!(field(|d| d.mean[2] = f64::NAN), "domain.mean");
        assert_eq!(field(|d| d.whitening[3].truncate(1)), "domain.whitening");
    }

    #[test]
    fn views_that_say_nothing_are_refused() {
        let few = vec![("a".to_owned(), views(4, 3.0, 1)), ("b".to_owned(), views(4, 3.0, 2))];
        assert_eq!(Domain::calibrated(&few, &[]), Err(CalibrationError::TooFew { found: 8 }));
        assert_eq!(Domain::calibrated(&sources(1)[..1], &[]), Err(CalibrationError::TooFew { found: 40 }));
        let one = vec![("a".to_owned(), views(110, 3.0, 1))];
        assert_eq!(Domain::calibrated(&one, &[]), Err(CalibrationError::OneSource));
        let same = vec![("a".to_owned(), vec![[1.0; STATISTICS]; 60]), ("b".to_owned(), vec![[1.0; STATISTICS]; 60])];
        assert_eq!(Domain::calibrated(&same, &[]), Err(CalibrationError::Alike));
    }
}
