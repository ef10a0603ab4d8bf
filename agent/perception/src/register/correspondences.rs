//! Projective association and the symmetric point-to-plane objective, linearised.
//!
//! A source point is projected into the target's picture and paired with what that pixel shows: one look-up, no search
//! tree ([Blais 1995]; [Newcombe 2011]). Residual `r = n.(p - q)` with `n` the mean of both normals
//! [Rusinkiewicz 2019]: exact for pairs on a common circle, so coarse pairs still pull right. Residuals are f32, sums
//! f64 and centred on the object: a rotation about a camera half a metre away would drown.

use super::into_picture::IntoPicture;
use super::model_view::ModelView;
use super::normal_equations::{BINS, Linearised, RUN, Run, Sums};
use super::source_points::SourcePoints;
use nalgebra::{Isometry3, Point3};
use semascan_geometry::vector::{cross, dot, sub};

/// Pixels of a picture that share their error at least: smoothed depth, normals and silhouettes err alike over the window
/// that they are computed from, which residuals that are small do not show.
const PATCH: f64 = 25.0;

/// Which pairs count, and how much.
#[derive(Clone, Copy, Debug)]
pub struct Gate {
    /// Longest pair, metres.
    pub distance: f32,
    /// Smallest cosine between the normals.
    pub cosine: f32,
    /// Tukey's constant: pairs with a larger residual do not count, metres.
    pub tukey: f32,
    /// Only pairs of one component class count, where both have one.
    pub same_label: bool,
}

/// Linearises the objective for `source`, whose points `target_from_source` takes to the target's camera frame;
/// `centre` is in the source's frame.
pub fn linearise(
    source: &SourcePoints,
    target: &ModelView,
    target_from_source: &Isometry3<f64>,
    centre: &Point3<f64>,
    gate: &Gate,
) -> Linearised {
    let centre = target_from_source * centre;
    let pairing = Pairing::new(target, target_from_source, &centre, gate);
    let total = Sums::over(source.len(), |range| pairing.block(source, range));
    let mut linearised = total.finish(centre, gate.distance.into());
    linearised.correlation = linearised.correlation.max(PATCH / source.pixels_per_point);
    linearised
}

/// What is the same for all points.
struct Pairing<'a> {
    target: &'a ModelView,
    into_target: IntoPicture,
    centre: [f32; 3],
    gate: &'a Gate,
}

impl<'a> Pairing<'a> {
    fn new(target: &'a ModelView, target_from_source: &Isometry3<f64>, centre: &Point3<f64>, gate: &'a Gate) -> Self {
        Self {
            target,
            into_target: IntoPicture::new(target_from_source, &target.intrinsics),
            centre: [centre.x as f32, centre.y as f32, centre.z as f32],
            gate,
        }
    }

    fn block(&self, source: &SourcePoints, range: std::ops::Range<usize>) -> Sums {
        let mut sums = Sums::default();
        let (reach, tukey) = (self.gate.distance * self.gate.distance, self.gate.tukey);
        let outside = f64::from(tukey * tukey);
        let bin = BINS as f32 / self.gate.distance;
        let mut run = Run::default();
        for i in range {
            if i % RUN == 0 {
                run.end(&mut sums.of_runs);
            }
            sums.cost += outside;
            let p = self.into_target.place(source.points[i]);
            let Some(at) = self.into_target.pixel(p) else { continue };
            let q = self.target.points[at];
            if q[2] <= 0.0 {
                continue;
            }
            let d = sub(p, q);
            let certainty = source.certainty.get(i).copied().unwrap_or(1.0);
            if dot(d, d) * certainty * certainty > reach {
                continue;
            }
            let (np, nq) = (self.into_target.turn(source.normals[i]), self.target.normals[at]);
            if dot(np, nq) < self.gate.cosine {
                continue;
            }
            if self.gate.same_label {
                let (a, b) = (source.labels[i], self.target.labels[at]);
                if a != b && a != 0 && b != 0 {
                    continue;
                }
            }
            let n: [f32; 3] = std::array::from_fn(|a| 0.5 * certainty * (np[a] + nq[a]));
            let r = dot(n, d);
            sums.pairs += 1;
            sums.histogram[((r.abs() * bin) as usize).min(BINS - 1)] += 1;
            let x = r / tukey;
            if x.abs() >= 1.0 {
                continue;
            }
            let w = (1.0 - x * x) * (1.0 - x * x);
            // Both sides turn half of the way about the centre: the arm is that of the pair's middle.
            let m: [f32; 3] = std::array::from_fn(|a| 0.5 * (p[a] + q[a]) - self.centre[a]);
            let turn = cross(m, n);
            let j = [turn[0], turn[1], turn[2], n[0], n[1], n[2]];
            sums.push(&j, w, r, outside);
            run.push(f64::from(r));
        }
        run.end(&mut sums.of_runs);
        sums
    }
}
