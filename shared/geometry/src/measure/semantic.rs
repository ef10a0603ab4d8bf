//! Semantic scores by class: accuracy and completeness as [Remanufacturing paper] defines them, and the usual
//! precision, recall and IoU.

use std::collections::BTreeMap;

/// How each figure of a [`ClassScore`] is computed.
pub const SEMANTIC_CONVENTIONS: [(&str, &str); 5] = [
    ("accuracy", "correct / retained, over points of the true class; retained = with label evidence"),
    ("completeness", "retained / all, over points of the true class"),
    ("precision", "correct / all retained points that carry the class"),
    ("recall", "correct / all points of the true class"),
    ("iou", "correct / points of the true class or that carry it"),
];

/// One judged point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelledPoint {
    /// Its true class.
    pub truth: u16,
    /// The class it carries.
    pub given: u16,
    /// Whether it has label evidence.
    pub retained: bool,
}

/// Scores of one class, over the points whose true class it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassScore {
    /// Class.
    pub class: u16,
    /// Points whose true class this is.
    pub points: u64,
    /// Of these, points with label evidence.
    pub retained: u64,
    /// Of these, points that carry the class.
    pub correct: u64,
    /// Retained points of other classes that carry this one.
    pub wrongly: u64,
}

impl ClassScore {
    /// Correct / retained; 1 where nothing is retained.
    pub fn accuracy(&self) -> f64 {
        share(self.correct, self.retained)
    }

    /// Retained / all; 1 where there is none.
    pub fn completeness(&self) -> f64 {
        share(self.retained, self.points)
    }

    /// Correct / carrying the class; 1 where none does.
    pub fn precision(&self) -> f64 {
        share(self.correct, self.correct + self.wrongly)
    }

    /// Correct / all; 1 where there is none.
    pub fn recall(&self) -> f64 {
        share(self.correct, self.points)
    }

    /// Intersection over union of the true and the given class.
    pub fn iou(&self) -> f64 {
        share(self.correct, self.points + self.wrongly)
    }
}

/// Scores of every class that occurs, in order.
pub fn class_scores(points: impl IntoIterator<Item = LabelledPoint>) -> Vec<ClassScore> {
    let mut table: BTreeMap<u16, ClassScore> = BTreeMap::new();
    for p in points {
        let score = table.entry(p.truth).or_default();
        score.points += 1;
        score.retained += u64::from(p.retained);
        score.correct += u64::from(p.retained && p.given == p.truth);
        if p.retained && p.given != p.truth {
            table.entry(p.given).or_default().wrongly += 1;
        }
    }
    table.into_iter().map(|(class, score)| ClassScore { class, ..score }).collect()
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_by_class() {
        let point = |truth, given, retained| LabelledPoint { truth, given, retained };
        let scores = class_scores([
            point(1, 1, true),
            point(1, 2, true),
            point(1, 0, false),
            point(2, 2, true),
            point(0, 3, true),
        ]);
        assert_eq!(scores.iter().map(|s| s.class).collect::<Vec<_>>(), [0, 1, 2, 3]);
        let (one, two, three) = (scores[1], scores[2], scores[3]);
        assert_eq!((one.accuracy(), one.completeness(), one.precision()), (0.5, 2.0 / 3.0, 1.0));
        assert_eq!((one.recall(), one.iou()), (1.0 / 3.0, 1.0 / 3.0));
        assert_eq!((two.accuracy(), two.precision(), two.iou()), (1.0, 0.5, 0.5));
        assert_eq!((three.points, three.wrongly, three.precision(), three.iou()), (0, 1, 0.0, 0.0));
    }
}
