//! Where a moving camera will be: it goes on as it went, and how far it has strayed from that says how far to look
//! (constant velocity and adaptive threshold, [Vizzo 2023], sections III.A and III.C).

use super::super::se3::{advance, log};
use crate::view::covariance_of_prior;
use nalgebra::{Isometry3, Matrix6, Vector6};

/// What is known of the motion before anything was seen: standard deviations in radians and metres a frame.
const FIRST: (f64, f64) = (0.03, 0.03);
/// The least that a prediction is believed to be off: hands tremble.
const LEAST: (f64, f64) = (0.002, 0.002);
/// Share that the past keeps in the mean of squares with each frame.
const MEMORY: f64 = 0.9;

/// The motion of a camera, frame by frame.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    /// From one frame to the next, a twist of the camera.
    velocity: Vector6<f64>,
    /// Mean squares of how far predictions were off: rotation and translation.
    strayed: (f64, f64),
}

impl Default for Motion {
    fn default() -> Self {
        Self { velocity: Vector6::zeros(), strayed: (FIRST.0.powi(2), FIRST.1.powi(2)) }
    }
}

impl Motion {
    /// Where a camera will be that was at `last`.
    pub(super) fn predict(&self, last: &Isometry3<f64>) -> Isometry3<f64> {
        advance(last, &self.velocity)
    }

    /// Standard deviations of the prediction: radians and metres.
    pub(super) fn sigma(&self) -> (f64, f64) {
        (self.strayed.0.sqrt().max(LEAST.0), self.strayed.1.sqrt().max(LEAST.1))
    }

    /// Covariance of the prediction over (rotation, translation), camera frame.
    pub(super) fn covariance(&self) -> Matrix6<f64> {
        let (rotation, translation) = self.sigma();
        covariance_of_prior(rotation, translation)
    }

    /// The camera went from `last` to `now`.
    pub(super) fn moved(&mut self, last: &Isometry3<f64>, now: &Isometry3<f64>) {
        let off = log(&self.predict(last), now);
        let mean = |past: f64, off: f64| MEMORY * past + (1.0 - MEMORY) * off;
        // A jump counts at once, a calm stretch bit by bit.
        let (turned, shifted) = (off.fixed_rows::<3>(0).norm_squared(), off.fixed_rows::<3>(3).norm_squared());
        let strayed = (mean(self.strayed.0, turned), mean(self.strayed.1, shifted));
        self.strayed = (strayed.0.max(0.5 * turned), strayed.1.max(0.5 * shifted));
        self.velocity = log(last, now);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::se3::exp;
    use super::*;

    #[test]
    fn an_even_motion_is_foreseen_and_narrows_the_search_and_a_jolt_widens_it() {
        let step = exp(&Vector6::new(0.01, -0.02, 0.005, 0.004, 0.002, -0.01));
        let (mut motion, mut pose) = (Motion::default(), Isometry3::identity());
        for _ in 0..60 {
            let next = pose * step;
            motion.moved(&pose, &next);
            pose = next;
        }
        assert!(log(&motion.predict(&pose), &(pose * step)).norm() < 1e-12);
        assert_eq!(motion.sigma(), LEAST);
        let jolted = pose * exp(&Vector6::new(0.0, 0.08, 0.0, 0.0, 0.0, 0.05));
        motion.moved(&pose, &jolted);
        assert!(motion.sigma().0 > 0.05 && motion.sigma().1 > 0.03, "{:?}", motion.sigma());
    }
}
