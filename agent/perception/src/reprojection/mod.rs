//! How well poses agree with the pictures, without any truth: corners of one view are carried into another by its depth and
//! the poses, and searched for there; the distance in pixels between where they should be and where they are.
//!
//! Registration aligns surfaces and whole pictures on a coarse grid; this compares single places at full resolution, and
//! each only where its match is beyond doubt. Pictures err otherwise than depth does, so that a bias of the depth sensor
//! that pulls all views alike shows here. What the figure cannot tell apart: errors of the camera's calibration, and
//! highlights that move over a shiny part as it turns under the light.
//!
//! The figure is the mean over pairs of views of the median over a pair's matches. A view pair counts with enough matches
//! only, and with too few in all nothing is known.

mod corners;
mod matching;
mod picture;

pub use picture::JudgedPicture;

use matching::{Found, carried, find};
use nalgebra::{Isometry3, Point3, Vector3};
use picture::Corner;
use rayon::prelude::*;
use semascan_geometry::vector::dot;

/// Most pairs of views that are compared: more take evenly from all that overlap.
const MOST_PAIRS: usize = 60;
/// Most corners of a pair that are searched for.
const MOST_SEARCHED: usize = 60;
/// Fewest corners that both views of a pair see.
const FEWEST_SEEN: usize = 15;
/// Fewest matches of a pair that counts.
const FEWEST_OF_PAIR: usize = 10;
/// Fewest matches of all pairs that count for the figure to be known.
const FEWEST: usize = 30;
/// How far in depth a corner may be from what the other view measured there, as a share of the distance.
const HIDDEN: f64 = 0.02;
/// Least cosine of the angle between the lines of sight of both views: patches change too much beyond.
const TURNED: f64 = 0.7;
/// Least cosine between line of sight and normal in the other view.
const OBLIQUE: f64 = 0.3;
/// Most pictures that a [`Pictures`] keeps.
const MOST_PICTURES: usize = 32;

/// How to read the figures of [`ReprojectionReport`].
pub const CONVENTION: &str = "corners of one view, carried into another by depth and poses, against where normalised \
     cross-correlation finds them there: median over the matches of a pair of views, mean over the pairs, pixels of the \
     full picture; matches are searched for around the estimated and the kinematic place and count where they are unique \
     and hold both ways; pairs with fewer than 10 matches do not count, and fewer than 30 matches in all are no figure";

/// How well poses agree with the pictures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReprojectionReport {
    /// Views that were compared.
    pub views: usize,
    /// Pairs of views that were compared because they see common ground.
    pub compared: usize,
    /// Of these: pairs with enough matches, which count.
    pub pairs: usize,
    /// Corners that were searched for.
    pub searched: usize,
    /// Of these: corners that stand still with the camera, which do not count.
    pub still: usize,
    /// Matches of the pairs that count.
    pub matches: usize,
    /// For each set of poses the mean over pairs of the median distance in pixels; `None` where too few matches were found.
    pub errors: Vec<Option<f64>>,
}

impl ReprojectionReport {
    /// Why nothing is known; `None` where it is.
    pub fn unknown(&self) -> Option<&'static str> {
        if self.matches >= FEWEST {
            None
        } else if self.views < 2 {
            Some("fewer than two views")
        } else if self.compared == 0 {
            Some("no two views with enough corners in common")
        } else if 2 * self.still > self.searched {
            Some("most of what has texture stands still with the camera")
        } else {
            Some("too few places were found again: too little texture, or the poses are far off")
        }
    }
}

/// Judges sets of poses of the same `pictures`, all on the same matches. Each set has one `table_from_camera` a picture;
/// corners are searched for around where each set puts them, so that none is favoured. Sets of another length are not
/// judged.
pub fn judge(pictures: &[&JudgedPicture], sets: &[&[Isometry3<f64>]]) -> ReprojectionReport {
    let usable: Vec<usize> = (0..sets.len()).filter(|&s| sets[s].len() == pictures.len()).collect();
    let mut report =
        ReprojectionReport { views: pictures.len(), errors: vec![None; sets.len()], ..ReprojectionReport::default() };
    let Some(&first) = usable.first() else { return report };
    let mut pairs = overlapping(pictures, sets[first]);
    if pairs.len() > MOST_PAIRS {
        let all = pairs.len();
        pairs = (0..MOST_PAIRS).map(|k| std::mem::take(&mut pairs[k * all / MOST_PAIRS])).collect();
    }
    report.compared = pairs.len();
    let compared: Vec<PairReport> = pairs
        .par_iter()
        .map(|pair| {
            let b_from_a: Vec<_> = usable.iter().map(|&s| sets[s][pair.b].inverse() * sets[s][pair.a]).collect();
            compare(pair, pictures[pair.a], pictures[pair.b], &b_from_a)
        })
        .collect();
    let mut sums = vec![0.0; usable.len()];
    for pair in compared {
        report.searched += pair.searched;
        report.still += pair.still;
        if pair.distances.len() < FEWEST_OF_PAIR {
            continue;
        }
        report.pairs += 1;
        report.matches += pair.distances.len();
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += median(pair.distances.iter().map(|d| d[k]).collect());
        }
    }
    if report.matches >= FEWEST {
        for (&set, sum) in usable.iter().zip(sums) {
            report.errors[set] = Some(sum / report.pairs as f64);
        }
    }
    report
}

/// Two views that see common ground, and which corners of the first the second sees.
#[derive(Default)]
struct Pair {
    a: usize,
    b: usize,
    seen: Vec<usize>,
}

/// What was found of a pair.
struct PairReport {
    searched: usize,
    still: usize,
    /// Of each match, one distance for each set of poses, pixels.
    distances: Vec<Vec<f64>>,
}

fn overlapping(pictures: &[&JudgedPicture], poses: &[Isometry3<f64>]) -> Vec<Pair> {
    let all: Vec<(usize, usize)> =
        (0..pictures.len()).flat_map(|a| (a + 1..pictures.len()).map(move |b| (a, b))).collect();
    all.into_par_iter()
        .filter_map(|(a, b)| {
            let b_from_a = poses[b].inverse() * poses[a];
            let corners = pictures[a].corners.iter().enumerate();
            let seen: Vec<usize> =
                corners.filter(|(_, corner)| sees(pictures[b], corner, &b_from_a)).map(|(i, _)| i).collect();
            (seen.len() >= FEWEST_SEEN).then_some(Pair { a, b, seen })
        })
        .collect()
}

/// Whether another view sees a corner, at an angle at which it looks alike.
fn sees(other: &JudgedPicture, corner: &Corner, other_from_own: &Isometry3<f64>) -> bool {
    let p = other_from_own * Point3::from(corner.point);
    let Some((u, v)) = other.camera.project(&p) else { return false };
    let Some((nearest, farthest)) = other.depth_around(u, v) else { return false };
    let reach = HIDDEN * p.z;
    if p.z < f64::from(nearest) - reach || p.z > f64::from(farthest) + reach {
        return false;
    }
    let own_ray = other_from_own.rotation * Vector3::from(corner.point).normalize();
    let normal = other_from_own.rotation * Vector3::from(corner.normal);
    let ray = p.coords.normalize();
    ray.dot(&own_ray) >= TURNED && -ray.dot(&normal) >= OBLIQUE && dot(corner.point, corner.normal) < 0.0
}

fn compare(pair: &Pair, a: &JudgedPicture, b: &JudgedPicture, b_from_a: &[Isometry3<f64>]) -> PairReport {
    let mut report = PairReport { searched: 0, still: 0, distances: Vec::new() };
    let step = pair.seen.len().div_ceil(MOST_SEARCHED).max(1);
    for &i in pair.seen.iter().step_by(step) {
        let corner = &a.corners[i];
        report.searched += 1;
        match find(corner, a, b, b_from_a) {
            Found::Nowhere => {}
            Found::Still => report.still += 1,
            Found::At(place) => {
                let distance = |pose: &Isometry3<f64>| {
                    let at = carried(&b.camera, pose, corner.point)?;
                    Some((at[0] - place[0]).hypot(at[1] - place[1]))
                };
                report.distances.extend(b_from_a.iter().map(distance).collect::<Option<Vec<f64>>>());
            }
        }
    }
    report
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

/// Pictures of a growing number of views, evenly thinned so that memory stays bounded.
#[derive(Debug)]
pub struct Pictures {
    /// Place of each picture's view among all views, ascending.
    kept: Vec<(usize, JudgedPicture)>,
    /// Every how many views one is kept.
    stride: usize,
}

impl Default for Pictures {
    fn default() -> Self {
        Self { kept: Vec::new(), stride: 1 }
    }
}

impl Pictures {
    /// Whether the picture of view `place` (from 0) would be kept.
    pub fn wants(&self, place: usize) -> bool {
        place.is_multiple_of(self.stride)
    }

    /// Keeps the picture of view `place`, where it is wanted. Places grow.
    pub fn keep(&mut self, place: usize, picture: JudgedPicture) {
        if !self.wants(place) {
            return;
        }
        self.kept.push((place, picture));
        if self.kept.len() > MOST_PICTURES {
            self.stride *= 2;
            let stride = self.stride;
            self.kept.retain(|(place, _)| place.is_multiple_of(stride));
        }
    }

    /// The places of the views whose pictures are kept.
    pub fn places(&self) -> Vec<usize> {
        self.kept.iter().map(|(place, _)| *place).collect()
    }

    /// Judges sets of poses of *all* views, of which those with pictures are compared: see [`judge`]. A set without a pose
    /// for each of these is not judged.
    pub fn judge(&self, sets: &[&[Isometry3<f64>]]) -> ReprojectionReport {
        let pictures: Vec<&JudgedPicture> = self.kept.iter().map(|(_, picture)| picture).collect();
        let chosen: Vec<Vec<Isometry3<f64>>> = sets
            .iter()
            .map(|set| self.kept.iter().filter_map(|(place, _)| set.get(*place)).copied().collect())
            .collect();
        judge(&pictures, &chosen.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests;
