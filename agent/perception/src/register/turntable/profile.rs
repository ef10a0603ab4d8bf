//! How well two views agree when the disc has turned between them by each angle: by geometry and colour of what turns.
//!
//! A point of the one view, turned, must lie on the surface that the other sees there. One that would be seen but is not,
//! because something farther is seen at its place, contradicts; one that something nearer hides says nothing. The disc's
//! own plane looks the same at every angle and has no say in the geometry. Grey values are compared where surfaces
//! agree, by their normalised cross-correlation.

use super::Axis;
use super::plane::Stage;
use super::thinned::TurningView;
use nalgebra::Point3;

/// Angles of a profile.
pub(super) const ANGLES: usize = 180;
/// Radians between two of them.
pub(super) const ANGLE_STEP: f64 = std::f64::consts::TAU / ANGLES as f64;
/// Depths that differ by less are of one surface: metres and a share of the depth.
const TOLERANCE: (f64, f64) = (0.003, 0.006);
/// Metres above the plane up to which a point is of the disc.
const OF_DISC: f64 = 0.007;
/// Share of a view's points whose evidence counts as little.
const LITTLE: f64 = 0.15;
/// Weights of the pictures of part and disc beside the surfaces.
const COLOUR: (f64, f64) = (1.0, 0.7);

/// A point of what turns, as one view saw it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning {
    pub(super) point: Point3<f64>,
    pub(super) grey: f32,
    /// Whether it is of the disc's plane.
    pub(super) of_disc: bool,
}

/// The points of `view` where the stage changes, within `widened` times its radius of its axis; at most `most`, evenly
/// chosen.
pub(super) fn turning_points(view: &TurningView, stage: &Stage, widened: f64, most: usize) -> Vec<Turning> {
    let width = view.camera.width as usize;
    let mut all = Vec::new();
    let labelled = view.part.iter().any(|p| *p);
    for (i, z) in view.depth.iter().enumerate().filter(|(i, z)| **z > 0.0 && stage.changes[*i]) {
        let point = view.camera.unproject((i % width) as f64, (i / width) as f64, f64::from(*z));
        let (h, r) = stage.axis.height_and_radius(&point);
        let of_disc = h < OF_DISC;
        if h < -0.6 * OF_DISC
            || h > stage.height
            || r > stage.radius * widened
            || (labelled && !of_disc && !view.part[i])
        {
            continue;
        }
        all.push(Turning { point, grey: view.grey[i], of_disc });
    }
    // Each has its own share, or a large disc would leave the part no say.
    let (disc, part): (Vec<Turning>, Vec<Turning>) = all.into_iter().partition(|p| p.of_disc);
    let of_disc = most.saturating_sub(part.len()).clamp(most / 3, most).min(disc.len());
    let mut out = evenly(&part, most - of_disc);
    out.extend(evenly(&disc, of_disc));
    out
}

/// At most `most` of the points: steps that are no whole number tie to no row of the picture.
fn evenly(points: &[Turning], most: usize) -> Vec<Turning> {
    let step = points.len() as f64 / most.max(1) as f64;
    if step <= 1.0 {
        return points.to_vec();
    }
    (0..most).map(|k| points[(k as f64 * step) as usize]).collect()
}

/// What one direction of a comparison found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreement {
    same: f64,
    /// Of these, less for what lies apart.
    close: f64,
    through: f64,
    of_part: f64,
    part: Correlation,
    disc: Correlation,
}

/// Sums over points of the same surface, for the correlation of their grey values.
#[derive(Clone, Copy, Debug, Default)]
struct Correlation {
    products: f64,
    squares: (f64, f64),
    compared: f64,
    points: f64,
}

impl Correlation {
    fn and(self, other: Self) -> Self {
        Self {
            products: self.products + other.products,
            squares: (self.squares.0 + other.squares.0, self.squares.1 + other.squares.1),
            compared: self.compared + other.compared,
            points: self.points + other.points,
        }
    }

    /// Normalised cross-correlation; less where few points could be compared.
    fn value(&self) -> f64 {
        let correlation = self.products / (self.squares.0 * self.squares.1).sqrt().max(1e-6);
        correlation * self.compared / (self.compared + LITTLE * self.points).max(1.0)
    }
}

impl Agreement {
    /// Both directions together.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            same: self.same + other.same,
            close: self.close + other.close,
            through: self.through + other.through,
            of_part: self.of_part + other.of_part,
            part: self.part.and(other.part),
            disc: self.disc.and(other.disc),
        }
    }

    /// From -1 to 1 and the sum of [`COLOUR`].
    pub(super) fn score(&self) -> f64 {
        let geometry = (self.close - self.through) / (self.same + self.through + LITTLE * self.of_part).max(1.0);
        geometry + COLOUR.0 * self.part.value() + COLOUR.1 * self.disc.value()
    }
}

/// Compares the points of one view, turned by `angle`, with another.
pub(super) fn compare(points: &[Turning], other: &TurningView, changes: &[bool], axis: &Axis, angle: f64) -> Agreement {
    let turn = axis.turned(angle);
    let rotation = turn.rotation.to_rotation_matrix();
    let camera = &other.camera;
    let mut out = Agreement::default();
    for p in points {
        let picture = if p.of_disc { &mut out.disc } else { &mut out.part };
        picture.points += 1.0;
        let q = rotation * p.point + turn.translation.vector;
        out.of_part += f64::from(u8::from(!p.of_disc));
        let Some((u, v)) = camera.project(&q) else { continue };
        let Some(i) = camera.pixel(u, v) else { continue };
        let z = f64::from(other.depth[i]);
        if z <= 0.0 {
            continue;
        }
        let tolerance = TOLERANCE.0 + TOLERANCE.1 * q.z;
        if z > q.z + tolerance {
            out.through += f64::from(u8::from(!p.of_disc));
        } else if z > q.z - tolerance && changes[i] {
            if !p.of_disc {
                out.same += 1.0;
                out.close += 1.0 - ((z - q.z) / tolerance).powi(2);
            }
            let (a, b) = (f64::from(p.grey), f64::from(other.grey_at(u, v)));
            picture.products += a * b;
            picture.squares = (picture.squares.0 + a * a, picture.squares.1 + b * b);
            picture.compared += 1.0;
        }
    }
    out
}

/// Scores of the turn about the axis of `stage` from view `a` to view `b` by each of [`ANGLES`] angles, from 0 on.
pub(super) fn profile(
    (a, points_a): (&TurningView, &[Turning]),
    (b, points_b): (&TurningView, &[Turning]),
    changes: &[bool],
    axis: &Axis,
) -> Vec<f32> {
    let score = |k: usize| pair_score((a, points_a), (b, points_b), changes, axis, k as f64 * ANGLE_STEP) as f32;
    (0..ANGLES).map(score).collect()
}

/// Score of the turn from view `a` to view `b` by `angle`.
pub(super) fn pair_score(
    (a, points_a): (&TurningView, &[Turning]),
    (b, points_b): (&TurningView, &[Turning]),
    changes: &[bool],
    axis: &Axis,
    angle: f64,
) -> f64 {
    compare(points_a, b, changes, axis, angle).and(compare(points_b, a, changes, axis, -angle)).score()
}

/// A profile's value between its angles.
pub(super) fn value_at(profile: &[f32], angle: f64) -> f64 {
    let at = (angle / ANGLE_STEP).rem_euclid(ANGLES as f64);
    let (k, a) = (at as usize % ANGLES, at.fract());
    f64::from(profile[k]) * (1.0 - a) + f64::from(profile[(k + 1) % ANGLES]) * a
}

/// The value that `share` of the values do not exceed; `None` of none.
pub(super) fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    Some(*values.select_nth_unstable_by((last as f64 * share) as usize, f64::total_cmp).1)
}
