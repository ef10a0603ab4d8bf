//! Pixels by what they are and what was said of them, and the figures that [Remanufacturing paper] and [Wang 2023] take
//! from it.
//!
//! IoU of a class is correct / (true or said to be). A pixel whose label was dropped as uncertain is a miss: it counts
//! among the true pixels of its class and nowhere else. The false detection rate of [Remanufacturing paper] is wrong /
//! all retained pixels that are said to be something other than none.

use serde::Serialize;

/// How often pixels of each true class were said to be of each class, or of none that was kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusion {
    classes: usize,
    /// `truth * (classes + 1) + given`; the last column holds dropped pixels.
    counts: Vec<u64>,
}

/// Figures of a [`Confusion`]; shares of 1. Means are over the classes that occur, each class counting alike.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PixelScores {
    /// Pixels judged.
    pub pixels: u64,
    /// Mean IoU over all classes but none.
    pub mean_iou: f64,
    /// Mean IoU over all classes.
    pub mean_iou_with_none: f64,
    /// Correct / all pixels.
    pub pixel_accuracy: f64,
    /// Mean over all classes of correct / true.
    pub mean_accuracy: f64,
    /// Mean over all classes but none of correct / said to be.
    pub mean_precision_without_none: f64,
    /// Mean over all classes but none of correct / true.
    pub mean_recall_without_none: f64,
    /// Wrong / retained, of pixels that are said to be something.
    pub false_detection_rate: f64,
    /// Retained / all, of pixels that are truly something.
    pub completeness: f64,
    /// IoU of each class but none, in their order; `None` where it neither occurs nor is said to.
    pub iou: Vec<Option<f64>>,
}

impl Confusion {
    /// Of so many classes, none included.
    pub fn new(classes: usize) -> Self {
        Self { classes, counts: vec![0; classes * (classes + 1)] }
    }

    /// Counts a pixel; `given` is `None` where its label was dropped. A class beyond those there are is as good as none
    /// given; a pixel whose truth is beyond them is not judged.
    pub fn add(&mut self, truth: u16, given: Option<u16>) {
        let column = given.map_or(self.classes, usize::from).min(self.classes);
        if let Some(count) = self.counts.get_mut(usize::from(truth) * (self.classes + 1) + column) {
            *count += 1;
        }
    }

    /// Adds another's pixels, of the same classes.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
    }

    /// The same pixels with every label dropped.
    pub fn dropped(&self) -> Self {
        let mut dropped = Self::new(self.classes);
        let rows = dropped.counts.chunks_exact_mut(self.classes + 1);
        for (to, from) in rows.zip(self.counts.chunks_exact(self.classes + 1)) {
            to[self.classes] = from.iter().sum();
        }
        dropped
    }

    fn row(&self, truth: usize) -> &[u64] {
        self.counts.get(truth * (self.classes + 1)..(truth + 1) * (self.classes + 1)).unwrap_or(&[])
    }

    fn correct(&self, class: usize) -> u64 {
        self.row(class).get(class).copied().unwrap_or(0)
    }

    fn given(&self, class: usize) -> u64 {
        (0..self.classes).filter_map(|t| self.row(t).get(class)).sum()
    }

    fn truly(&self, class: usize) -> u64 {
        self.row(class).iter().sum()
    }

    /// Intersection over union of `class`; `None` where it neither occurs nor is said to.
    pub fn iou(&self, class: usize) -> Option<f64> {
        let correct = self.correct(class);
        ratio(correct, self.truly(class) + self.given(class) - correct)
    }

    /// All figures.
    pub fn scores(&self) -> PixelScores {
        let occurs = |c: &usize| self.truly(*c) > 0;
        let mean = |first: usize, figure: &dyn Fn(usize) -> Option<f64>| {
            let values: Vec<f64> = (first..self.classes).filter(occurs).filter_map(figure).collect();
            if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
        };
        let sum = |from: usize, count: &dyn Fn(usize) -> u64| (from..self.classes).map(count).sum::<u64>();
        let iou = |c: usize| self.iou(c);
        let recall = |c: usize| ratio(self.correct(c), self.truly(c));
        let precision = |c: usize| ratio(self.correct(c), self.given(c));
        let pixels = self.counts.iter().sum();
        let said = sum(1, &|c| self.given(c));
        let wrong = said - sum(1, &|c| self.correct(c));
        let foreground = sum(1, &|c| self.truly(c));
        let lost = sum(1, &|c| self.row(c).last().copied().unwrap_or(0));
        PixelScores {
            pixels,
            mean_iou: mean(1, &iou),
            mean_iou_with_none: mean(0, &iou),
            pixel_accuracy: ratio(sum(0, &|c| self.correct(c)), pixels).unwrap_or(0.0),
            mean_accuracy: mean(0, &recall),
            mean_precision_without_none: mean(1, &precision),
            mean_recall_without_none: mean(1, &recall),
            false_detection_rate: ratio(wrong, said).unwrap_or(0.0),
            completeness: ratio(foreground - lost, foreground).unwrap_or(1.0),
            iou: (1..self.classes).map(iou).collect(),
        }
    }
}

fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: &[(u16, Option<u16>)]) -> Confusion {
        let mut confusion = Confusion::new(3);
        pixels.iter().for_each(|(truth, given)| confusion.add(*truth, *given));
        confusion
    }

    #[test]
    fn figures_of_a_worked_example() {
        let s = of(&[
            (0, Some(0)),
            (0, Some(1)),
            (1, Some(1)),
            (1, Some(1)),
            (1, Some(2)),
            (1, None),
            (2, Some(2)),
            (2, Some(0)),
        ])
        .scores();
        assert_eq!(s.pixels, 8);
        // Class 1: 2 correct, 4 true, 3 said: 2 / 5. Class 2: 1 correct, 2 true, 2 said: 1 / 3. None: 1 of 3.
        assert_eq!(s.iou, [Some(0.4), Some(1.0 / 3.0)]);
        assert!((s.mean_iou - (0.4 + 1.0 / 3.0) / 2.0).abs() < 1e-12);
        assert!((s.mean_iou_with_none - (0.4 + 2.0 / 3.0) / 3.0).abs() < 1e-12);
        assert!((s.pixel_accuracy - 0.5).abs() < 1e-12 && (s.mean_accuracy - 0.5).abs() < 1e-12);
        assert!((s.mean_precision_without_none - (2.0 / 3.0 + 0.5) / 2.0).abs() < 1e-12);
        // Said to be something: 3 of class 1, 2 of class 2, of which 2 wrong.
        assert!((s.false_detection_rate - 0.4).abs() < 1e-12);
        assert!((s.completeness - 5.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn dropped_pixels_are_misses_and_no_false_detections() {
        let all = of(&[(1, Some(2)), (1, Some(1)), (0, Some(1))]);
        let s = all.dropped().scores();
        assert_eq!((s.mean_iou, s.false_detection_rate, s.completeness, s.pixels), (0.0, 0.0, 0.0, 3));
        let mut both = all.clone();
        both.merge(&all.dropped());
        assert_eq!(both.iou(1), Some(1.0 / 5.0));
    }

    #[test]
    fn classes_that_do_not_occur_do_not_count() {
        let s = of(&[(0, Some(0)), (1, Some(1)), (9, Some(1)), (1, Some(9))]).scores();
        assert_eq!((s.pixels, s.mean_iou, s.iou[1]), (3, 0.5, None));
    }
}
