//! An unorganized cloud as registration needs it: thinned to a voxel grid, with normals and an index.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use semascan_geometry::grid::morton;
use semascan_geometry::measure::NearestPoints;

/// Fewest points that can be aligned.
const MIN_POINTS: usize = 10;
/// Cells along each side of the grid: 21 bits, so that a place fits one number.
const MAX_CELLS: f64 = 2_097_151.0;
/// A cloud whose second principal extent is below this share of its first lies on one line.
const LINE: f64 = 1e-4;

/// Why a cloud cannot be registered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// There is no point.
    #[error("the cloud is empty")]
    Empty,
    /// Every point has a coordinate that is NaN or infinite.
    #[error("none of the {0} points is finite")]
    NoneFinite(usize),
    /// Too little is left on the grid.
    #[error("{points} points on a grid of {voxel} m: {MIN_POINTS} are needed")]
    TooFew {
        /// Points on the grid.
        points: usize,
        /// Edge of the grid.
        voxel: f64,
    },
    /// All points lie on one line: a turn about it cannot be seen.
    #[error("the points lie on one line")]
    Collinear,
    /// The grid's edge is not a positive length, or too small for the size of the cloud.
    #[error("voxel edge {voxel} m does not suit a cloud {extent} m across")]
    Voxel {
        /// What was asked for.
        voxel: f64,
        /// Longest side of the cloud.
        extent: f64,
    },
}

/// What is known about the side that a surface is seen from.
#[derive(Clone, Copy, Debug)]
pub enum Facing<'a> {
    /// Nothing: normals have no sign.
    Unknown,
    /// Everything was seen from this point.
    From(Point3<f64>),
    /// Normals that come with the points; zero where unknown.
    Normals(&'a [[f32; 3]]),
}

/// Points of a surface, one a voxel, with normals.
#[derive(Clone, Debug)]
pub struct SurfelCloud {
    /// Means of the voxels' points, along a Morton curve.
    pub points: Vec<[f32; 3]>,
    /// Unit normals by principal components; zero where the neighbours lie on one line.
    pub normals: Vec<[f32; 3]>,
    /// Whether the normals' signs mean anything.
    pub oriented: bool,
    /// Edge of the grid in metres.
    pub voxel: f64,
    /// Mean of the points.
    pub centroid: Point3<f64>,
    /// Root of the mean squared distance from it.
    pub radius: f64,
    /// Finds points of the cloud.
    pub index: NearestPoints,
}

impl SurfelCloud {
    /// Thins `points` (metres; those that are not finite are passed over) to one a voxel of edge `voxel`, and fits
    /// normals to `neighbours` of them each.
    ///
    /// # Errors
    /// [`CloudError`] if too little is left to be aligned.
    pub fn new(points: &[[f32; 3]], facing: Facing<'_>, voxel: f64, neighbours: usize) -> Result<Self, CloudError> {
        let (points, hints) = thinned(points, facing, voxel)?;
        if points.len() < MIN_POINTS {
            return Err(CloudError::TooFew { points: points.len(), voxel });
        }
        let all: Vec<u32> = (0..points.len() as u32).collect();
        let (centroid, covariance) = moments(&points, &all);
        let extents = covariance.symmetric_eigenvalues();
        let mut extents: [f64; 3] = [extents[0].max(0.0), extents[1].max(0.0), extents[2].max(0.0)];
        extents.sort_by(f64::total_cmp);
        if extents[1].sqrt() <= LINE * extents[2].sqrt() {
            return Err(CloudError::Collinear);
        }
        let index = NearestPoints::new(&points);
        let neighbours = neighbours.max(3);
        let rows = index.neighbourhoods(neighbours);
        let normals = rows.par_chunks(neighbours).zip(&hints).map(|(row, hint)| normal(&points, row, hint)).collect();
        let oriented = !matches!(facing, Facing::Unknown);
        let radius = covariance.trace().sqrt();
        Ok(Self { points, normals, oriented, voxel, centroid: Point3::from(centroid), radius, index })
    }
}

/// One point a voxel along a Morton curve, and for each what tells its side: a normal, or the way to the eye.
type Thinned = (Vec<[f32; 3]>, Vec<Vector3<f64>>);

fn thinned(points: &[[f32; 3]], facing: Facing<'_>, voxel: f64) -> Result<Thinned, CloudError> {
    if points.is_empty() {
        return Err(CloudError::Empty);
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let finite = |p: &[f32; 3]| p.iter().all(|c| c.is_finite());
    for p in points.iter().filter(|p| finite(p)) {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    let extent = (0..3).map(|a| f64::from(high[a]) - f64::from(low[a])).fold(f64::NEG_INFINITY, f64::max);
    if extent < 0.0 {
        return Err(CloudError::NoneFinite(points.len()));
    }
    if !(voxel > 0.0 && voxel.is_finite() && extent / voxel < MAX_CELLS) {
        return Err(CloudError::Voxel { voxel, extent });
    }
    let scale = 1.0 / voxel;
    let place = |p: &[f32; 3]| -> u64 {
        morton([2, 1, 0].map(|a: usize| ((f64::from(p[a]) - f64::from(low[a])) * scale) as u32))
    };
    let places = sorted(points, |p| finite(p).then(|| place(p)), (extent * scale) as u64);
    let (mut out, mut hints) = (Vec::new(), Vec::new());
    for voxel in places.chunk_by(|a, b| a.0 == b.0) {
        let sum: Vector3<f64> = voxel.iter().map(|(_, i)| vector(points[*i as usize])).sum();
        let mean = sum / voxel.len() as f64;
        hints.push(match facing {
            Facing::Unknown => Vector3::zeros(),
            Facing::From(eye) => eye.coords - mean,
            Facing::Normals(given) => {
                voxel.iter().filter_map(|(_, i)| given.get(*i as usize)).map(|n| vector(*n)).sum()
            }
        });
        out.push([mean.x as f32, mean.y as f32, mean.z as f32]);
    }
    Ok((out, hints))
}

/// Points by their places, those at one place in their own order.
fn sorted(points: &[[f32; 3]], place: impl Fn(&[f32; 3]) -> Option<u64> + Sync, cells: u64) -> Vec<(u64, u32)> {
    let bits = points.len().ilog2() + 1;
    let numbered = points.par_iter().zip(0_u32..points.len() as u32);
    if 3 * (cells.max(1).ilog2() + 1) + bits <= 64 {
        // Place and number in one word sort faster than as a pair.
        let mut words: Vec<u64> =
            numbered.filter_map(|(p, i)| place(p).map(|place| place << bits | u64::from(i))).collect();
        words.par_sort_unstable();
        return words.into_iter().map(|w| (w >> bits, (w & ((1 << bits) - 1)) as u32)).collect();
    }
    let mut pairs: Vec<(u64, u32)> = numbered.filter_map(|(p, i)| place(p).map(|place| (place, i))).collect();
    pairs.par_sort_unstable();
    pairs
}

/// A point or normal in double precision.
pub(super) fn vector(p: [f32; 3]) -> Vector3<f64> {
    Vector3::new(p[0].into(), p[1].into(), p[2].into())
}

/// Mean and covariance of the points that `row` names, which end at the first that is not there.
fn moments(points: &[[f32; 3]], row: &[u32]) -> (Vector3<f64>, Matrix3<f64>) {
    let mut near = row.iter().map_while(|i| points.get(*i as usize)).map(|p| vector(*p)).peekable();
    let origin = near.peek().copied().unwrap_or_default();
    let (mut n, mut sum, mut c) = (0.0, Vector3::zeros(), [0.0; 6]);
    // About the first of them, so that nothing is lost where all are far from the frame's origin.
    for d in near.map(|p| p - origin) {
        n += 1.0;
        sum += d;
        for (sum, product) in c.iter_mut().zip([d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z]) {
            *sum += product;
        }
    }
    let (inverse, mean) = (1.0 / f64::max(n, 1.0), sum / f64::max(n, 1.0));
    let second = Matrix3::new(c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]) * inverse;
    (origin + mean, second - mean * mean.transpose())
}

fn normal(points: &[[f32; 3]], row: &[u32], hint: &Vector3<f64>) -> [f32; 3] {
    let Some(normal) = least_direction(&moments(points, row).1) else { return [0.0; 3] };
    let n = if normal.dot(hint) < 0.0 { -normal } else { normal };
    [n.x as f32, n.y as f32, n.z as f32]
}

/// The direction in which a covariance is least [Eberly 2014];
/// `None` where two directions have as good as no extent.
fn least_direction(m: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let mean = m.trace() / 3.0;
    if !(mean > 0.0 && mean.is_finite()) {
        return None;
    }
    let centred = m / mean - Matrix3::identity();
    let p = (centred.norm_squared() / 6.0).sqrt();
    if p < 1e-9 {
        // The same in all directions.
        return None;
    }
    let half = (centred.determinant() / (2.0 * p.powi(3))).clamp(-1.0, 1.0);
    let angle = half.acos() / 3.0;
    let third = 2.0 * std::f64::consts::FRAC_PI_3;
    let least = 2.0 * p * (angle + third).cos();
    let most = 2.0 * p * angle.cos();
    let middle = -least - most;
    if 1.0 + middle < 1e-8 * (1.0 + most) {
        return None;
    }
    let shifted = centred - Matrix3::identity() * least;
    let rows: [Vector3<f64>; 3] = std::array::from_fn(|i| shifted.row(i).transpose());
    let crosses = [rows[0].cross(&rows[1]), rows[1].cross(&rows[2]), rows[2].cross(&rows[0])];
    let longest = crosses.iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
    longest.try_normalize(1e-30)
}

#[cfg(test)]
mod tests;
