//! The poses of the keyframes, held by the ways that were measured between them: where a loop closes, what has drifted
//! apart is spread over all of it ([Grisetti 2010]).
//!
//! Gauss-Newton with robust weights; each step is solved by conjugate gradients with the diagonal blocks as preconditioner,
//! which costs a few milliseconds for hundreds of keyframes that are linked with a few neighbours each.

use super::super::se3::{adjoint, advance, log};
use nalgebra::{DVector, Isometry3, Matrix6, Vector6};

/// Gauss-Newton steps, at most.
const ROUNDS: usize = 8;
/// Conjugate gradients: steps at most, and the share of the residual that may stay.
const STEPS: usize = 120;
const ACCURACY: f64 = 1e-8;
/// Squares of the way in standard deviations at which a link counts half: those that contradict all others fade out.
const CAUCHY: f64 = 400.0;
/// Stiffness of the first keyframe, which stays where it is.
const FIXED: f64 = 1e12;
/// A round that moves no camera by more is the last, metres and radians.
const STILL: f64 = 1e-6;

/// A measured way between two keyframes.
#[derive(Clone, Debug)]
pub(super) struct Link {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) a_from_b: Isometry3<f64>,
    /// Inverse covariance over a twist of `b`.
    pub(super) information: Matrix6<f64>,
}

/// All links.
#[derive(Debug, Default)]
pub(super) struct Graph {
    pub(super) links: Vec<Link>,
}

impl Graph {
    /// Keyframes that are linked with `keyframe`, in the order of their links.
    pub(super) fn neighbours(&self, keyframe: usize) -> impl Iterator<Item = usize> + '_ {
        self.links.iter().filter_map(move |link| match (link.a == keyframe, link.b == keyframe) {
            (true, _) => Some(link.b),
            (_, true) => Some(link.a),
            _ => None,
        })
    }

    /// The poses (`world_from_camera`) that the links hold, from `poses` on; the first one stays.
    pub(super) fn optimised(&self, poses: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
        let mut poses = poses.to_vec();
        for _ in 0..ROUNDS {
            let system = System::at(&self.links, &poses);
            let step = system.solve(&-&system.gradient);
            let mut most = 0.0_f64;
            for (i, pose) in poses.iter_mut().enumerate() {
                let twist: Vector6<f64> = step.fixed_rows::<6>(6 * i).into_owned();
                *pose = advance(pose, &twist);
                most = most.max(twist.norm());
            }
            if most < STILL {
                break;
            }
        }
        poses
    }

    /// Covariance of one keyframe's pose over (rotation, translation), camera frame, the first one being exact.
    pub(super) fn covariance(&self, poses: &[Isometry3<f64>], keyframe: usize) -> Matrix6<f64> {
        let system = System::at(&self.links, poses);
        let mut covariance = Matrix6::zeros();
        for axis in 0..6 {
            let mut unit = DVector::zeros(6 * poses.len());
            unit[6 * keyframe + axis] = 1.0;
            covariance.set_column(axis, &system.solve(&unit).fixed_rows::<6>(6 * keyframe));
        }
        0.5 * (covariance + covariance.transpose())
    }
}

/// The linearised problem: a diagonal block a keyframe, and one for each link.
struct System {
    diagonal: Vec<Matrix6<f64>>,
    /// Inverse of each diagonal block.
    preconditioner: Vec<Matrix6<f64>>,
    /// (row, column, block) above the diagonal.
    links: Vec<(usize, usize, Matrix6<f64>)>,
    gradient: DVector<f64>,
}

impl System {
    fn at(links: &[Link], poses: &[Isometry3<f64>]) -> Self {
        let mut diagonal = vec![Matrix6::identity() * 1e-9; poses.len()];
        diagonal[0] += Matrix6::identity() * FIXED;
        let mut gradient = DVector::zeros(6 * poses.len());
        let mut blocks = Vec::with_capacity(links.len());
        for link in links {
            let between = poses[link.a].inverse() * poses[link.b];
            let off = log(&link.a_from_b, &between);
            let squares = off.dot(&(link.information * off));
            let weighted = link.information / (1.0 + squares / CAUCHY);
            // A twist of b moves the way by itself, one of a by its reverse as b sees it.
            let of_a = -adjoint(&between.inverse());
            let carried = of_a.transpose() * weighted;
            diagonal[link.a] += carried * of_a;
            diagonal[link.b] += weighted;
            blocks.push((link.a, link.b, carried));
            let mut rows = gradient.fixed_rows_mut::<6>(6 * link.a);
            rows += carried * off;
            let mut rows = gradient.fixed_rows_mut::<6>(6 * link.b);
            rows += weighted * off;
        }
        let preconditioner = diagonal.iter().map(|d| d.try_inverse().unwrap_or_else(Matrix6::identity)).collect();
        Self { diagonal, preconditioner, links: blocks, gradient }
    }

    fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut out = DVector::zeros(x.len());
        for (i, block) in self.diagonal.iter().enumerate() {
            out.fixed_rows_mut::<6>(6 * i).copy_from(&(block * x.fixed_rows::<6>(6 * i)));
        }
        for (a, b, block) in &self.links {
            let mut rows = out.fixed_rows_mut::<6>(6 * a);
            rows += block * x.fixed_rows::<6>(6 * b);
            let mut rows = out.fixed_rows_mut::<6>(6 * b);
            rows += block.transpose() * x.fixed_rows::<6>(6 * a);
        }
        out
    }

    fn precondition(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut out = DVector::zeros(x.len());
        for (i, block) in self.preconditioner.iter().enumerate() {
            out.fixed_rows_mut::<6>(6 * i).copy_from(&(block * x.fixed_rows::<6>(6 * i)));
        }
        out
    }

    /// Conjugate gradients for `right`.
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut x = DVector::zeros(right.len());
        let mut rest = right.clone();
        let mut scaled = self.precondition(&rest);
        let mut direction = scaled.clone();
        let mut energy = rest.dot(&scaled);
        let enough = ACCURACY * ACCURACY * energy;
        for _ in 0..STEPS {
            if energy <= enough || energy == 0.0 {
                break;
            }
            let moved = self.times(&direction);
            let along = direction.dot(&moved);
            if along <= 0.0 {
                break;
            }
            let step = energy / along;
            x.axpy(step, &direction, 1.0);
            rest.axpy(-step, &moved, 1.0);
            scaled = self.precondition(&rest);
            let next = rest.dot(&scaled);
            direction = &scaled + direction * (next / energy);
            energy = next;
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::se3::exp;
    use super::*;
    use crate::view::covariance_of_prior;
    use nalgebra::Vector3;

    /// Keyframes on a circle that look outwards; the way from each to the next is measured with a constant error.
    fn circle(count: usize, drift: &Vector6<f64>) -> (Vec<Isometry3<f64>>, Vec<Isometry3<f64>>, Vec<Link>) {
        let truth: Vec<Isometry3<f64>> = (0..count)
            .map(|i| {
                let angle = std::f64::consts::TAU * i as f64 / count as f64;
                Isometry3::new(Vector3::new(angle.cos(), angle.sin(), 0.0), Vector3::new(0.0, 0.0, angle))
            })
            .collect();
        let information = covariance_of_prior(1e-3, 1e-3).try_inverse().expect("positive");
        let (mut poses, mut links) = (vec![truth[0]], Vec::new());
        for i in 1..count {
            let a_from_b = truth[i - 1].inverse() * truth[i] * exp(drift);
            poses.push(poses[i - 1] * a_from_b);
            links.push(Link { a: i - 1, b: i, a_from_b, information });
        }
        (truth, poses, links)
    }

    #[test]
    fn a_closed_loop_spreads_the_drift() {
        let (truth, poses, mut links) = circle(40, &Vector6::new(0.0, 0.0, 0.002, 0.001, 0.0, 0.0));
        let error = |poses: &[Isometry3<f64>]| {
            poses
                .iter()
                .zip(&truth)
                .map(|(p, t)| (p.translation.vector - t.translation.vector).norm())
                .fold(0.0, f64::max)
        };
        let open = error(&Graph { links: links.clone() }.optimised(&poses));
        assert!((open - error(&poses)).abs() < 1e-6, "an open chain has nothing to correct");
        let information = links[0].information;
        links.push(Link { a: 39, b: 0, a_from_b: truth[39].inverse() * truth[0], information });
        let graph = Graph { links };
        let closed = graph.optimised(&poses);
        assert!(error(&closed) < 0.35 * open, "{} of {open}", error(&closed));
        assert_eq!(closed[0], poses[0] * exp(&log(&poses[0], &closed[0])));
        assert!((closed[0].translation.vector - truth[0].translation.vector).norm() < 1e-6);
        // The far side is known worst.
        let deviation = |i: usize| graph.covariance(&closed, i)[(3, 3)].sqrt();
        assert!(deviation(20) > 2.0 * deviation(2) && deviation(2) > 5e-4, "{} {}", deviation(20), deviation(2));
    }

    #[test]
    fn a_link_that_contradicts_all_others_fades_out() {
        let (truth, poses, mut links) = circle(20, &Vector6::zeros());
        let information = links[0].information;
        for i in 2..20 {
            links.push(Link { a: i - 2, b: i, a_from_b: truth[i - 2].inverse() * truth[i], information });
        }
        links.push(Link { a: 3, b: 12, a_from_b: Isometry3::translation(0.5, 0.0, 0.0), information });
        let found = Graph { links }.optimised(&poses);
        let most = found.iter().zip(&truth).map(|(p, t)| log(t, p).norm()).fold(0.0, f64::max);
        assert!(most < 0.01, "{most}");
    }
}
