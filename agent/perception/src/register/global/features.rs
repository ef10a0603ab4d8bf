//! What a surface looks like around a point: fast point feature histograms (FPFH, [Rusu 2009]).
//!
//! Where the normals of a cloud have no sign, the angles are folded so that the sign does not matter; both clouds have
//! to be described the same way.

use crate::register::surfels::SurfelCloud;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Bins of each of the three angles.
const BINS: usize = 11;
/// Numbers of a description, with room to end on a whole SIMD register.
pub(super) const LENGTH: usize = 36;
/// Most neighbours that describe a point.
const MOST: usize = 160;

/// A description; all zero where the surface has none.
pub(super) type Feature = [f32; LENGTH];

/// Descriptions of all points from their neighbours within `radius`.
pub(super) fn describe(cloud: &SurfelCloud, radius: f64, oriented: bool) -> Vec<Feature> {
    let neighbours: Vec<Vec<(u32, f32)>> = cloud
        .points
        .par_iter()
        .enumerate()
        .map(|(i, p)| {
            let mut near = Vec::new();
            cloud.index.within(*p, radius as f32, |n| {
                if n.index != i as u32 && n.distance_squared > 0.0 && near.len() < MOST {
                    near.push((n.index, n.distance() as f32));
                }
            });
            near
        })
        .collect();
    let simple: Vec<Feature> =
        (0..cloud.points.len()).into_par_iter().map(|i| simple(cloud, i, &neighbours[i], oriented)).collect();
    (0..cloud.points.len()).into_par_iter().map(|i| blend(&simple, i, &neighbours[i])).collect()
}

/// Histogram of the angles between a point and each of its neighbours (SPFH).
fn simple(cloud: &SurfelCloud, i: usize, near: &[(u32, f32)], oriented: bool) -> Feature {
    let mut feature = [0.0; LENGTH];
    let (p, u) = (vector(cloud.points[i]), vector(cloud.normals[i]));
    if u == Vector3::zeros() {
        return feature;
    }
    let mut counted = 0.0_f32;
    for (j, distance) in near {
        let (q, n) = (vector(cloud.points[*j as usize]), vector(cloud.normals[*j as usize]));
        let d = (q - p) / *distance;
        let v = u.cross(&d);
        let length = v.norm();
        if n == Vector3::zeros() || length < 1e-4 {
            continue;
        }
        let v = v / length;
        let w = u.cross(&v);
        let (alpha, phi) = (v.dot(&n), u.dot(&d));
        let (sine, cosine) = (w.dot(&n), u.dot(&n));
        let shares = match oriented {
            true => {
                let theta = sine.atan2(cosine) / std::f32::consts::TAU + 0.5;
                [0.5 + 0.5 * alpha, 0.5 + 0.5 * phi, theta]
            }
            false => [alpha.abs(), phi.abs(), sine.abs().atan2(cosine.abs()) / std::f32::consts::FRAC_PI_2],
        };
        for (angle, share) in shares.into_iter().enumerate() {
            let bin = ((share * BINS as f32) as usize).min(BINS - 1);
            feature[angle * BINS + bin] += 1.0;
        }
        counted += 1.0;
    }
    if counted > 0.0 {
        feature.iter_mut().for_each(|f| *f /= counted);
    }
    feature
}

/// A point's own histogram and those of its neighbours, nearer ones weighing more; each angle sums up to one.
fn blend(simple: &[Feature], i: usize, near: &[(u32, f32)]) -> Feature {
    let mut sum = [0.0; LENGTH];
    for (j, distance) in near {
        for (s, f) in sum.iter_mut().zip(&simple[*j as usize]) {
            *s += f / distance;
        }
    }
    let mut feature = simple[i];
    for angle in 0..3 {
        let bins = angle * BINS..(angle + 1) * BINS;
        let all: f32 = sum[bins.clone()].iter().sum();
        if all > 0.0 {
            for bin in bins {
                feature[bin] = 0.5 * (feature[bin] + sum[bin] / all);
            }
        }
    }
    feature
}

/// Squared distance of two descriptions.
#[inline]
pub(super) fn difference(a: &Feature, b: &Feature) -> f32 {
    let mut sums = [0.0_f32; 4];
    for (x, y) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for lane in 0..4 {
            let d = x[lane] - y[lane];
            sums[lane] += d * d;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// How much each description stands out from the mean of all, as the squared distance from it.
pub(super) fn distinctiveness(features: &[Feature]) -> Vec<f32> {
    let mut mean = [0.0; LENGTH];
    for f in features {
        for (m, v) in mean.iter_mut().zip(f) {
            *m += v / features.len() as f32;
        }
    }
    let blank = |f: &Feature| f.iter().all(|v| *v == 0.0);
    features.iter().map(|f| if blank(f) { 0.0 } else { difference(f, &mean) }).collect()
}

fn vector(p: [f32; 3]) -> Vector3<f32> {
    p.into()
}
