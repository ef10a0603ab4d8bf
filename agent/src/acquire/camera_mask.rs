//! Finds the pixels that show the robot itself: a gripper or cable that moves with the camera.
//!
//! Two tests, both needed. Its depth stays the same from view to view; and other views look straight through the place
//! where it would be if it belonged to the scene (a part that turns under the camera passes the first test alone).
//! Depth of near, dark grippers is sparse and noisy, so both tests work on blocks of pixels pooled over all views.

use super::{DepthImage, Intrinsics};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

/// Edge of a block in pixels.
const BLOCK: u32 = 8;

/// Fewest views, and fewest depth readings of a block, for a verdict.
const MIN_VIEWS: usize = 4;
const MIN_READINGS: usize = 12;

/// Spread of depth (5th to 95th percentile) that still counts as unchanged, as a share of the depth.
const STATIC_SPREAD: f32 = 0.12;

/// A view sees through a point if it measures this much farther behind it (share of depth, and metres).
const SEES_THROUGH: (f64, f64) = (0.1, 0.02);

/// Share of the views' testimony that must say "sees through".
const MIN_SEEN_THROUGH: f64 = 0.7;

/// A depth picture and where it was taken.
#[derive(Clone, Debug)]
pub struct PosedDepth {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// The picture.
    pub depth: DepthImage,
    /// Where it was taken.
    pub table_from_camera: Isometry3<f64>,
}

/// Pixels to ignore in every view (row-major), or `None` if nothing moves with the camera or there are too few views.
pub fn find(views: &[PosedDepth]) -> Option<Vec<bool>> {
    let first = views.first()?;
    let (width, height) = (first.depth.width, first.depth.height);
    if views.len() < MIN_VIEWS || views.iter().any(|v| (v.depth.width, v.depth.height) != (width, height)) {
        return None;
    }
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let attached: Vec<bool> =
        (0..columns * rows).into_par_iter().map(|b| is_attached(views, b % columns, b / columns)).collect();
    if !attached.contains(&true) {
        return None;
    }
    // A ring of one block around: the rim of a near gripper is where its depth is worst.
    let near = |x: u32, y: u32| {
        let (xs, ys) = (x.saturating_sub(1)..=(x + 1).min(columns - 1), y.saturating_sub(1)..=(y + 1).min(rows - 1));
        ys.flat_map(|y| xs.clone().map(move |x| (x, y))).any(|(x, y)| attached[(y * columns + x) as usize])
    };
    let blocks: Vec<bool> = (0..columns * rows).map(|b| near(b % columns, b / columns)).collect();
    let pixel = |i: u32| blocks[((i / width / BLOCK) * columns + i % width / BLOCK) as usize];
    Some((0..width * height).map(pixel).collect())
}

fn is_attached(views: &[PosedDepth], column: u32, row: u32) -> bool {
    // Readings of the block and its surroundings, over all views: (view, pixel, depth).
    let (width, height) = (views[0].depth.width, views[0].depth.height);
    let margin = BLOCK / 2;
    let us = (column * BLOCK).saturating_sub(margin)..(column * BLOCK + BLOCK + margin).min(width);
    let vs = (row * BLOCK).saturating_sub(margin)..(row * BLOCK + BLOCK + margin).min(height);
    let mut readings = Vec::new();
    for (i, view) in views.iter().enumerate() {
        for v in vs.clone() {
            readings.extend(us.clone().filter_map(|u| Some((i, u, v, view.depth.at(u, v)?))));
        }
    }
    let mut seen_by: Vec<usize> = readings.iter().map(|r| r.0).collect();
    seen_by.dedup();
    if readings.len() < MIN_READINGS || seen_by.len() < MIN_VIEWS {
        return false;
    }
    let mut depths: Vec<f32> = readings.iter().map(|r| r.3).collect();
    depths.sort_unstable_by(f32::total_cmp);
    let at = |share: f32| depths[((depths.len() - 1) as f32 * share) as usize];
    let median = at(0.5);
    if at(0.95) - at(0.05) > STATIC_SPREAD * median {
        return false;
    }
    let (mut through, mut supported) = (0_u32, 0_u32);
    // A sample of the readings is testimony enough.
    for &(i, u, v, z) in readings.iter().step_by(readings.len().div_ceil(32)) {
        let p = views[i].intrinsics.unproject(u.into(), v.into(), z.into());
        let in_table = views[i].table_from_camera * p;
        for (_, other) in views.iter().enumerate().filter(|(j, _)| *j != i) {
            match look_at(other, &in_table) {
                Some(Testimony::SeesThrough) => through += 1,
                Some(Testimony::Supports) => supported += 1,
                None => {}
            }
        }
    }
    f64::from(through) >= MIN_SEEN_THROUGH * f64::from((through + supported).max(1))
}

enum Testimony {
    SeesThrough,
    Supports,
}

fn look_at(view: &PosedDepth, in_table: &Point3<f64>) -> Option<Testimony> {
    let p = view.table_from_camera.inverse_transform_point(in_table);
    let (u, v) = view.intrinsics.project(&p)?;
    let (u, v) = (u.round(), v.round());
    if u < 0.0 || v < 0.0 || u >= f64::from(view.depth.width) || v >= f64::from(view.depth.height) {
        return None;
    }
    let measured = f64::from(view.depth.at(u as u32, v as u32)?);
    let slack = (SEES_THROUGH.0 * p.z).max(SEES_THROUGH.1);
    if measured > p.z + slack {
        Some(Testimony::SeesThrough)
    } else if measured > p.z - slack {
        Some(Testimony::Supports)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    /// Views of a far wall from a camera that moves sideways, a gripper at 0.1 m in the upper left corner.
    fn views(gripper: bool) -> Vec<PosedDepth> {
        let intrinsics = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
        let view = |i: u32| {
            let metres = (0..64 * 48).map(|p| if gripper && p % 64 < 16 && p / 64 < 16 { 0.1 } else { 1.0 }).collect();
            let rotation = UnitQuaternion::identity();
            PosedDepth {
                intrinsics,
                depth: DepthImage { width: 64, height: 48, metres },
                table_from_camera: Isometry3::from_parts(
                    Translation3::from(Vector3::new(0.1 * f64::from(i), 0.0, 0.0)),
                    rotation,
                ),
            }
        };
        (0..6).map(view).collect()
    }

    #[test]
    fn a_gripper_is_found_and_a_wall_at_constant_depth_is_not() {
        let mask = find(&views(true)).expect("gripper");
        assert!(mask[5 * 64 + 5]);
        assert!(!mask[40 * 64 + 40]);
        assert_eq!(find(&views(false)), None);
    }
}
