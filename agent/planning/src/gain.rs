//! What a view from a pose would add to the model, in square metres of surface [Isler 2016]: surface that nothing is known of, weighted by
//! its likelihood and the incidence; known surface that would be seen better; labels that it would tell more of. All of
//! it by how well the camera measures at that depth. A view that shows little of what is known, or of which the known part
//! leaves directions open, can be registered badly and counts less. The way there costs time.

use crate::coverage::{Coverage, Patch};
use crate::reach::Reach;
use crate::visibility::SeenPatch;
use nalgebra::{Matrix3, Vector3};
use semascan_inspection::planning::Viewpoint;
use semascan_model::record::ExpectedGain;
use std::f64::consts::{PI, TAU};

/// Cosine of the largest incidence under which surface counts as well seen (75 degrees).
pub(crate) const WELL_SEEN: f32 = 0.258_819;
/// Cosine from which on a closer look adds nothing (45 degrees).
const BEST: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Cosines under which a frontier promises nothing and all.
const GRAZING: f32 = 0.1;
const PROMISING: f32 = 0.5;
/// Weight of a better look at surface that is well seen already.
const BETTER: f64 = 0.2;
/// Weight of labels.
const LABELS: f64 = 0.5;
/// Least share of known surface in a view that can be registered.
const OVERLAP: f64 = 0.03;
/// Least share of the weakest direction in the normals of the known surface.
const OBSERVABLE: f64 = 0.02;
/// Share of its gain that a view loses which can be registered by the robot's pose alone: that is good to tenths of a degree, and
/// a view of the other side has no other one.
const LOST: f64 = 0.15;
/// Speed of the camera in metres a second and of the table in radians a second.
const SPEED: (f64, f64) = (0.25, 0.785);
/// Price of a second, as a share of the known surface.
const PRICE: f64 = 5e-4;

/// What a view that would see these patches from `viewpoint` adds; `last` is where the camera stands now.
pub(crate) fn expected_gain(
    coverage: &Coverage,
    reach: &Reach,
    patches: &[Patch],
    seen: &[SeenPatch],
    viewpoint: &Viewpoint,
    last: Option<&Viewpoint>,
) -> ExpectedGain {
    let area = coverage.cell_area();
    let (mut frontier, mut quality, mut labels) = (0.0, 0.0, 0.0);
    let (mut unknown, mut known) = (0_u32, 0_u32);
    let mut spread = Matrix3::<f64>::zeros();
    for seen in seen {
        let patch = &patches[seen.patch];
        let measures = working(reach, seen.depth.into());
        if patch.is_frontier() {
            unknown += 1;
            frontier += area * f64::from(patch.likelihood * promise(seen.cosine)) * measures;
            continue;
        }
        known += 1;
        let normal = Vector3::from(patch.normal).cast::<f64>();
        spread += normal * normal.transpose();
        let look = look(seen.cosine);
        let newly = patch.cosine < WELL_SEEN && seen.cosine >= WELL_SEEN;
        let better = BETTER * f64::from((look - self::look(patch.cosine)).max(0.0));
        quality += area * measures * if newly { 1.0 } else { better };
        labels += area * measures * LABELS * f64::from(patch.uncertainty * look / (1.0 + patch.views));
    }
    let overlap = f64::from(known) / f64::from((known + unknown).max(1));
    let motion = last.map_or(0.0, |last| time_between(last, viewpoint));
    let measured = area * patches.iter().filter(|p| !p.is_frontier()).count() as f64;
    let registrable = match measured > 0.0 {
        true => {
            let weakest = spread.symmetric_eigenvalues().min() / spread.trace().max(1e-9);
            let overlaps = (overlap / OVERLAP).min(1.0);
            let observable = (weakest / OBSERVABLE).clamp(0.0, 1.0);
            1.0 - LOST * (1.0 - 0.5 * (overlaps + observable))
        }
        false => 1.0,
    };
    let score = (frontier + quality + labels) * registrable - PRICE * measured * motion;
    ExpectedGain { frontier, quality, labels, overlap, motion, score }
}

/// How likely surface behind a frontier that is seen under a cosine of incidence is seen well: it lies across the frontier
/// somehow, so that the angle says little, but for grazing looks. The cosine itself would make of the sum the silhouette of what
/// is not known, which is as large from everywhere.
fn promise(cosine: f32) -> f32 {
    ((cosine - GRAZING) / (PROMISING - GRAZING)).clamp(0.0, 1.0)
}

/// How good a look under a cosine of incidence is, 0 to 1.
fn look(cosine: f32) -> f32 {
    ((cosine - WELL_SEEN) / (BEST - WELL_SEEN)).clamp(0.0, 1.0)
}

/// How well the camera measures at a depth: not at all out of its working distance, and noise grows with the square of the
/// depth.
fn working(reach: &Reach, depth: f64) -> f64 {
    let (nearest, farthest) = reach.working;
    if !(nearest..=farthest).contains(&depth) {
        return 0.0;
    }
    1.0 - 0.2 * (depth - nearest) / (farthest - nearest).max(1e-9)
}

/// Seconds from one viewpoint to another: robot and table move at the same time.
fn time_between(from: &Viewpoint, to: &Viewpoint) -> f64 {
    let way = (from.tablebase_from_camera.translation.vector - to.tablebase_from_camera.translation.vector).norm();
    let turn = (to.table_angle - from.table_angle).rem_euclid(TAU);
    let turn = if turn > PI { TAU - turn } else { turn };
    (way / SPEED.0).max(turn / SPEED.1)
}
