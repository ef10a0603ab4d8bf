//! Where a corner of one view is in another: normalised cross-correlation [Lewis 1995] of the patch around it, warped as
//! the surface's tangent plane and the cameras have it, from coarse to fine, to a fraction of a pixel by a parabola.
//!
//! A place is believed where it stands out among all others that were searched (the ratio test of [Lowe 2004], on
//! dissimilarities) and where the way back leads to the corner again.

use super::picture::{Corner, Grey, JudgedPicture, on_plane};
use crate::view::Intrinsics;
use nalgebra::{Isometry3, Matrix2, Point3, Vector2};
use semascan_geometry::vector::dot;

/// How far from where the poses put it a corner is searched for, pixels of the coarsest picture.
pub(super) const RADIUS: usize = 8;
/// Half a patch in the coarsest picture, pixels.
const COARSE: usize = 4;
/// Half a patch in finer ones.
const FINE: usize = 6;
/// How far a place may move from one picture to the next finer one, pixels.
const STEP: usize = 2;
/// Least correlation in the coarsest picture, and in the finest.
const LEAST: (f32, f32) = (0.75, 0.8);
/// Largest dissimilarity (1 - correlation) of the best place, as a share of that of the next best.
const RATIO: f32 = 0.75;
/// How far the way back may miss the corner, pixels of the coarsest picture.
const BACK: f64 = 0.7;
/// Least standard deviation of a patch, grey values.
const CONTRAST: f32 = 3.0;
/// Largest factor by which the warp may stretch or shrink a patch.
const STRETCH: f64 = 2.5;
/// A corner that the poses move by more than this, but that looks the same at its old place, stands still with the
/// camera: pixels of the coarsest picture, and the correlation there.
const STILL: (f64, f32) = (4.0, 0.9);

/// What became of a corner that was searched for.
pub(super) enum Found {
    /// Its place in the other picture, full resolution.
    At([f64; 2]),
    /// It stands still with the camera: it is not part of what the poses speak of.
    Still,
    /// Nothing like it was found, or too much.
    Nowhere,
}

/// Where `camera_b` sees a point of the first camera; `None` behind it.
pub(super) fn carried(camera_b: &Intrinsics, b_from_a: &Isometry3<f64>, point: [f64; 3]) -> Option<[f64; 2]> {
    camera_b.project(&(b_from_a * Point3::from(point))).map(|(u, v)| [u, v])
}

/// Searches `b` for a corner of `a`, around where each of `b_from_a` puts it.
pub(super) fn find(corner: &Corner, a: &JudgedPicture, b: &JudgedPicture, b_from_a: &[Isometry3<f64>]) -> Found {
    let coarsest = a.levels.len().min(b.levels.len()) - 1;
    let scale = f64::from(1_u32 << coarsest);
    let Some(first) = b_from_a.first() else { return Found::Nowhere };
    let Some(warp) = Warp::new(corner, a, b, first) else { return Found::Nowhere };
    let own = at_level(corner.pixel, coarsest);
    let mut centres: Vec<[f64; 2]> = Vec::new();
    for pose in b_from_a {
        let Some(centre) = carried(&b.camera, pose, corner.point) else { continue };
        let centre = at_level(centre, coarsest);
        if centres.iter().all(|other| distance(*other, centre) > 0.5 * RADIUS as f64) {
            centres.push(centre);
        }
    }
    let (grey_a, grey_b) = (&a.levels[coarsest], &b.levels[coarsest]);
    let Some(patch) = Patch::new::<COARSE>(grey_a, own, &warp.a_from_b) else { return Found::Nowhere };
    let scores: Vec<Scores> = centres.iter().map(|centre| Scores::new(&patch, grey_b, *centre, RADIUS)).collect();
    let Some(best) = scores.iter().filter_map(Scores::best).max_by(|p, q| p.score.total_cmp(&q.score)) else {
        return Found::Nowhere;
    };
    // What is carried far, but is seen where it was, moves with the camera.
    if centres.iter().all(|centre| distance(*centre, own) > STILL.0)
        && let Some(unmoved) = Patch::new::<COARSE>(grey_a, own, &Matrix2::identity())
        && let Some(place) = Scores::new(&unmoved, grey_b, own, STEP).best()
        && place.score > STILL.1
        && place.score >= best.score
    {
        return Found::Still;
    }
    let next = scores.iter().map(|s| s.best_away_from(&best)).fold(0.0, f32::max);
    if best.score < LEAST.0 || 1.0 - best.score > RATIO * (1.0 - next) {
        return Found::Nowhere;
    }
    let Some(mut place) = best.refined else { return Found::Nowhere };
    let Some(returning) = Patch::new::<COARSE>(grey_b, place, &warp.b_from_a) else { return Found::Nowhere };
    let back = Scores::new(&returning, grey_a, own, RADIUS).best().and_then(|peak| peak.refined);
    if back.is_none_or(|back| distance(back, own) > BACK) {
        return Found::Nowhere;
    }
    // The same place in finer and finer pictures.
    let mut score = best.score;
    for level in (0..coarsest).rev() {
        let finer = place.map(|c| 2.0 * c + 0.5);
        let patch = Patch::new::<FINE>(&a.levels[level], at_level(corner.pixel, level), &warp.a_from_b);
        let peak = patch.and_then(|patch| Scores::new(&patch, &b.levels[level], finer, STEP).best());
        let Some((refined, found)) = peak.and_then(|peak| Some((peak.refined?, peak.score))) else {
            return Found::Nowhere;
        };
        (place, score) = (refined, found);
    }
    let in_reach = centres.iter().any(|centre| {
        let full = centre.map(|c| (c + 0.5) * scale - 0.5);
        distance(full, place) <= RADIUS as f64 * scale
    });
    if score >= LEAST.1 && in_reach { Found::At(place) } else { Found::Nowhere }
}

/// A pixel of the full picture in the picture at `level`.
fn at_level(pixel: [f64; 2], level: usize) -> [f64; 2] {
    let scale = f64::from(1_u32 << level);
    pixel.map(|c| (c + 0.5) / scale - 0.5)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// How the picture of a small piece of surface changes from one view to the other, to first order.
struct Warp {
    b_from_a: Matrix2<f64>,
    a_from_b: Matrix2<f64>,
}

impl Warp {
    /// `None` where it would stretch or shrink too much.
    fn new(corner: &Corner, a: &JudgedPicture, b: &JudgedPicture, b_from_a: &Isometry3<f64>) -> Option<Self> {
        let offset = dot(corner.point, corner.normal);
        let moved = |x: f64, y: f64| {
            let pixel = [corner.pixel[0] + x, corner.pixel[1] + y];
            let at = carried(&b.camera, b_from_a, on_plane(&a.camera, pixel, offset, corner.normal)?)?;
            Some(Vector2::from(at))
        };
        let columns = [moved(1.0, 0.0)? - moved(-1.0, 0.0)?, moved(0.0, 1.0)? - moved(0.0, -1.0)?];
        let b_from_a = Matrix2::from_columns(&columns) * 0.5;
        let stretch = b_from_a.singular_values();
        let within = stretch.iter().all(|s| (1.0 / STRETCH..=STRETCH).contains(s));
        Some(Self { b_from_a, a_from_b: b_from_a.try_inverse().filter(|_| within)? })
    }
}

/// A patch to be searched for: grey values less their mean, of length 1.
struct Patch {
    half: usize,
    values: Vec<f32>,
}

impl Patch {
    /// The square of half edge `HALF` whose pixel `d` is at `centre + warp d` of `grey`; `None` at the border of the picture
    /// or without contrast.
    fn new<const HALF: usize>(grey: &Grey, centre: [f64; 2], warp: &Matrix2<f64>) -> Option<Self> {
        let half = HALF as i32;
        let mut values = Vec::with_capacity((2 * HALF + 1) * (2 * HALF + 1));
        for y in -half..=half {
            for x in -half..=half {
                let d = warp * Vector2::new(f64::from(x), f64::from(y));
                values.push(grey.at(centre[0] + d.x, centre[1] + d.y)?);
            }
        }
        let count = values.len() as f32;
        let mean = values.iter().sum::<f32>() / count;
        values.iter_mut().for_each(|v| *v -= mean);
        let length = values.iter().map(|v| v * v).sum::<f32>().sqrt();
        if length < CONTRAST * count.sqrt() {
            return None;
        }
        values.iter_mut().for_each(|v| *v /= length);
        Some(Self { half: HALF, values })
    }
}

/// A place where a patch fits best.
#[derive(Clone, Copy)]
struct Peak {
    /// The pixel.
    pixel: [i64; 2],
    /// Correlation, -1 to 1.
    score: f32,
    /// To a fraction of a pixel; `None` at the border of what was searched.
    refined: Option<[f64; 2]>,
}

/// Correlation of a patch with each place in a square.
struct Scores {
    /// The first place: column, row.
    first: [i64; 2],
    /// Places across and down.
    across: usize,
    /// Row-major; -1 where the patch would leave the picture or there is no contrast.
    values: Vec<f32>,
}

impl Scores {
    /// Places up to `radius` pixels from `centre`.
    fn new(patch: &Patch, grey: &Grey, centre: [f64; 2], radius: usize) -> Self {
        let across = 2 * radius + 1;
        let first = centre.map(|c| c.round() as i64 - radius as i64);
        let mut scores = Self { first, across, values: vec![-1.0; across * across] };
        let half = patch.half as i64;
        let edge = 2 * patch.half + 1;
        let count = (edge * edge) as f32;
        // Columns whose patch lies in the picture.
        let from = (half - first[0]).clamp(0, across as i64) as usize;
        let to = (grey.width as i64 - half - first[0]).clamp(0, across as i64) as usize;
        if from >= to {
            return scores;
        }
        let places = to - from;
        let (mut product, mut sum, mut square) = (vec![0.0_f32; places], vec![0.0_f32; places], vec![0.0_f32; places]);
        let mut line = vec![0.0_f32; places + edge - 1];
        for row in 0..across {
            let middle = first[1] + row as i64;
            if middle < half || middle + half >= grey.height as i64 {
                continue;
            }
            product.fill(0.0);
            sum.fill(0.0);
            square.fill(0.0);
            let left = (first[0] + from as i64 - half) as usize;
            for (y, weights) in patch.values.chunks_exact(edge).enumerate() {
                let start = (middle - half) as usize * grey.width + y * grey.width + left;
                for (value, grey) in line.iter_mut().zip(&grey.values[start..]) {
                    // About the middle grey, so that squares stay small.
                    *value = f32::from(*grey) - 128.0;
                }
                for (x, weight) in weights.iter().enumerate() {
                    let shifted = &line[x..x + places];
                    for (i, value) in shifted.iter().enumerate() {
                        product[i] += weight * value;
                        sum[i] += value;
                        square[i] += value * value;
                    }
                }
            }
            for i in 0..places {
                let deviation = (square[i] - sum[i] * sum[i] / count).max(0.0);
                if deviation >= count * CONTRAST * CONTRAST {
                    scores.values[row * across + from + i] = product[i] / deviation.sqrt();
                }
            }
        }
        scores
    }

    /// The best place; `None` where there is none at all.
    fn best(&self) -> Option<Peak> {
        let (at, score) =
            self.values.iter().copied().enumerate().max_by(|p, q| p.1.total_cmp(&q.1).then(q.0.cmp(&p.0)))?;
        let (row, column) = (at / self.across, at % self.across);
        let pixel = [self.first[0] + column as i64, self.first[1] + row as i64];
        let inside = |c: usize| c > 0 && c + 1 < self.across;
        let refined = (score > -1.0 && inside(row) && inside(column)).then(|| {
            let of = |step: usize| vertex(self.values[at - step], score, self.values[at + step]);
            [pixel[0] as f64 + of(1), pixel[1] as f64 + of(self.across)]
        });
        (score > -1.0).then_some(Peak { pixel, score, refined })
    }

    /// The largest correlation farther than half a patch from `peak`; 0 where there is none.
    fn best_away_from(&self, peak: &Peak) -> f32 {
        let mut best = 0.0_f32;
        for (at, score) in self.values.iter().enumerate() {
            let column = self.first[0] + (at % self.across) as i64 - peak.pixel[0];
            let row = self.first[1] + (at / self.across) as i64 - peak.pixel[1];
            if column.abs().max(row.abs()) > COARSE as i64 {
                best = best.max(*score);
            }
        }
        best
    }
}

/// Where the parabola through the values at -1, 0 and 1 is largest.
fn vertex(before: f32, at: f32, after: f32) -> f64 {
    let curvature = f64::from(before) + f64::from(after) - 2.0 * f64::from(at);
    if curvature >= 0.0 {
        return 0.0;
    }
    (0.5 * (f64::from(before) - f64::from(after)) / curvature).clamp(-0.5, 0.5)
}
