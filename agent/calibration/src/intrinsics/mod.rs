//! Whether the camera's given numbers hold: how well boards fit with them, picture by picture and over the radius of the picture, and
//! what the same corners say by themselves (bundle adjustment over all views, [Zhang 2000]) with its uncertainty.
//!
//! The given numbers are never replaced: a camera that was calibrated on two hundred pictures knows better than fourteen. But where
//! the corners contradict it, they do so beyond their noise, which is tested.

mod bundle;
#[cfg(test)]
mod tests;

use crate::board_view::{BoardView, Corner};
use bundle::{Fit, Numbers, Seen, fitted, residuals, rms};
use nalgebra::Vector2;
use semascan_perception::view::{CameraModel, Intrinsics};

/// Fewest pictures of which an own estimate is made.
const FEWEST_VIEWS: usize = 4;
/// How many times more than by noise the own camera must fit better for the given one to be contradicted: 1 in 1000 by chance for nine
/// numbers.
const CONTRADICTED: f64 = 3.2;
/// Below which a contradiction does not matter: pixels (root mean square); and, of focal lengths and principal point, share of the focal
/// length. Distances and directions are wrong by that share, while boards that stand otherwise hide it in the picture.
const MATTERS: (f64, f64) = (0.05, 0.002);
/// Expanded uncertainty of the focal length, as a share, from which on the pictures leave it open.
const OPEN: f64 = 0.005;
/// Rings of the picture, and cells along its width and height whose coverage is counted.
const RINGS: usize = 5;
const CELLS: (usize, usize) = (8, 6);

/// What boards say of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct IntrinsicsCheck {
    /// Root mean square distance of corners with the given camera, pixels.
    pub rms: f64,
    /// The same by picture, in the order of the views.
    pub by_view: Vec<f64>,
    /// The same over the radius, from the principal point outwards.
    pub by_radius: Vec<Ring>,
    /// Share of the picture's cells (eight by six) that have a corner.
    pub coverage: f64,
    /// The corners' own camera, if they tell one.
    pub own: Option<OwnCamera>,
    /// What follows.
    pub verdict: IntrinsicsVerdict,
}

/// A ring of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Its outer radius, pixels.
    pub radius: f64,
    /// Corners in it.
    pub corners: usize,
    /// Root mean square distance, pixels.
    pub rms: f64,
    /// Mean distance outwards, pixels: one that grows with the radius is a wrong lens or focal length.
    pub outwards: f64,
}

/// A camera by the corners alone.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnCamera {
    /// The camera.
    pub camera: CameraModel,
    /// Its numbers beside the given ones.
    pub numbers: Vec<OwnNumber>,
    /// Root mean square distance of corners with it, pixels.
    pub rms: f64,
}

/// A number of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnNumber {
    /// Its name: `fx`, `k1`.
    pub name: &'static str,
    /// As given.
    pub given: f64,
    /// By the corners.
    pub own: f64,
    /// Expanded uncertainty (k = 2) of that.
    pub uncertainty: f64,
}

/// Whether the given camera holds.
#[derive(Clone, Debug, PartialEq)]
pub enum IntrinsicsVerdict {
    /// The corners do not contradict it, or by less than matters.
    Holds,
    /// They contradict it.
    Contradicted {
        /// Root mean square distance that it adds to the corners' noise, pixels.
        pixels: f64,
        /// Own focal length over the given one, less 1.
        focal: f64,
    },
    /// The pictures cannot tell.
    Open {
        /// Why.
        reason: String,
    },
}

impl std::fmt::Display for IntrinsicsVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Holds => write!(f, "the given camera holds"),
            Self::Contradicted { pixels, focal } => write!(
                f,
                "the given camera is contradicted: it adds {pixels:.3} pixels to the corners' noise, and its focal length is off by \
                 {:.2} %. Calibrate the camera anew, or look for a picture that was scaled or rectified",
                100.0 * focal.abs()
            ),
            Self::Open { reason } => write!(f, "the pictures cannot tell whether the given camera holds: {reason}"),
        }
    }
}

/// What the corners of the views say of the camera. Corners that fit a board but not its pose are used, too: a wrong lens makes such.
pub fn check_intrinsics(views: &[&BoardView], camera: &CameraModel) -> IntrinsicsCheck {
    let boards: Vec<Seen> = views
        .iter()
        .map(|view| Seen {
            corners: view.corners.iter().chain(&view.doubtful).copied().collect(),
            pose: view.camera_from_board,
        })
        .collect();
    let given = Numbers::of(camera);
    let held = fitted(&given, &boards, &[]);
    let free: Vec<usize> = (0..given.values.len()).collect();
    let own = if views.len() < FEWEST_VIEWS { None } else { fitted(&given, &boards, &free) };
    let by_given = held.as_ref().map_or_else(Vec::new, |fit| residuals(&given, &fit.values, &fit.boards));
    let all = by_given.iter().flatten().map(|(_, residual)| *residual);
    let (verdict, own) = judged(&given, held.as_ref(), own, &boards);
    IntrinsicsCheck {
        rms: rms(all),
        by_view: by_given.iter().map(|of| rms(of.iter().map(|(_, residual)| *residual))).collect(),
        by_radius: rings(camera.intrinsics(), &by_given),
        coverage: coverage(camera.intrinsics(), &boards),
        own,
        verdict,
    }
}

/// What follows from how the given camera fits, and how the own one does.
fn judged(
    given: &Numbers,
    held: Option<&Fit>,
    own: Option<Fit>,
    boards: &[Seen],
) -> (IntrinsicsVerdict, Option<OwnCamera>) {
    let open = |reason: &str| IntrinsicsVerdict::Open { reason: reason.to_owned() };
    if boards.len() < FEWEST_VIEWS {
        return (open("there are too few of them"), None);
    }
    let (Some(held), Some(fit)) = (held, own) else {
        return (open("the board is seen from too few sides to tell the camera's numbers apart"), None);
    };
    let Some(camera) = given.camera(&fit.values) else { return (open("the corners tell no camera"), None) };
    let count = boards.iter().map(|board| 2 * board.corners.len()).sum::<usize>() as f64;
    let numbers = given.values.len() as f64;
    let freedom = (count - numbers - 6.0 * boards.len() as f64).max(1.0);
    let variance = fit.cost / freedom;
    let uncertainty = |k: usize| 2.0 * (variance * fit.covariance[(k, k)]).max(0.0).sqrt();
    let own = OwnCamera {
        rms: rms(residuals(given, &fit.values, &fit.boards).iter().flatten().map(|(_, residual)| *residual)),
        numbers: (0..given.values.len())
            .map(|k| OwnNumber {
                name: given.names[k],
                given: given.values[k],
                own: fit.values[k],
                uncertainty: uncertainty(k),
            })
            .collect(),
        camera,
    };
    let added = (held.cost - fit.cost).max(0.0);
    let pixels = (2.0 * added / count).sqrt();
    let longer = &own.numbers[0];
    let focal = longer.own / longer.given - 1.0;
    let matters = MATTERS.1 * longer.own;
    let is_off = own.numbers.iter().take(4).any(|n| (n.own - n.given).abs() > n.uncertainty.max(matters));
    let is_contradicted = added / numbers > CONTRADICTED * variance && (pixels > MATTERS.0 || is_off);
    let share = longer.uncertainty / longer.own;
    let verdict = match (is_contradicted, share > OPEN) {
        (true, _) => IntrinsicsVerdict::Contradicted { pixels, focal },
        (false, true) => {
            open(&format!("they leave the focal length open to {:.1} %; tilt the board more", 100.0 * share))
        }
        (false, false) => IntrinsicsVerdict::Holds,
    };
    (verdict, Some(own))
}

fn rings(k: &Intrinsics, residuals: &[Vec<(Corner, Vector2<f64>)>]) -> Vec<Ring> {
    let middle = Vector2::new(k.cx, k.cy);
    let corners =
        [[0.0, 0.0], [f64::from(k.width), 0.0], [0.0, f64::from(k.height)], [f64::from(k.width), f64::from(k.height)]];
    let farthest = corners.iter().map(|corner| (Vector2::from(*corner) - middle).norm()).fold(0.0, f64::max);
    let mut rings = Vec::new();
    for ring in 0..RINGS {
        let [from, to] = [ring, ring + 1].map(|k| farthest * k as f64 / RINGS as f64);
        let of_ring: Vec<(Vector2<f64>, Vector2<f64>)> = residuals
            .iter()
            .flatten()
            .map(|(corner, residual)| (Vector2::from(corner.pixel) - middle, *residual))
            .filter(|(from_middle, _)| (from..to).contains(&from_middle.norm()))
            .collect();
        if of_ring.is_empty() {
            continue;
        }
        let outwards =
            of_ring.iter().map(|(from_middle, residual)| residual.dot(&from_middle.normalize())).sum::<f64>();
        rings.push(Ring {
            radius: to,
            corners: of_ring.len(),
            rms: rms(of_ring.iter().map(|(_, residual)| *residual)),
            outwards: outwards / of_ring.len() as f64,
        });
    }
    rings
}

fn coverage(k: &Intrinsics, boards: &[Seen]) -> f64 {
    let mut covered = vec![false; CELLS.0 * CELLS.1];
    for corner in boards.iter().flat_map(|board| &board.corners) {
        let column = (corner.pixel[0] + 0.5) / f64::from(k.width) * CELLS.0 as f64;
        let row = (corner.pixel[1] + 0.5) / f64::from(k.height) * CELLS.1 as f64;
        let is_inside = column >= 0.0 && row >= 0.0 && column < CELLS.0 as f64 && row < CELLS.1 as f64;
        if is_inside {
            covered[row as usize * CELLS.0 + column as usize] = true;
        }
    }
    covered.iter().filter(|covered| **covered).count() as f64 / covered.len() as f64
}
