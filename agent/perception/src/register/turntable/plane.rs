//! The stage: the plane that the part stands on, which gives the axis' direction, and about where things turn.

use super::still::Still;
use super::thinned::TurningView;
use super::{Axis, profile};
use nalgebra::{Matrix3, Point3, SymmetricEigen, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::BTreeMap;

/// Triples of points that are tried.
const DRAWS: usize = 400;
/// Farthest that a point of the plane lies from it, as a share of its distance: the noise of a depth camera.
const NEAR: f64 = 0.006;
/// Share by which the box about what changes is widened, on each side.
const WIDER: f64 = 0.2;
/// Metres about the plane that are taken for it.
const ON_PLANE: f64 = 0.007;
/// Least share of a disc's pixels that change where something is printed on it.
const PRINTED: f64 = 0.6;
/// Fewest pixels of something that turns.
const FEWEST_CHANGING: usize = 100;
/// Fewest points of a plane.
const FEWEST: usize = 200;
/// Height of the lowest of what changes in depth above the plane, metres: a part stands on its disc, not before a wall.
const STANDS: f64 = 0.06;
/// Least share of what changes in depth that lies above the plane.
const ABOVE: f64 = 0.6;

/// The plane beneath what turns, and the box around that in the plane.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    /// A first guess of the axis: its direction is the plane's normal, its point in the middle of what changes.
    pub(super) axis: Axis,
    /// Farthest from there that something turns, metres.
    pub(super) radius: f64,
    /// Height of the highest that turns above the plane, metres.
    pub(super) height: f64,
    /// Pixels that change from view to view, row-major.
    pub(super) changes: Vec<bool>,
    /// Whether the axis was said.
    pub(super) known: bool,
}

/// Finds the stage; `None` without a plane.
pub(super) fn stage(views: &[TurningView], still: &Still, known: Option<&Axis>) -> Option<Stage> {
    let camera = &views.first()?.camera;
    let width = camera.width as usize;
    let point = |i: usize, z: f32| camera.unproject((i % width) as f64, (i / width) as f64, z.into());
    let nearest = |i: usize| (still.nearest[i] > 0.0).then(|| point(i, still.nearest[i]));
    let moving: Vec<Point3<f64>> =
        (0..still.changes.len()).filter(|i| still.depth_changes[*i]).filter_map(nearest).collect();
    let (normal, offset) = match known {
        Some(axis) => {
            // Away from the disc, which the camera sees from above.
            let middle = moving.iter().map(|p| p.coords).sum::<Vector3<f64>>();
            let normal = if axis.direction.dot(&middle) > 0.0 { -axis.direction } else { axis.direction };
            (normal, height_of_plane(still, &point, &Axis { direction: normal, ..*axis }, &moving)?)
        }
        None => plane_beneath(still, &point, width, &moving)?,
    };
    let above = |p: &Point3<f64>| normal.dot(&p.coords) - offset;
    let on_plane = |p: &Point3<f64>| p - normal.into_inner() * above(p);
    // What changes in colour on the plane is a print that turns, or shadows that do not.
    let mut changes = still.changes.clone();
    let flat: Vec<usize> = (0..changes.len())
        .filter(|i| changes[*i] && !still.depth_changes[*i])
        .filter(|i| nearest(*i).is_some_and(|p| above(&p).abs() < ON_PLANE))
        .collect();
    if !is_print(still, &flat, &nearest, &above, &on_plane, &normal) {
        flat.iter().for_each(|i| changes[*i] = false);
    }
    let changing: Vec<Point3<f64>> =
        (0..changes.len()).filter(|i| changes[*i]).filter_map(nearest).filter(|p| above(p) > -ON_PLANE).collect();
    if changing.len() < FEWEST_CHANGING {
        return None;
    }
    let (axis, half) = match known {
        Some(axis) => (Axis { point: on_plane(&axis.point), direction: normal }, 0.0),
        None => {
            let (point, half) = middle(&changing, &on_plane, &normal)?;
            (Axis { point, direction: normal }, half)
        }
    };
    let (mut heights, mut radii): (Vec<f64>, Vec<f64>) = changing.iter().map(|p| axis.height_and_radius(p)).unzip();
    let (radius, height) = (profile::quantile(&mut radii, 0.93)?, profile::quantile(&mut heights, 0.98)?);
    let (radius, height) = (1.2 * radius.max(half), height.max(0.0) + 0.015);
    Some(Stage { axis, radius, height, changes, known: known.is_some() })
}

/// Whether the pixels `flat` of the plane that change fill a disc, as a print on it does; shadows that walk over it do not.
fn is_print(
    still: &Still,
    flat: &[usize],
    nearest: &impl Fn(usize) -> Option<Point3<f64>>,
    above: &impl Fn(&Point3<f64>) -> f64,
    on_plane: &impl Fn(&Point3<f64>) -> Point3<f64>,
    normal: &Unit<Vector3<f64>>,
) -> bool {
    let points: Vec<Point3<f64>> = flat.iter().filter_map(|i| nearest(*i)).collect();
    let Some((centre, half)) = middle(&points, on_plane, normal) else { return false };
    let of_disc = (0..still.changes.len())
        .filter(|i| !still.depth_changes[*i])
        .filter_map(nearest)
        .filter(|p| above(p).abs() < ON_PLANE && (on_plane(p) - centre).norm() < half)
        .count();
    points.len() as f64 > PRINTED * of_disc as f64
}

/// Offset along a known axis of the plane across it at which most of what stands still in depth lies, near the axis.
fn height_of_plane(
    still: &Still,
    point: &impl Fn(usize, f32) -> Point3<f64>,
    axis: &Axis,
    moving: &[Point3<f64>],
) -> Option<f64> {
    /// Height of a bin, metres.
    const BIN: f64 = 0.003;
    let mut radii: Vec<f64> = moving.iter().map(|p| axis.height_and_radius(p).1).collect();
    let reach = profile::quantile(&mut radii, 0.5).map_or(f64::INFINITY, |r| 1.5 * r);
    let mut bins: BTreeMap<i64, usize> = BTreeMap::new();
    for i in (0..still.middle.len()).filter(|i| still.middle[*i] > 0.0 && !still.depth_changes[*i]) {
        let p = point(i, still.middle[i]);
        if axis.height_and_radius(&p).1 < reach {
            *bins.entry((axis.direction.dot(&p.coords) / BIN).floor() as i64).or_default() += 1;
        }
    }
    let count = |k: i64| (-1..=1).filter_map(|d| bins.get(&(k + d))).sum::<usize>();
    let best = bins.keys().copied().max_by_key(|k| count(*k))?;
    Some((best as f64 + 0.5) * BIN)
}

/// Normal (towards what moves) and offset of the plane that holds most of what stands still in depth near what changes.
fn plane_beneath(
    still: &Still,
    point: &impl Fn(usize, f32) -> Point3<f64>,
    width: usize,
    moving: &[Point3<f64>],
) -> Option<(Unit<Vector3<f64>>, f64)> {
    let (mut low, mut high) = ([usize::MAX; 2], [0_usize; 2]);
    for i in (0..still.changes.len()).filter(|i| still.changes[*i]) {
        for (axis, c) in [i % width, i / width].into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(c), high[axis].max(c));
        }
    }
    let margin = |axis: usize| (WIDER * (high[axis] - low[axis]) as f64) as usize;
    let inside = |i: usize| {
        [i % width, i / width]
            .into_iter()
            .enumerate()
            .all(|(axis, c)| c + margin(axis) >= low[axis] && c <= high[axis] + margin(axis))
    };
    let points: Vec<Point3<f64>> = (0..still.middle.len())
        .filter(|i| still.middle[*i] > 0.0 && !still.depth_changes[*i] && inside(*i))
        .map(|i| point(i, still.middle[i]))
        .collect();
    if points.len() < FEWEST {
        return None;
    }
    let mut rng = Pcg64::seed_from_u64(1);
    let moving: Vec<&Point3<f64>> = moving.iter().step_by(moving.len().div_ceil(500).max(1)).collect();
    let mut best: Option<(usize, Unit<Vector3<f64>>, f64)> = None;
    for _ in 0..DRAWS {
        let [a, b, c] = std::array::from_fn(|_| points[rng.random_range(0..points.len())]);
        let Some(normal) = Unit::try_new((b - a).cross(&(c - a)), 1e-9) else { continue };
        let mut normal = normal;
        // Towards the camera.
        if normal.dot(&a.coords) > 0.0 {
            normal = -normal;
        }
        let offset = normal.dot(&a.coords);
        let step = points.len().div_ceil(2000);
        let on = points.iter().step_by(step).filter(|p| (normal.dot(&p.coords) - offset).abs() < NEAR * p.z).count();
        let mut heights: Vec<f64> = moving.iter().map(|p| normal.dot(&p.coords) - offset).collect();
        let stands = profile::quantile(&mut heights, 0.1).is_none_or(|lowest| lowest < STANDS);
        let above = moving.iter().filter(|p| normal.dot(&p.coords) - offset > -NEAR * p.z).count();
        let fits = stands && above as f64 >= ABOVE * moving.len() as f64;
        if fits && best.as_ref().is_none_or(|b| on > b.0) {
            best = Some((on, normal, offset));
        }
    }
    let (_, mut normal, mut offset) = best?;
    for _ in 0..3 {
        let on: Vec<&Point3<f64>> =
            points.iter().filter(|p| (normal.dot(&p.coords) - offset).abs() < NEAR * p.z).collect();
        if on.len() < FEWEST {
            return None;
        }
        let mean = on.iter().map(|p| p.coords).sum::<Vector3<f64>>() / on.len() as f64;
        let spread: Matrix3<f64> = on.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum();
        let eigen = SymmetricEigen::new(spread);
        let smallest = eigen.eigenvalues.imin();
        let fitted = Unit::new_normalize(eigen.eigenvectors.column(smallest).into_owned());
        normal = if fitted.dot(&normal) < 0.0 { -fitted } else { fitted };
        offset = normal.dot(&mean);
    }
    Some((normal, offset))
}

/// The middle of what changes in the plane, and its half width: of its extent across the line of sight. Along it only the
/// near side is seen, behind which the middle lies by half the width.
fn middle(
    changing: &[Point3<f64>],
    on_plane: &impl Fn(&Point3<f64>) -> Point3<f64>,
    normal: &Unit<Vector3<f64>>,
) -> Option<(Point3<f64>, f64)> {
    let first = on_plane(changing.first()?);
    let away = Unit::try_new(first.coords - normal.into_inner() * normal.dot(&first.coords), 1e-6)?;
    let across = normal.cross(&away);
    let along = |direction: &Vector3<f64>| -> Vec<f64> {
        changing.iter().map(|p| (on_plane(p) - first).dot(direction)).collect()
    };
    let mut sideways = along(&across);
    let (left, right) = (profile::quantile(&mut sideways, 0.01)?, profile::quantile(&mut sideways, 0.99)?);
    let near = profile::quantile(&mut along(&away), 0.02)?;
    let half = 0.5 * (right - left);
    Some((first + across * (0.5 * (left + right)) + away.into_inner() * (near + half), half))
}
