//! Risk against coverage: what is lost and what is won by dropping the labels that networks are unsure of.
//!
//! The threshold of sigma is chosen once, on motors that serve for nothing else, and frozen
//! ([Remanufacturing paper] gives 0.5 without saying how it was found). Fields hold sigma in eight bits, so one
//! [`Confusion`] for each of its values tells the figures at every threshold after one pass over the pictures.

use super::confusion::{Confusion, PixelScores};
use semascan_perception::segment::ClassField;
use serde::Serialize;

/// Values of sigma in a [`ClassField`].
const LEVELS: usize = 256;
/// Thresholds that are looked at: hundredths.
const STEPS: u32 = 100;

/// Pixels by truth, label and sigma.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RiskCoverage {
    levels: Vec<Confusion>,
}

/// What one threshold does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RiskPoint {
    /// Labels with a larger sigma are dropped.
    pub threshold: f32,
    /// Retained / all, of the pixels that are truly something.
    pub completeness: f64,
    /// Wrong / retained, of the pixels that are said to be something.
    pub false_detection_rate: f64,
    /// Mean IoU over all classes but none; dropped pixels are misses.
    pub mean_iou: f64,
}

impl RiskCoverage {
    /// Of so many classes, none included.
    pub fn new(classes: usize) -> Self {
        Self { levels: vec![Confusion::new(classes); LEVELS] }
    }

    /// Counts the pixels of a picture.
    pub fn add(&mut self, field: &ClassField, truth: &[u16]) {
        for (i, &truth) in truth.iter().enumerate() {
            let level = (field.sigma(i) * 255.0).round() as usize;
            if let Some(confusion) = self.levels.get_mut(level) {
                confusion.add(truth, Some(field.best(i)));
            }
        }
    }

    /// Adds another's pixels, of the same classes.
    pub fn merge(&mut self, other: &Self) {
        self.levels.iter_mut().zip(&other.levels).for_each(|(a, b)| a.merge(b));
    }

    /// The pixels with the labels dropped whose sigma is above `threshold`.
    pub fn at(&self, threshold: f32) -> Confusion {
        let mut all: Option<Confusion> = None;
        for (level, confusion) in self.levels.iter().enumerate() {
            let kept = level as f32 / 255.0 <= threshold;
            let confusion = if kept { confusion.clone() } else { confusion.dropped() };
            match &mut all {
                Some(all) => all.merge(&confusion),
                None => all = Some(confusion),
            }
        }
        all.unwrap_or_else(|| Confusion::new(0))
    }

    /// The figures of all pixels, nothing dropped.
    pub fn unfiltered(&self) -> PixelScores {
        self.at(f32::INFINITY).scores()
    }

    /// What `threshold` does.
    pub fn point(&self, threshold: f32) -> RiskPoint {
        let PixelScores { completeness, false_detection_rate, mean_iou, .. } = self.at(threshold).scores();
        RiskPoint { threshold, completeness, false_detection_rate, mean_iou }
    }

    /// What each hundredth does, from the smallest.
    pub fn curve(&self) -> Vec<RiskPoint> {
        (1..=STEPS).map(|k| self.point(k as f32 / STEPS as f32)).collect()
    }

    /// The largest threshold at which the false detection rate is at most `share` of what it is without one: the one that
    /// costs least completeness. `None` if there is none above zero.
    pub fn threshold(&self, share: f64) -> Option<f32> {
        let goal = self.unfiltered().false_detection_rate * share;
        self.curve().into_iter().rev().find(|p| p.false_detection_rate <= goal).map(|p| p.threshold)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Class 1 everywhere; a pixel is wrongly none or class 2 where sigma is large.
    fn pixels() -> RiskCoverage {
        let mut all = RiskCoverage::new(3);
        let probabilities = [[0, 255, 0], [0, 255, 0], [0, 255, 0], [0, 0, 255], [0, 0, 255], [0, 255, 0]].concat();
        let sigma = vec![0, 10, 40, 60, 120, 200];
        all.add(&ClassField::Soft { classes: 3, probabilities, sigma, model_sigma: Vec::new() }, &[1; 6]);
        all
    }

    #[test]
    fn dropping_what_is_unsure_costs_coverage_and_lowers_risk() {
        let all = pixels();
        let s = all.unfiltered();
        assert!((s.false_detection_rate - 2.0 / 6.0).abs() < 1e-12 && s.completeness == 1.0);
        let p = all.point(0.3);
        assert!((p.false_detection_rate - 1.0 / 4.0).abs() < 1e-12, "{p:?}");
        assert!((p.completeness - 4.0 / 6.0).abs() < 1e-12 && (p.mean_iou - 0.5).abs() < 1e-12);
        assert!(all.curve().windows(2).all(|w| w[0].completeness <= w[1].completeness));
    }

    #[test]
    fn the_threshold_is_the_largest_that_reaches_the_goal() {
        let all = pixels();
        // 60 / 255 = 0.235: the first wrong pixel goes at 0.23.
        assert_eq!(all.threshold(0.5), Some(0.23));
        assert_eq!(all.threshold(1.0), Some(1.0));
        let mut perfect = RiskCoverage::new(3);
        perfect.add(&ClassField::Hard(vec![1, 2]), &[1, 2]);
        assert_eq!(perfect.threshold(0.5), Some(1.0), "nothing is wrong, so nothing need go");
        let mut sure = RiskCoverage::new(3);
        sure.add(&ClassField::Hard(vec![1, 2]), &[1, 1]);
        assert_eq!(sure.threshold(0.5), None, "wrong and sure of it");
    }

    #[test]
    fn pictures_add_up() {
        let mut twice = pixels();
        twice.merge(&pixels());
        assert_eq!(twice.point(0.3).mean_iou, pixels().point(0.3).mean_iou);
        assert_eq!(twice.unfiltered().pixels, 12);
    }
}
