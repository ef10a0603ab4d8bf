//! How many points a frame may have while the camera moves.
//!
//! A still picture always has every point, and is drawn in steps where these are too many. While the camera moves on a machine that
//! cannot draw them all in time, the picture is thinned until it follows the hand again. The measure is the time from one frame to
//! the next: no frame is drawn while the graphics processor is at earlier ones, so it is how long they take.

/// Longest time between frames that still feels like moving the model, in milliseconds.
const SLOW_MS: f64 = 45.0;
/// Below this there is room for more points.
const FAST_MS: f64 = 24.0;
/// Points that a machine is trusted with before anything is known of it.
const START: usize = 1_500_000;
/// Fewest points: below it a model is no longer recognised.
const FEWEST: usize = 40_000;

/// The budget, learned frame by frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointBudget {
    budget: Option<usize>,
    last_ms: Option<f64>,
}

impl PointBudget {
    /// The camera moves and a frame of a model of `points` is due at `now_ms`: how many of them to draw, `None` for all.
    pub fn moving(&mut self, now_ms: f64, points: usize) -> Option<usize> {
        let gap = self.last_ms.replace(now_ms).map(|last| now_ms - last);
        let present = self.present();
        match gap {
            Some(gap) if gap > SLOW_MS => self.budget = Some((present.min(points) / 2).max(FEWEST)),
            // A small model that is drawn quickly says nothing about larger ones.
            Some(gap) if gap < FAST_MS && present < points => self.budget = Some(present + present / 4),
            _ => {}
        }
        self.at_once(points)
    }

    /// How many of `points` to draw at once as far as is known, `None` for all.
    pub fn at_once(&self, points: usize) -> Option<usize> {
        Some(self.present()).filter(|budget| *budget < points)
    }

    fn present(&self) -> usize {
        self.budget.unwrap_or(START)
    }

    /// The camera stands still: the next gap says nothing about drawing. What was learned is kept.
    pub fn still(&mut self) {
        self.last_ms = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Milliseconds a frame takes on a machine that draws `rate` points a millisecond.
    fn frames(budget: &mut PointBudget, rate: usize, points: usize, count: usize) -> Option<usize> {
        let mut now = 0.0;
        let mut drawn = None;
        for _ in 0..count {
            drawn = budget.moving(now, points);
            now += (drawn.unwrap_or(points) / rate) as f64 + 16.0;
        }
        drawn
    }

    #[test]
    fn a_fast_machine_draws_everything() {
        assert_eq!(frames(&mut PointBudget::default(), 1_000_000, 2_000_000, 50), None);
    }

    #[test]
    fn a_slow_machine_settles_at_what_it_can_draw_in_time() {
        let drawn = frames(&mut PointBudget::default(), 10_000, 2_000_000, 50).expect("it cannot draw all");
        let ms = drawn / 10_000 + 16;
        assert!((20..=45).contains(&ms), "{drawn} points take {ms} ms");
    }

    #[test]
    fn it_never_thins_a_model_beyond_recognition() {
        assert_eq!(frames(&mut PointBudget::default(), 1, 2_000_000, 50), Some(FEWEST));
        assert_eq!(frames(&mut PointBudget::default(), 1, 1_000, 50), None, "a small model is drawn whole");
    }

    #[test]
    fn a_model_that_has_no_points_yet_leaves_the_budget_as_it_is() {
        let mut budget = PointBudget::default();
        frames(&mut budget, 1_000_000, 0, 5);
        assert_eq!(budget.at_once(9_000), None);
        assert_eq!(budget.at_once(START + 1), Some(START));
    }

    #[test]
    fn standing_still_is_not_a_slow_frame() {
        let mut budget = PointBudget::default();
        budget.moving(0.0, 1_000_000);
        budget.still();
        assert_eq!(budget.moving(5_000.0, 1_000_000), None);
    }
}
