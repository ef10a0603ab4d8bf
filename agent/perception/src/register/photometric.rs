//! The photometric objective, linearised: where a view's textured points come to lie in another view's picture, it must
//! show what they show.
//!
//! The geometric objective ([`super::correspondences`]) leaves open what slides along a surface, and follows the bias of
//! the depth sensor; the picture holds both (direct alignment, [Park 2017], [Engel 2018]). A point counts where the other
//! view's own surface confirms that it sees it.

use super::into_picture::IntoPicture;
use super::model_view::ModelView;
use super::normal_equations::{BINS, Linearised, RUN, Run, Sums};
use super::texture::{TexturedPoints, ViewTexture};
use nalgebra::{Isometry3, Point3};
use semascan_geometry::vector::{cross, dot, sub};

/// Largest difference of two normalised grey values that is told apart.
pub(super) const RANGE: f32 = 4.0;

/// Which points count, and how much.
#[derive(Clone, Copy, Debug)]
pub(super) struct PhotometricGate {
    /// Level of the pyramid.
    pub(super) level: usize,
    /// Farthest that a point may lie from the surface that the other view sees in its pixel, metres.
    pub(super) distance: f32,
    /// Tukey's constant, normalised grey values.
    pub(super) tukey: f32,
}

/// Linearises the objective for `source`, whose points `target_from_source` takes to the frame of the camera that took
/// `picture` and saw `surface`; `centre` is in the source's frame.
pub(super) fn linearise(
    source: &TexturedPoints,
    picture: &ViewTexture,
    surface: &ModelView,
    target_from_source: &Isometry3<f64>,
    centre: &Point3<f64>,
    gate: &PhotometricGate,
) -> Linearised {
    let centre = target_from_source * centre;
    let about = [centre.x as f32, centre.y as f32, centre.z as f32];
    let into_target = IntoPicture::new(target_from_source, &surface.intrinsics);
    let total =
        Sums::over(source.points.len(), |range| block(source, range, picture, surface, &into_target, about, gate));
    total.finish(centre, RANGE.into())
}

/// How alike the pictures of two views are, as sums over the points that both see.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Alikeness {
    products: f64,
    squares: [f64; 2],
    points: u32,
}

impl Alikeness {
    /// The sums of both.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            products: self.products + other.products,
            squares: [self.squares[0] + other.squares[0], self.squares[1] + other.squares[1]],
            points: self.points + other.points,
        }
    }

    /// Normalised cross-correlation, -1 to 1; `None` of fewer than `fewest` points.
    pub(super) fn correlation(&self, fewest: u32) -> Option<f64> {
        (self.points >= fewest).then(|| self.products / (self.squares[0] * self.squares[1]).sqrt().max(1e-9))
    }
}

/// Compares the pictures at the level of `gate`, with the arguments of [`linearise`].
pub(super) fn compare(
    source: &TexturedPoints,
    picture: &ViewTexture,
    surface: &ModelView,
    target_from_source: &Isometry3<f64>,
    gate: &PhotometricGate,
) -> Alikeness {
    let into_target = IntoPicture::new(target_from_source, &surface.intrinsics);
    let reach = gate.distance * gate.distance;
    let mut out = Alikeness::default();
    for (point, samples) in source.points.iter().zip(&source.samples) {
        let p = into_target.place(*point);
        let Some(at) = into_target.pixel(p) else { continue };
        let q = surface.points[at];
        let d = sub(p, q);
        if q[2] <= 0.0 || dot(d, d) > reach {
            continue;
        }
        let Some(sample) = picture.picture.at(gate.level, p) else { continue };
        let (a, b) = (f64::from(samples[gate.level].value), f64::from(sample.value));
        out.products += a * b;
        out.squares = [out.squares[0] + a * a, out.squares[1] + b * b];
        out.points += 1;
    }
    out
}

fn block(
    source: &TexturedPoints,
    range: std::ops::Range<usize>,
    picture: &ViewTexture,
    surface: &ModelView,
    into_target: &IntoPicture,
    centre: [f32; 3],
    gate: &PhotometricGate,
) -> Sums {
    let mut sums = Sums::default();
    let (reach, outside) = (gate.distance * gate.distance, f64::from(gate.tukey * gate.tukey));
    let mut run = Run::default();
    for i in range {
        if i % RUN == 0 {
            run.end(&mut sums.of_runs);
        }
        sums.cost += outside;
        let p = into_target.place(source.points[i]);
        // Seen by the other camera, and not hidden behind something nearer.
        let Some(at) = into_target.pixel(p) else { continue };
        let q = surface.points[at];
        let d = sub(p, q);
        if q[2] <= 0.0 || dot(d, d) > reach {
            continue;
        }
        let Some(sample) = picture.picture.at(gate.level, p) else { continue };
        let own = &source.samples[i][gate.level];
        let r = sample.value - own.value;
        sums.pairs += 1;
        sums.histogram[((r.abs() * (BINS as f32 / RANGE)) as usize).min(BINS - 1)] += 1;
        let x = r / gate.tukey;
        if x.abs() >= 1.0 {
            continue;
        }
        let w = (1.0 - x * x) * (1.0 - x * x);
        // The mean of both gradients, as with the normals of surfaces: exact to second order ([Benhimane 2004]).
        let turned = into_target.turn(own.gradient);
        let n: [f32; 3] = std::array::from_fn(|a| 0.5 * (turned[a] + sample.gradient[a]));
        let turn = cross(sub(p, centre), n);
        sums.push(&[turn[0], turn[1], turn[2], n[0], n[1], n[2]], w, r, outside);
        run.push(f64::from(r));
    }
    run.end(&mut sums.of_runs);
    sums
}
