//! Which photographs are best for a camera: first the one that shows most of what is seen best, then those that add most to it.

use crate::render::photograph_camera::PhotographCamera;
use glam::Vec3;

/// A choice ends where another photograph adds less than this share to what the first ones are worth.
const LEAST_GAIN: f32 = 1e-3;

/// A photograph that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Number of its view.
    pub(super) view: u32,
    /// Its camera.
    pub(super) camera: PhotographCamera,
    /// How good its pixels are against those of others, 0..=1.
    pub(super) quality: f32,
}

/// A place on the surface, table frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) place: Vec3,
    pub(super) normal: Vec3,
}

/// What a photograph is worth at a place that is looked at from `eye`: its pixels there, and from how near the same direction it
/// was taken. `layer_worth` in photo_layers.wgsl is the same rule, but for what hides the place. 0 where it does not show it.
fn worth(candidate: &Candidate, sample: &Sample, eye: Vec3) -> f32 {
    let camera = &candidate.camera;
    let Some((_, distance)) = camera.project(sample.place) else { return 0.0 };
    let toward = (camera.eye() - sample.place).normalize_or_zero();
    let facing = toward.dot(sample.normal);
    if facing < 0.08 {
        return 0.0;
    }
    let density = (camera.focal.x * camera.focal.y * facing).sqrt() / distance;
    let closeness = 0.5 + 0.5 * toward.dot((eye - sample.place).normalize_or_zero());
    // Any photograph is better than none.
    candidate.quality * density * (0.1 + 0.9 * closeness.max(0.0).powi(8))
}

/// The places in `candidates` of at most `most` photographs, those that matter most first.
///
/// * `samples`: what is seen of the surface from `eye`.
/// * `is_seen`: whether nothing hides a sample from a candidate, by their places.
pub(super) fn choose(
    candidates: &[Candidate],
    samples: &[Sample],
    is_seen: impl Fn(usize, usize) -> bool,
    eye: Vec3,
    most: usize,
) -> Vec<usize> {
    let of_candidate = |c: usize| {
        let all = samples.iter().enumerate();
        all.map(|(s, sample)| if is_seen(c, s) { worth(&candidates[c], sample, eye) } else { 0.0 }).collect()
    };
    let worths: Vec<Vec<f32>> = (0..candidates.len()).map(of_candidate).collect();
    let mut best = vec![0.0_f32; samples.len()];
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let gain = |c: usize| worths[c].iter().zip(&best).map(|(worth, best)| (worth - best).max(0.0)).sum::<f32>();
        let left = (0..candidates.len()).filter(|c| !chosen.contains(c)).map(|c| (c, gain(c)));
        let Some((c, gain)) = left.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if gain <= LEAST_GAIN * best.iter().sum::<f32>() {
            break;
        }
        best.iter_mut().zip(&worths[c]).for_each(|(best, worth)| *best = best.max(*worth));
        chosen.push(c);
    }
    chosen
}

/// How good the pixels of a photograph are: those across it as a share of those that there is room for, and what blur leaves of them.
pub(super) fn quality(resolution: f32, sharp: f32) -> f32 {
    resolution.clamp(0.05, 1.0) * sharp
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_protocol::{Intrinsics, Pose};

    /// A camera at `eye` that looks straight down.
    fn down(view: u32, eye: [f64; 3], quality: f32) -> Candidate {
        let pose = Pose { qx: 1.0, tx: eye[0], ty: eye[1], tz: eye[2], ..Pose::default() };
        let intrinsics = Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5 };
        Candidate { view, camera: PhotographCamera::from_wire(&pose, &intrinsics).expect("a camera"), quality }
    }

    /// A square of the table.
    fn square(center: f32) -> Vec<Sample> {
        let side = |i: i32| (i % 5 - 2) as f32 * 0.01;
        let place = |i: i32| Vec3::new(center + side(i), side(i / 5), 0.0);
        (0..25).map(|i| Sample { place: place(i), normal: Vec3::Z }).collect()
    }

    fn chosen(candidates: &[Candidate], samples: &[Sample], eye: Vec3, most: usize) -> Vec<u32> {
        choose(candidates, samples, |_, _| true, eye, most).iter().map(|c| candidates[*c].view).collect()
    }

    #[test]
    fn the_photograph_from_where_one_looks_comes_first() {
        let all = [down(0, [0.1, 0.0, 0.5], 1.0), down(1, [0.0, 0.0, 0.5], 1.0), down(2, [-0.2, 0.0, 0.5], 1.0)];
        assert_eq!(chosen(&all, &square(0.0), Vec3::new(0.0, 0.0, 0.6), 1), [1]);
        assert_eq!(chosen(&all, &square(0.0), Vec3::new(-0.25, 0.0, 0.5), 1), [2]);
        assert!(chosen(&all, &[], Vec3::Z, 4).is_empty(), "nothing is seen");
        assert!(chosen(&[], &square(0.0), Vec3::Z, 4).is_empty());
    }

    #[test]
    fn the_next_one_adds_what_the_first_does_not_show() {
        // Two patches, of which no camera sees both; the second camera is a twin of the first.
        let all = [down(0, [0.0, 0.0, 0.5], 1.0), down(1, [0.005, 0.0, 0.5], 1.0), down(2, [1.0, 0.0, 0.6], 1.0)];
        let samples: Vec<Sample> = square(0.0).into_iter().chain(square(1.0)).collect();
        let first_two = chosen(&all, &samples, Vec3::new(0.3, 0.0, 2.0), 2);
        assert!(first_two.contains(&2) && first_two.len() == 2, "{first_two:?}");
        let hidden = choose(&all, &samples, |c, _| c == 2, Vec3::new(0.3, 0.0, 2.0), 3);
        assert_eq!(hidden, [2], "what hides the surface from the others leaves them out");
    }

    #[test]
    fn a_blurred_photograph_is_chosen_last() {
        let eye = Vec3::new(0.0, 0.0, 0.5);
        let all = [down(0, [0.0, 0.0, 0.5], 0.3), down(1, [0.03, 0.0, 0.5], 1.0)];
        assert_eq!(chosen(&all, &square(0.0), eye, 1), [1]);
        assert_eq!((quality(0.25, 1.0), quality(2.0, 0.5), quality(0.0, 1.0)), (0.25, 0.5, 0.05));
    }
}
