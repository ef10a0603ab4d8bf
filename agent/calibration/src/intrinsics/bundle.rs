//! Bundle adjustment of boards: the poses of all views and the numbers of the camera together, least squares of the reprojection by
//! Levenberg and Marquardt, robust to corners that are badly placed (Huber's loss). The poses are eliminated first (Schur's
//! complement), so a step costs little more than one pose for each view.

use crate::board_view::Corner;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, OMatrix, Point3, U2, U6, Vector2, Vector6};
use semascan_perception::register::se3::exp;
use semascan_perception::view::{CameraModel, Distortion, Intrinsics};

/// Most steps, and the relative decrease of the cost at which they end.
const MOST_STEPS: usize = 60;
const SMALLEST_DECREASE: f64 = 1e-9;
/// Step of the numerical derivatives: of pixels, of coefficients, of twists.
const DIFFERENCE: (f64, f64, f64) = (1e-3, 1e-6, 1e-6);
/// Standard deviations from which on a corner counts less (Huber).
const HUBER: f64 = 3.0;

/// A board in a picture.
#[derive(Clone)]
pub(super) struct Seen {
    pub(super) corners: Vec<Corner>,
    pub(super) pose: Isometry3<f64>,
}

/// The numbers of a camera, and how a camera is made of them.
#[derive(Clone)]
pub(super) struct Numbers {
    pub(super) names: Vec<&'static str>,
    pub(super) values: Vec<f64>,
    size: (u32, u32),
    distortion: Distortion,
}

impl Numbers {
    pub(super) fn of(camera: &CameraModel) -> Self {
        let k = camera.intrinsics();
        let (names, lens): (&[&'static str], Vec<f64>) = match *camera.distortion() {
            // Whether there is a lens at all is asked, too.
            Distortion::None => (&["k1", "k2", "p1", "p2"], vec![0.0; 4]),
            Distortion::BrownConrady { radial: [k1, k2, k3], tangential: [p1, p2] } => {
                let five: (&[&'static str], _) = (&["k1", "k2", "p1", "p2", "k3"], vec![k1, k2, p1, p2, k3]);
                if k3 == 0.0 { (&["k1", "k2", "p1", "p2"], vec![k1, k2, p1, p2]) } else { five }
            }
            // What stands below the fraction line is held: boards cannot tell the two apart.
            Distortion::Rational { radial: [k1, k2, k3], tangential: [p1, p2], .. } => {
                (&["k1", "k2", "p1", "p2", "k3"], vec![k1, k2, p1, p2, k3])
            }
            Distortion::Fisheye { radial } => (&["k1", "k2", "k3", "k4"], radial.to_vec()),
        };
        Self {
            names: ["fx", "fy", "cx", "cy"].iter().chain(names).copied().collect(),
            values: [k.fx, k.fy, k.cx, k.cy].into_iter().chain(lens).collect(),
            size: (k.width, k.height),
            distortion: *camera.distortion(),
        }
    }

    /// The camera; `None` for numbers that are none.
    pub(super) fn camera(&self, values: &[f64]) -> Option<CameraModel> {
        let lens = self.lens(values)?;
        CameraModel::new(lens.intrinsics, lens.distortion).ok()
    }

    /// The same without its range, which takes long to find.
    fn lens(&self, values: &[f64]) -> Option<Lens> {
        let (pinhole, lens) = values.split_at(4);
        let distortion = match (&self.distortion, lens) {
            (Distortion::Fisheye { .. }, [k1, k2, k3, k4]) => Distortion::Fisheye { radial: [*k1, *k2, *k3, *k4] },
            (Distortion::Rational { divisor, .. }, [k1, k2, p1, p2, k3]) => {
                Distortion::Rational { radial: [*k1, *k2, *k3], divisor: *divisor, tangential: [*p1, *p2] }
            }
            (_, [k1, k2, p1, p2, rest @ ..]) => Distortion::BrownConrady {
                radial: [*k1, *k2, rest.first().copied().unwrap_or(0.0)],
                tangential: [*p1, *p2],
            },
            _ => return None,
        };
        let (width, height) = self.size;
        let [fx, fy, cx, cy] = [pinhole[0], pinhole[1], pinhole[2], pinhole[3]];
        Some(Lens { intrinsics: Intrinsics { width, height, fx, fy, cx, cy }, distortion })
    }
}

/// A pinhole and what its lens does to rays.
struct Lens {
    intrinsics: Intrinsics,
    distortion: Distortion,
}

/// What fits.
pub(super) struct Fit {
    pub(super) values: Vec<f64>,
    pub(super) boards: Vec<Seen>,
    /// Sum of squared distances, each capped by Huber's loss, pixels.
    pub(super) cost: f64,
    /// Of the free numbers, for a standard deviation of one pixel.
    pub(super) covariance: DMatrix<f64>,
}

/// Levenberg and Marquardt over the poses of the boards and the `free` numbers of the camera; `None` where they stay open.
pub(super) fn fitted(start: &Numbers, boards: &[Seen], free: &[usize]) -> Option<Fit> {
    let (mut values, mut boards) = (start.values.clone(), boards.to_vec());
    let sigma = scale(start, &boards);
    let mut cost = cost(&start.lens(&values)?, &boards, sigma)?;
    let mut damping = 1e-4;
    for _ in 0..MOST_STEPS {
        let system = System::of(start, &values, &boards, free, sigma)?;
        let (numbers, poses) = system.step(damping)?;
        let mut next = values.clone();
        for (k, at) in free.iter().enumerate() {
            next[*at] += numbers[k];
        }
        let moved: Vec<Seen> =
            boards.iter().zip(&poses).map(|(b, step)| Seen { pose: b.pose * exp(step), ..b.clone() }).collect();
        let tried = start.lens(&next).and_then(|lens| self::cost(&lens, &moved, sigma));
        match tried {
            Some(tried) if tried <= cost => {
                let decrease = cost - tried;
                (values, boards, cost, damping) = (next, moved, tried, damping * 0.2);
                if decrease <= SMALLEST_DECREASE * cost {
                    break;
                }
            }
            _ if damping > 1e8 => break,
            _ => damping *= 8.0,
        }
    }
    let covariance = System::of(start, &values, &boards, free, sigma)?.covariance()?;
    Some(Fit { values, boards, cost, covariance })
}

/// The normal equations, the poses' part in blocks.
struct System {
    numbers: DMatrix<f64>,
    numbers_gradient: DVector<f64>,
    poses: Vec<Matrix6<f64>>,
    poses_gradient: Vec<Vector6<f64>>,
    mixed: Vec<DMatrix<f64>>,
}

impl System {
    fn of(start: &Numbers, values: &[f64], boards: &[Seen], free: &[usize], sigma: f64) -> Option<Self> {
        let lens = start.lens(values)?;
        // The camera a little to either side along each number.
        let beside: Vec<(f64, Lens, Lens)> = free
            .iter()
            .map(|at| {
                let difference = if *at < 4 { DIFFERENCE.0 } else { DIFFERENCE.1 };
                let moved = |by: f64| {
                    let mut values = values.to_vec();
                    values[*at] += by;
                    start.lens(&values)
                };
                Some((difference, moved(difference)?, moved(-difference)?))
            })
            .collect::<Option<_>>()?;
        let count = free.len();
        let mut system = Self {
            numbers: DMatrix::zeros(count, count),
            numbers_gradient: DVector::zeros(count),
            poses: Vec::new(),
            poses_gradient: Vec::new(),
            mixed: Vec::new(),
        };
        for board in boards {
            let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
            let mut mixed = DMatrix::zeros(count, 6);
            let steps: [(Isometry3<f64>, Isometry3<f64>); 6] = std::array::from_fn(|k| {
                let mut step = Vector6::zeros();
                step[k] = DIFFERENCE.2;
                (board.pose * exp(&step), board.pose * exp(&-step))
            });
            for corner in &board.corners {
                let residual = residual(&lens, &board.pose, corner)?;
                let weight = weight(residual.norm(), sigma);
                let mut by_pose = OMatrix::<f64, U2, U6>::zeros();
                for (k, (ahead, behind)) in steps.iter().enumerate() {
                    let change = pixel(&lens, ahead, corner)? - pixel(&lens, behind, corner)?;
                    by_pose.set_column(k, &(change / (2.0 * DIFFERENCE.2)));
                }
                let mut by_number = DMatrix::zeros(2, count);
                for (k, (difference, ahead, behind)) in beside.iter().enumerate() {
                    let change = pixel(ahead, &board.pose, corner)? - pixel(behind, &board.pose, corner)?;
                    by_number.set_column(k, &(change / (2.0 * difference)));
                }
                information += by_pose.transpose() * by_pose * weight;
                gradient += by_pose.transpose() * residual * weight;
                system.numbers += by_number.transpose() * &by_number * weight;
                system.numbers_gradient += by_number.transpose() * residual * weight;
                mixed += by_number.transpose() * by_pose * weight;
            }
            system.poses.push(information);
            system.poses_gradient.push(gradient);
            system.mixed.push(mixed);
        }
        Some(system)
    }

    /// The step of the numbers and of each pose.
    fn step(&self, damping: f64) -> Option<(DVector<f64>, Vec<Vector6<f64>>)> {
        let damped = |mut information: Matrix6<f64>| {
            (0..6).for_each(|k| information[(k, k)] *= 1.0 + damping);
            information
        };
        let inverses: Vec<Matrix6<f64>> =
            self.poses.iter().map(|pose| Some(damped(*pose).cholesky()?.inverse())).collect::<Option<_>>()?;
        let mut left = self.numbers.clone();
        (0..left.nrows()).for_each(|k| left[(k, k)] *= 1.0 + damping);
        let mut right = self.numbers_gradient.clone();
        for ((mixed, inverse), gradient) in self.mixed.iter().zip(&inverses).zip(&self.poses_gradient) {
            left -= mixed * inverse * mixed.transpose();
            right -= mixed * inverse * gradient;
        }
        let numbers = if left.nrows() == 0 { right } else { left.cholesky()?.solve(&right) };
        let poses = self.mixed.iter().zip(&inverses).zip(&self.poses_gradient);
        let poses = poses.map(|((mixed, inverse), gradient)| inverse * (gradient - mixed.transpose() * &numbers));
        let poses = poses.collect();
        Some((numbers, poses))
    }

    /// Of the numbers, the poses being free.
    fn covariance(&self) -> Option<DMatrix<f64>> {
        let mut information = self.numbers.clone();
        for (mixed, pose) in self.mixed.iter().zip(&self.poses) {
            information -= mixed * pose.cholesky()?.inverse() * mixed.transpose();
        }
        if information.nrows() == 0 { Some(information) } else { Some(information.cholesky()?.inverse()) }
    }
}

/// Where a corner is seen; `None` behind the camera.
fn pixel(lens: &Lens, pose: &Isometry3<f64>, corner: &Corner) -> Option<Vector2<f64>> {
    let [x, y] = corner.board_mm.map(|mm| mm * 1e-3);
    let p = pose * Point3::new(x, y, 0.0);
    let (u, v) = lens.distortion.bent(p.x / p.z, p.y / p.z);
    let k = &lens.intrinsics;
    let seen = Vector2::new(k.fx * u + k.cx, k.fy * v + k.cy);
    (p.z > 0.0 && seen.iter().all(|c| c.is_finite())).then_some(seen)
}

fn residual(lens: &Lens, pose: &Isometry3<f64>, corner: &Corner) -> Option<Vector2<f64>> {
    Some(Vector2::from(corner.pixel) - pixel(lens, pose, corner)?)
}

/// From where each corner is by numbers of a camera to where it was seen, by board.
pub(super) fn residuals(start: &Numbers, values: &[f64], boards: &[Seen]) -> Vec<Vec<(Corner, Vector2<f64>)>> {
    let Some(lens) = start.lens(values) else { return Vec::new() };
    let of = |board: &Seen| {
        let corners = board.corners.iter();
        corners.filter_map(|corner| Some((*corner, residual(&lens, &board.pose, corner)?))).collect()
    };
    boards.iter().map(of).collect()
}

pub(super) fn rms(residuals: impl Iterator<Item = Vector2<f64>>) -> f64 {
    let (sum, count) = residuals.fold((0.0, 0), |(sum, count), r| (sum + r.norm_squared(), count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Standard deviation of most corners along each axis, pixels.
fn scale(start: &Numbers, boards: &[Seen]) -> f64 {
    let mut lengths: Vec<f64> =
        residuals(start, &start.values, boards).iter().flatten().map(|(_, r)| r.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    // The median length of two normal deviates is 1.18 of their standard deviation.
    (lengths.get(lengths.len() / 2).copied().unwrap_or(0.0) / 1.18).max(1e-6)
}

fn weight(distance: f64, sigma: f64) -> f64 {
    (HUBER * sigma / distance).min(1.0)
}

/// Huber's loss over all corners; `None` where one is not in the picture any more.
fn cost(lens: &Lens, boards: &[Seen], sigma: f64) -> Option<f64> {
    let mut sum = 0.0;
    for board in boards {
        for corner in &board.corners {
            let (distance, knee) = (residual(lens, &board.pose, corner)?.norm(), HUBER * sigma);
            sum += if distance < knee { distance * distance } else { knee * (2.0 * distance - knee) };
        }
    }
    Some(sum)
}
