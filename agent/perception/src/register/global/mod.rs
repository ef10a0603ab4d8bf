//! Global registration: the pose of a cloud in another without any first guess, or the word that there is none.
//!
//! For a view without a prior, and to bring a model to its reference. Features of the surface propose pairs of points,
//! `consistency` finds motions that many of them follow, and the motions are judged by what counts in the end: the
//! share of the smaller cloud that lies on the other after GICP, with agreeing normals.

mod consistency;
mod features;
mod verification;

use super::surfels::{CloudError, Facing, SurfelCloud, vector};
use consistency::{Candidate, Tolerance, motions};
use features::{Feature, describe, difference, distinctiveness};
use nalgebra::Isometry3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use verification::{Judged, judge};

/// Points of the larger cloud that the grid is chosen for.
const POINTS: f64 = 5000.0;
/// Neighbours that a normal is fitted to.
const NEIGHBOURS: usize = 16;
/// Radius of a feature in voxels.
const FEATURE_RADIUS: f64 = 5.0;
/// Most points of each cloud that are matched.
const KEYPOINTS: usize = 2500;
/// Most pairs that are sorted out.
const CANDIDATES: usize = 2000;
/// Motions drawn, and how many of them are judged on the clouds.
const DRAWS: usize = 400;
const JUDGED: usize = 12;

/// One cloud, as it comes.
#[derive(Clone, Copy, Debug)]
pub struct CloudInput<'a> {
    /// Points in metres; those that are not finite are passed over.
    pub points: &'a [[f32; 3]],
    /// What is known of the surface's sides.
    pub facing: Facing<'a>,
}

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalConfig {
    /// Seed of everything random.
    pub seed: u64,
    /// Edge of the grid in metres; chosen so that about 5000 points are left if absent.
    pub voxel: Option<f64>,
    /// Least share of the smaller cloud that has to lie on the other.
    pub min_overlap: f64,
    /// Fewest pairs of features that have to follow the motion.
    pub min_support: usize,
    /// Most directions that the common surface may leave unconstrained: with two, things that have no more than a plane
    /// in common would match.
    pub max_unconstrained: usize,
}

impl Default for GlobalConfig {
    fn default() -> Self {
        Self { seed: 1, voxel: None, min_overlap: 0.3, min_support: 12, max_unconstrained: 1 }
    }
}

/// A pose that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct GlobalMatch {
    /// The pose.
    pub target_from_source: Isometry3<f64>,
    /// Share of the smaller cloud's surface that lies within 1.5 voxels of the other with normals that agree.
    pub overlap: f64,
    /// The same of the best motion that is another one; 0 if there is none. Near [`Self::overlap`], the parts are
    /// symmetric or featureless and the pose is one of several.
    pub runner_up: f64,
    /// Pairs of features that follow the motion.
    pub support: usize,
    /// Directions of the motion that the common surface leaves unconstrained: 1 where it is round, 3 where it is flat.
    pub unconstrained: usize,
    /// Root of the mean squared distance of the planes after GICP on the grid, metres.
    pub rmse: f64,
    /// Edge of the grid in metres.
    pub voxel: f64,
}

/// Why no pose could be given.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GlobalError {
    /// The source cannot be registered at all.
    #[error("source: {0}")]
    Source(CloudError),
    /// The target cannot be registered to.
    #[error("target: {0}")]
    Target(CloudError),
    /// No motion is good enough.
    #[error(
        "no match: at best {:.0} % of the smaller cloud lie on the other, with {support} pairs of features and \
         {unconstrained} directions unconstrained",
        overlap * 100.0
    )]
    NoMatch {
        /// Overlap of the best motion.
        overlap: f64,
        /// Its support.
        support: usize,
        /// Directions that it leaves unconstrained.
        unconstrained: usize,
    },
}

/// Finds the pose of `source` in `target`. The same seed gives the same answer on any number of threads.
///
/// # Errors
/// [`GlobalError`] naming the cloud that is unusable, or that there is no match.
pub fn register_globally(
    source: &CloudInput<'_>,
    target: &CloudInput<'_>,
    config: &GlobalConfig,
) -> Result<GlobalMatch, GlobalError> {
    let mut found = propose(source, target, config)?;
    Ok(found.swap_remove(0))
}

/// All poses of `source` in `target` that are good enough and differ, the one with the largest overlap first; at least
/// one. The same seed gives the same answer on any number of threads.
///
/// # Errors
/// As of [`register_globally`].
pub fn propose(
    source: &CloudInput<'_>,
    target: &CloudInput<'_>,
    config: &GlobalConfig,
) -> Result<Vec<GlobalMatch>, GlobalError> {
    let (s, t) = grids(source, target, config.voxel)?;
    let oriented = s.oriented && t.oriented;
    let mut rng = Pcg64::seed_from_u64(config.seed);
    let radius = FEATURE_RADIUS * s.voxel;
    let candidates = candidates(&s, &t, &describe(&s, radius, oriented), &describe(&t, radius, oriented), &mut rng);
    let tolerance = Tolerance { distance: 1.5 * s.voxel, normal: 0.3, oriented };
    let found = motions(&candidates, tolerance, DRAWS, JUDGED, &mut rng);
    let mut judged: Vec<Judged> = found.iter().filter_map(|h| judge(&s, &t, h)).collect();
    judged.sort_by(|a, b| b.overlap.total_cmp(&a.overlap));
    let mut different: Vec<Judged> = Vec::new();
    for j in judged {
        if different.iter().all(|d| apart(&d.fit.target_from_source, &j.fit.target_from_source, &s)) {
            different.push(j);
        }
    }
    let Some(best) = different.first() else {
        return Err(GlobalError::NoMatch { overlap: 0.0, support: 0, unconstrained: 6 });
    };
    let good = |j: &Judged| {
        j.overlap >= config.min_overlap
            && j.support >= config.min_support
            && j.unconstrained <= config.max_unconstrained
    };
    if !good(best) {
        return Err(GlobalError::NoMatch {
            overlap: best.overlap,
            support: best.support,
            unconstrained: best.unconstrained,
        });
    }
    Ok(different
        .iter()
        .enumerate()
        .filter(|(_, j)| good(j))
        .map(|(i, j)| GlobalMatch {
            target_from_source: j.fit.target_from_source,
            overlap: j.overlap,
            // In order: the best of the others is the first, or of the first the second.
            runner_up: different.get(usize::from(i == 0)).map_or(0.0, |o| o.overlap),
            support: j.support,
            unconstrained: j.unconstrained,
            rmse: j.fit.rmse,
            voxel: s.voxel,
        })
        .collect())
}

/// Whether two poses of the cloud differ by more than two voxels, on average over it.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>, cloud: &SurfelCloud) -> bool {
    let between = a.inverse() * b;
    let centre = (between * cloud.centroid - cloud.centroid).norm();
    centre + between.rotation.angle() * cloud.radius > 2.0 * cloud.voxel
}

/// Both clouds on one grid.
fn grids(
    source: &CloudInput<'_>,
    target: &CloudInput<'_>,
    voxel: Option<f64>,
) -> Result<(SurfelCloud, SurfelCloud), GlobalError> {
    let voxel = match voxel {
        Some(voxel) => voxel,
        None => {
            let s = suitable_voxel(source).map_err(GlobalError::Source)?;
            s.max(suitable_voxel(target).map_err(GlobalError::Target)?)
        }
    };
    let make = |c: &CloudInput<'_>| SurfelCloud::new(c.points, c.facing, voxel, NEIGHBOURS);
    Ok((make(source).map_err(GlobalError::Source)?, make(target).map_err(GlobalError::Target)?))
}

/// The edge that leaves about [`POINTS`] points: the number falls with the square of the edge on a surface.
fn suitable_voxel(cloud: &CloudInput<'_>) -> Result<f64, CloudError> {
    if cloud.points.is_empty() {
        return Err(CloudError::Empty);
    }
    let mut kept: Vec<[f32; 3]> = cloud.points.iter().copied().filter(|p| p.iter().all(|c| c.is_finite())).collect();
    if kept.is_empty() {
        return Err(CloudError::NoneFinite(cloud.points.len()));
    }
    // Far strays must not choose the grid: the middle 90 % of each axis do.
    let mut extent = 0.0_f64;
    for axis in 0..3 {
        let (low, high) = (kept.len() / 20, kept.len() - 1 - kept.len() / 20);
        let at = |k: usize, points: &mut Vec<[f32; 3]>| {
            points.select_nth_unstable_by(k, |a, b| a[axis].total_cmp(&b[axis])).1[axis]
        };
        extent = extent.max(f64::from(at(high, &mut kept)) - f64::from(at(low, &mut kept)));
    }
    if extent <= 0.0 {
        return Err(CloudError::TooFew { points: 1, voxel: 0.0 });
    }
    let first = extent / 50.0;
    let grid = SurfelCloud::new(cloud.points, Facing::Unknown, first, 3)?;
    Ok(first * (grid.points.len() as f64 / POINTS).sqrt())
}

/// Pairs of points whose surroundings look alike.
fn candidates(
    source: &SurfelCloud,
    target: &SurfelCloud,
    source_features: &[Feature],
    target_features: &[Feature],
    rng: &mut Pcg64,
) -> Vec<Candidate> {
    let (from, to) = (keypoints(source_features, rng), keypoints(target_features, rng));
    let forth = nearest_features(source_features, &from, target_features, &to);
    let back = nearest_features(target_features, &to, source_features, &from);
    let mut pairs: Vec<(bool, f32, usize, usize)> = Vec::with_capacity(from.len());
    for (i, (j, d)) in forth.iter().enumerate() {
        if let Some((there, _)) = back.get(*j) {
            pairs.push((*there != i, *d, from[i], to[*j]));
        }
    }
    // Mutual pairs first, then the most alike.
    pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    pairs.truncate(CANDIDATES);
    pairs
        .into_iter()
        .map(|(_, _, i, j)| Candidate {
            source: vector(source.points[i]).into(),
            target: vector(target.points[j]).into(),
            source_normal: vector(source.normals[i]),
            target_normal: vector(target.normals[j]),
        })
        .collect()
}

/// A random choice among the half of the points that stand out most.
fn keypoints(features: &[Feature], rng: &mut Pcg64) -> Vec<usize> {
    let distinct = distinctiveness(features);
    let mut order: Vec<usize> = (0..features.len()).filter(|i| distinct[*i] > 0.0).collect();
    order.sort_by(|a, b| distinct[*b].total_cmp(&distinct[*a]));
    order.truncate((order.len() / 2).max(KEYPOINTS));
    order.shuffle(rng);
    order.truncate(KEYPOINTS);
    order
}

/// For each key point of `a`, the position in `keys_b` of the most alike one, and how alike.
fn nearest_features(a: &[Feature], keys_a: &[usize], b: &[Feature], keys_b: &[usize]) -> Vec<(usize, f32)> {
    let others: Vec<Feature> = keys_b.iter().map(|j| b[*j]).collect();
    keys_a
        .par_iter()
        .map(|i| {
            let mut best = (usize::MAX, f32::INFINITY);
            for (j, feature) in others.iter().enumerate() {
                let d = difference(&a[*i], feature);
                if d < best.1 {
                    best = (j, d);
                }
            }
            best
        })
        .collect()
}

#[cfg(test)]
mod tests;
