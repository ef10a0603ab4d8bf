//! How finely a frame is drawn while the camera moves: of how many points, and with how many pixels.
//!
//! A still picture always has every point and pixel, and is drawn in steps where these are too many. While the camera moves on a machine
//! that cannot draw it all in time, points and pixels become fewer until the picture follows the hand again. The measure is the time
//! from one frame to the next: no frame is drawn while the graphics processor is at earlier ones, so it is how long they take. A
//! graphics processor tires of points first; a processor that draws in its place of pixels, which larger splats of fewer points
//! cover as well.

/// Longest time between frames that still feels like moving the model, in milliseconds.
const SLOW_MS: f64 = 45.0;
/// Below this there is room for more.
const FAST_MS: f64 = 24.0;
/// Points that a machine is trusted with before anything is known of it.
const START: usize = 1_500_000;
/// Fewest points: below it a model is no longer recognised.
const FEWEST: usize = 20_000;
/// Least share of the points that one slow frame leaves.
const LEAST_SHARE: f64 = 0.125;
/// Most pixels of the screen along an edge of one of the picture.
const COARSEST: u32 = 4;
/// Fast frames in a row before pixels become finer: at first, and most, after that was in vain again and again.
const PATIENCE: u32 = 8;
const MOST_PATIENCE: u32 = 256;

/// How finely a frame is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Most points, evenly thinned; `None` for all.
    pub points: Option<usize>,
    /// Pixels of the screen along an edge of a pixel of the picture.
    pub coarseness: u32,
}

impl Detail {
    /// Everything.
    pub const WHOLE: Self = Self { points: None, coarseness: 1 };
}

/// What a machine can draw in time, learned frame by frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingDetail {
    points: usize,
    coarseness: u32,
    /// Fast frames in a row, and how many it takes before pixels become finer.
    fast: u32,
    patience: u32,
    last_ms: Option<f64>,
}

impl Default for MovingDetail {
    fn default() -> Self {
        Self { points: START, coarseness: 1, fast: 0, patience: PATIENCE, last_ms: None }
    }
}

impl MovingDetail {
    /// The camera moves and a frame of a model of `points` on `pixels` is due at `now_ms`: how finely to draw it.
    pub fn moving(&mut self, now_ms: f64, points: usize, pixels: usize) -> Detail {
        let drawn = pixels / (self.coarseness as usize).pow(2);
        match self.last_ms.replace(now_ms).map(|last| now_ms - last) {
            Some(gap) if gap > SLOW_MS => self.coarsen(gap, points, drawn),
            Some(gap) if gap < FAST_MS => self.refine(points, drawn),
            _ => self.fast = 0,
        }
        self.at_once(points)
    }

    /// How finely to draw `points` at once as far as is known.
    pub fn at_once(&self, points: usize) -> Detail {
        Detail { points: Some(self.points).filter(|most| *most < points), coarseness: self.coarseness }
    }

    /// The camera stands still: the next gap says nothing about drawing. What was learned is kept.
    pub fn still(&mut self) {
        self.last_ms = None;
    }

    fn coarsen(&mut self, gap: f64, points: usize, pixels: usize) {
        self.fast = 0;
        let present = self.points.min(points);
        // More points than one for every second pixel are a waste; of fewer, it is the pixels that take the time.
        if present > pixels / 2 || self.coarseness == COARSEST {
            let share = (SLOW_MS / gap).clamp(LEAST_SHARE, 0.5);
            let enough = (present as f64 * share) as usize;
            self.points = enough.max(pixels / 4).min(present / 2).max(FEWEST);
        } else {
            // As many pixels as there is time for.
            let enough = f64::from(self.coarseness) * (gap / SLOW_MS).sqrt();
            self.coarseness = (enough.ceil() as u32).clamp(self.coarseness + 1, COARSEST);
            self.patience = (2 * self.patience).min(MOST_PATIENCE);
        }
    }

    fn refine(&mut self, points: usize, pixels: usize) {
        self.fast += 1;
        // A small model that is drawn quickly says nothing about larger ones.
        if self.points < points && (self.points < pixels / 2 || self.coarseness == 1) {
            self.points += self.points / 4;
        } else if self.coarseness > 1 && self.fast >= self.patience {
            self.coarseness -= 1;
            self.fast = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a picture.
    const PIXELS: usize = 900_000;

    /// Frames on a machine that draws so many points, and so many pixels, in a millisecond.
    fn frames(detail: &mut MovingDetail, rates: (usize, usize), points: usize, count: usize) -> (Detail, Vec<usize>) {
        let (mut now, mut drawn, mut took) = (0.0, Detail::WHOLE, Vec::new());
        for _ in 0..count {
            drawn = detail.moving(now, points, PIXELS);
            let pixels = PIXELS / (drawn.coarseness as usize).pow(2);
            took.push(drawn.points.unwrap_or(points) / rates.0 + pixels / rates.1 + 16);
            now += took.last().map_or(0.0, |ms| *ms as f64);
        }
        (drawn, took)
    }

    #[test]
    fn a_fast_machine_draws_everything() {
        assert_eq!(frames(&mut MovingDetail::default(), (1_000_000, 1_000_000), 2_000_000, 50).0, Detail::WHOLE);
    }

    #[test]
    fn a_machine_that_is_slow_at_points_draws_fewer_and_one_that_is_slow_at_pixels_coarser_ones() {
        let (of_points, took) = frames(&mut MovingDetail::default(), (10_000, 1_000_000), 2_000_000, 60);
        assert!(of_points.points.is_some_and(|points| points > 50_000), "{of_points:?}");
        assert!(took[10..].iter().all(|ms| *ms <= 45), "{took:?}");
        let (of_pixels, took) = frames(&mut MovingDetail::default(), (1_000_000, 5_000), 1_000_000, 60);
        assert!(of_pixels.coarseness >= 3, "{of_pixels:?}");
        assert!(took[10..].iter().all(|ms| *ms <= 45), "{took:?}");
    }

    #[test]
    fn pixels_become_finer_again_and_more_seldom_where_that_is_in_vain() {
        let mut detail = MovingDetail::default();
        // Something else kept the machine busy for a while.
        frames(&mut detail, (1_000_000, 3_000), 500_000, 30);
        assert!(detail.coarseness > 2);
        assert_eq!(frames(&mut detail, (1_000_000, 1_000_000), 500_000, 2000).0, Detail::WHOLE);
        // A third of the pixels along an edge are fast, a half are slow.
        let mut detail = MovingDetail::default();
        let (_, took) = frames(&mut detail, (1_000_000, 7_000), 500_000, 2000);
        let slow = took[20..].iter().filter(|ms| **ms > 45).count();
        assert!(slow < 20, "{slow} of 1980 frames are slow");
    }

    #[test]
    fn it_never_thins_a_model_beyond_recognition() {
        let (slowest, _) = frames(&mut MovingDetail::default(), (1, 1), 2_000_000, 50);
        assert_eq!(slowest, Detail { points: Some(FEWEST), coarseness: COARSEST });
        assert_eq!(
            frames(&mut MovingDetail::default(), (1, 1), 1_000, 50).0.points,
            None,
            "a small model is drawn whole"
        );
    }

    #[test]
    fn a_model_that_has_no_points_yet_leaves_the_detail_as_it_is() {
        let mut detail = MovingDetail::default();
        frames(&mut detail, (1_000_000, 1_000_000), 0, 5);
        assert_eq!(detail.at_once(9_000), Detail::WHOLE);
        assert_eq!(detail.at_once(START + 1).points, Some(START));
    }

    #[test]
    fn standing_still_is_not_a_slow_frame() {
        let mut detail = MovingDetail::default();
        detail.moving(0.0, 1_000_000, PIXELS);
        detail.still();
        assert_eq!(detail.moving(5_000.0, 1_000_000, PIXELS), Detail::WHOLE);
    }
}
