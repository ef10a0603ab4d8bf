//! Maximum likelihood of a cell: Gauss-Newton over the poses of the board, each weighted by its covariance, robust to captures that
//! do not fit (Huber's weights), with the covariance of what was found.
//!
//! Where captures come without a covariance, one variance of their rotations and one of their translations are estimated from the
//! residuals (variance components). That is enough to weigh them, not to say how uncertain the result is: rotation and place of a
//! board err together, and more the farther it is. There the covariance is that of the results without one capture each (jackknife,
//! [Efron 1982]).

use crate::capture::Capture;
use crate::cell::Cell;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use semascan_perception::register::se3::log;

/// Most steps, and the size of one at which they end.
const MOST_STEPS: usize = 60;
const SMALLEST_STEP: f64 = 1e-9;
/// Step of the numerical derivatives, radians and metres.
const DIFFERENCE: f64 = 1e-6;
/// Distance (in standard deviations of a pose, which has six numbers) from which on a capture counts less: the 99th percentile.
const HUBER: f64 = 4.1;
/// The same from which on it does not count at all: a capture in 100 000 by chance.
const OUTLIER: f64 = 5.7;
/// The same where the noise is that of all captures together: it differs several times over with a board's tilt and distance.
const OUTLIER_OF_ALL: f64 = 12.0;
/// Median of a squared length with three degrees of freedom, in variances.
const MEDIAN_OF_THREE: f64 = 2.366;
/// Noise that every measured pose has at least: 0.1 mdeg, 0.1 um. Data without any noise have weights then, too.
const LEAST_SIGMA: (f64, f64) = (2e-6, 1e-7);
/// Median of the squared length of a whole twist, in variances.
const MEDIAN_OF_SIX: f64 = 5.348;

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refined {
    pub(crate) cell: Cell,
    /// Of the cell's unknowns, see [`Cell::moved`].
    pub(crate) covariance: DMatrix<f64>,
    /// Twist in the board's frame from where the cell has it to where it was seen, by capture.
    pub(crate) residuals: Vec<Vector6<f64>>,
    /// Whether a capture was used.
    pub(crate) is_used: Vec<bool>,
    /// What the captures say without each of them; `None` where they do not suffice then.
    pub(crate) others: Vec<Option<Cell>>,
    /// Standard deviation of a measured pose: rotation and translation along each axis, root mean square over captures.
    pub(crate) sigma: (f64, f64),
    /// Variance of the residuals over that of the noise; 1 where they are as the noise has them.
    pub(crate) excess: f64,
}

/// The cell that explains the captures best, from where it is nearly; `None` where they leave it open.
pub(crate) fn refine(start: &Cell, captures: &[Capture]) -> Option<Refined> {
    let given: Option<Vec<Matrix6<f64>>> = captures.iter().map(|capture| capture.covariance).collect();
    let given = given.as_deref();
    // First all captures by their weights, then those alone that fit.
    let all = vec![true; captures.len()];
    let cell = least_squares(start, captures, given, &all, false)?;
    let first = residuals(&cell, captures);
    let noise_of_most = noise(given, &first, &all, cell.unknowns(), false);
    let distances = noise_of_most.iter().zip(&first).map(|(noise, residual)| mahalanobis(noise, residual));
    let outlier = if given.is_some() { OUTLIER } else { OUTLIER_OF_ALL };
    let is_used = distances.map(|distance| Some(distance? < outlier)).collect::<Option<Vec<bool>>>()?;
    let used = is_used.iter().filter(|used| **used).count();
    if 6 * used <= cell.unknowns() {
        return None;
    }
    let cell = least_squares(&cell, captures, given, &is_used, true)?;

    let residuals = residuals(&cell, captures);
    let noise = noise(given, &residuals, &is_used, cell.unknowns(), true);
    let weights = weights(&noise, &residuals, &is_used, true)?;
    let mut covariance = normal_equations(&cell, captures, &residuals, &weights).0.cholesky()?.inverse();
    let others: Vec<Option<Cell>> = (0..captures.len()).map(|k| without(&cell, captures, given, &is_used, k)).collect();
    let mut excess = 1.0;
    if given.is_some() {
        // What the covariances do not explain, such as an inaccurate robot, widens the result; nothing narrows it.
        let freedom = (6 * used - cell.unknowns()) as f64;
        let chi_squared: f64 = residuals.iter().zip(&weights).map(|(r, w)| (r.transpose() * w * r).x).sum();
        excess = (chi_squared / freedom).max(1.0);
        covariance *= excess;
    } else if let Some(jackknife) = jackknife(&cell, &others, &is_used) {
        covariance = jackknife;
    }
    let mean = |from: usize| {
        let of = noise.iter().zip(&is_used).filter(|(_, used)| **used);
        (of.map(|(n, _)| (0..3).map(|k| n[(from + k, from + k)]).sum::<f64>() / 3.0).sum::<f64>() / used as f64).sqrt()
    };
    let sigma = (mean(0), mean(3));
    Some(Refined { cell, covariance, residuals, is_used, others, sigma, excess })
}

/// Gauss-Newton from `start` over the captures that are used.
///
/// * `is_clean`: whether captures that do not fit are out already.
fn least_squares(
    start: &Cell,
    captures: &[Capture],
    given: Option<&[Matrix6<f64>]>,
    is_used: &[bool],
    is_clean: bool,
) -> Option<Cell> {
    let mut cell = *start;
    for _ in 0..MOST_STEPS {
        let residuals = residuals(&cell, captures);
        let noise = noise(given, &residuals, is_used, cell.unknowns(), is_clean);
        let weights = weights(&noise, &residuals, is_used, is_clean)?;
        let (information, gradient) = normal_equations(&cell, captures, &residuals, &weights);
        let step = information.cholesky()?.solve(&gradient);
        cell = cell.moved(&step);
        if step.norm() < SMALLEST_STEP {
            break;
        }
    }
    Some(cell)
}

/// What the captures say that were used, but for one.
fn without(
    cell: &Cell,
    captures: &[Capture],
    given: Option<&[Matrix6<f64>]>,
    is_used: &[bool],
    left_out: usize,
) -> Option<Cell> {
    if !is_used[left_out] {
        return Some(*cell);
    }
    let mut others = is_used.to_vec();
    others[left_out] = false;
    let count = others.iter().filter(|used| **used).count();
    if 6 * count <= cell.unknowns() { None } else { least_squares(cell, captures, given, &others, true) }
}

/// Covariance of the unknowns by how they change without one capture each; `None` where the others do not suffice.
fn jackknife(cell: &Cell, others: &[Option<Cell>], is_used: &[bool]) -> Option<DMatrix<f64>> {
    let used = others.iter().zip(is_used).filter(|(_, used)| **used);
    let changes = used.map(|(other, _)| other.map(|other| cell.step_to(&other))).collect::<Option<Vec<_>>>()?;
    let count = changes.len() as f64;
    let mean = changes.iter().sum::<DVector<f64>>() / count;
    let mut covariance = DMatrix::zeros(cell.unknowns(), cell.unknowns());
    for change in &changes {
        let apart = change - &mean;
        covariance += &apart * apart.transpose();
    }
    Some(covariance * ((count - 1.0) / count))
}

/// From where the cell has the board to where it was seen.
fn residuals(cell: &Cell, captures: &[Capture]) -> Vec<Vector6<f64>> {
    captures.iter().map(|capture| log(&cell.camera_from_board(capture), &capture.camera_from_board)).collect()
}

/// Covariance of each measured pose: as given, or estimated from the residuals.
///
/// * `is_clean`: whether captures that do not fit are out already.
fn noise(
    given: Option<&[Matrix6<f64>]>,
    residuals: &[Vector6<f64>],
    is_used: &[bool],
    unknowns: usize,
    is_clean: bool,
) -> Vec<Matrix6<f64>> {
    if let Some(given) = given {
        // Among captures that may not fit, what most of them have in excess is not the fault of each.
        let squares = given.iter().zip(residuals).zip(is_used).filter(|(_, used)| **used);
        let squares =
            squares.filter_map(|((noise, residual), _)| mahalanobis(noise, residual).map(|d| d * d)).collect();
        let excess = if is_clean { 1.0 } else { (median(squares) / MEDIAN_OF_SIX).max(1.0) };
        return given.iter().map(|noise| noise * excess).collect();
    }
    let used: Vec<&Vector6<f64>> = residuals.iter().zip(is_used).filter(|(_, used)| **used).map(|(r, _)| r).collect();
    // So many residuals are fitted away.
    let freedom = 1.0 - unknowns as f64 / (6 * used.len()) as f64;
    let variance = |from: usize, least: f64| {
        let squares: Vec<f64> = used.iter().map(|r| r.fixed_rows::<3>(from).norm_squared()).collect();
        let variance = match is_clean {
            true => squares.iter().sum::<f64>() / (3 * squares.len()) as f64,
            false => median(squares) / MEDIAN_OF_THREE,
        };
        (variance / freedom).max(least * least)
    };
    let (rotation, translation) = (variance(0, LEAST_SIGMA.0), variance(3, LEAST_SIGMA.1));
    let diagonal = Vector6::new(rotation, rotation, rotation, translation, translation, translation);
    vec![Matrix6::from_diagonal(&diagonal); residuals.len()]
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

/// Length of a residual in standard deviations.
fn mahalanobis(noise: &Matrix6<f64>, residual: &Vector6<f64>) -> Option<f64> {
    Some(residual.dot(&noise.cholesky()?.solve(residual)).sqrt())
}

/// Weight of each residual; `None` for a covariance that is none.
fn weights(
    noise: &[Matrix6<f64>],
    residuals: &[Vector6<f64>],
    is_used: &[bool],
    is_clean: bool,
) -> Option<Vec<Matrix6<f64>>> {
    let mut weights = Vec::with_capacity(noise.len());
    for ((noise, residual), used) in noise.iter().zip(residuals).zip(is_used) {
        let inverse = noise.cholesky()?.inverse();
        let distance = residual.dot(&(inverse * residual)).sqrt();
        let share = match (used, is_clean) {
            (false, _) => 0.0,
            (true, true) => 1.0,
            (true, false) => (HUBER / distance).min(1.0),
        };
        weights.push(inverse * share);
    }
    Some(weights)
}

/// Information and gradient of the cell's unknowns.
fn normal_equations(
    cell: &Cell,
    captures: &[Capture],
    residuals: &[Vector6<f64>],
    weights: &[Matrix6<f64>],
) -> (DMatrix<f64>, DVector<f64>) {
    let unknowns = cell.unknowns();
    let (mut information, mut gradient) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
    for ((capture, residual), weight) in captures.iter().zip(residuals).zip(weights) {
        let jacobian = jacobian(cell, capture);
        let weighted = jacobian.transpose() * weight;
        information += &weighted * &jacobian;
        gradient += weighted * residual;
    }
    (information, gradient)
}

/// What a capture would say of the cell's unknowns, weighted.
pub(crate) fn information_of(cell: &Cell, capture: &Capture, weight: &Matrix6<f64>) -> DMatrix<f64> {
    let jacobian = jacobian(cell, capture);
    jacobian.transpose() * weight * jacobian
}

/// By how much the board moves in its own frame, by the cell's unknowns.
fn jacobian(cell: &Cell, capture: &Capture) -> DMatrix<f64> {
    let unknowns = cell.unknowns();
    let here = cell.camera_from_board(capture);
    let mut jacobian = DMatrix::zeros(6, unknowns);
    for k in 0..unknowns {
        let mut step = DVector::zeros(unknowns);
        step[k] = DIFFERENCE;
        let ahead = log(&here, &cell.moved(&step).camera_from_board(capture));
        let behind = log(&here, &cell.moved(&-step).camera_from_board(capture));
        jacobian.column_mut(k).copy_from(&((ahead - behind) / (2.0 * DIFFERENCE)));
    }
    jacobian
}
