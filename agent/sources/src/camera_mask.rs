//! Finds the pixels that show the robot itself: a gripper or cable that moves with the camera.
//!
//! Two tests, both needed. Its depth stays the same from view to view; and other views look straight through the place
//! where it would be if it belonged to the scene (a part that turns under the camera passes the first test alone).
//! Depth of near, dark grippers is sparse and noisy, so both tests work on blocks of pixels pooled over all views.

use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use semascan_perception::view::{DepthImage, Intrinsics};

/// Edge of a block in pixels.
const BLOCK: u32 = 8;

/// Fewest views, and fewest depth readings of a block, for a verdict.
const MIN_VIEWS: usize = 4;
const MIN_READINGS: usize = 12;

/// Deviation of a pixel's depth from its median over the views (90th percentile over a block) that still counts as
/// unchanged, as a share of the depth.
const STATIC_DEVIATION: f32 = 0.05;

/// A view sees through a point if it measures this much farther behind it (share of depth, and metres).
const SEES_THROUGH: (f64, f64) = (0.1, 0.02);

/// Largest share of the views' testimony that may support a place in the scene.
const MOST_SUPPORT: f64 = 0.3;

/// A block belongs to its attached neighbour if nearly all of it is nearer than this many times the neighbour's depth.
const AS_NEAR: f32 = 1.5;

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
    let block = |b: u32| (b % columns, b / columns);
    let mut attached: Vec<bool> = (0..columns * rows).into_par_iter().map(|b| is_attached(views, block(b))).collect();
    if !attached.contains(&true) {
        return None;
    }
    extend(&mut attached, columns, &(0..columns * rows).map(|b| depth_range(views, block(b))).collect::<Vec<_>>());
    // A ring of one block around: the rim of a near gripper is where its depth is worst.
    let near = |x: u32, y: u32| {
        let (xs, ys) = (x.saturating_sub(1)..=(x + 1).min(columns - 1), y.saturating_sub(1)..=(y + 1).min(rows - 1));
        ys.flat_map(|y| xs.clone().map(move |x| (x, y))).any(|(x, y)| attached[(y * columns + x) as usize])
    };
    let blocks: Vec<bool> = (0..columns * rows).map(|b| near(b % columns, b / columns)).collect();
    Some((0..width * height).map(|i| blocks[((i / width / BLOCK) * columns + i % width / BLOCK) as usize]).collect())
}

/// Median and 90th percentile of a block's depth over all views; `None` without readings.
fn depth_range(views: &[PosedDepth], block: (u32, u32)) -> Option<(f32, f32)> {
    let mut depths: Vec<f32> = readings(views, block, 0).iter().map(|r| r.3).collect();
    depths.sort_unstable_by(f32::total_cmp);
    let last = depths.len().checked_sub(1)?;
    Some((depths[last / 2], depths[last * 9 / 10]))
}

/// Takes in the blocks beside an attached one that are, in all views, about as near: ragged rims and slanted sides.
fn extend(attached: &mut [bool], columns: u32, ranges: &[Option<(f32, f32)>]) {
    let rows = attached.len() as u32 / columns;
    // Each with the depth that its own neighbours may have: the limit of the block where the region began.
    let limit = |b: usize| Some((b as u32, AS_NEAR * ranges[b]?.0));
    let mut pending: Vec<(u32, f32)> = (0..attached.len()).filter(|&b| attached[b]).filter_map(limit).collect();
    while let Some((b, limit)) = pending.pop() {
        let (x, y) = (b % columns, b / columns);
        for ny in y.saturating_sub(1)..=(y + 1).min(rows - 1) {
            for nx in x.saturating_sub(1)..=(x + 1).min(columns - 1) {
                let n = ny * columns + nx;
                let near = ranges[n as usize].is_some_and(|(_, far)| far < limit);
                if near && !attached[n as usize] {
                    attached[n as usize] = true;
                    pending.push((n, limit));
                }
            }
        }
    }
}

/// Depth readings of a block and `margin` pixels around it: (view, u, v, depth).
fn readings(views: &[PosedDepth], (column, row): (u32, u32), margin: u32) -> Vec<(usize, u32, u32, f32)> {
    let (width, height) = (views[0].depth.width, views[0].depth.height);
    let us = (column * BLOCK).saturating_sub(margin)..(column * BLOCK + BLOCK + margin).min(width);
    let vs = (row * BLOCK).saturating_sub(margin)..(row * BLOCK + BLOCK + margin).min(height);
    let mut readings = Vec::new();
    for (i, view) in views.iter().enumerate() {
        for v in vs.clone() {
            readings.extend(us.clone().filter_map(|u| Some((i, u, v, view.depth.at(u, v)?))));
        }
    }
    readings
}

fn is_attached(views: &[PosedDepth], block: (u32, u32)) -> bool {
    let readings = readings(views, block, BLOCK / 2);
    let mut seen_by: Vec<usize> = readings.iter().map(|r| r.0).collect();
    seen_by.dedup();
    if readings.len() < MIN_READINGS || seen_by.len() < MIN_VIEWS {
        return false;
    }
    if !is_static(&readings) {
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
    // Nobody's testimony is telling too: a place of the scene that four views show at one pixel is seen by others.
    f64::from(supported) <= MOST_SUPPORT * f64::from(through + supported)
}

/// Whether the depth of each pixel stays the same from view to view; `readings` are (view, u, v, depth).
fn is_static(readings: &[(usize, u32, u32, f32)]) -> bool {
    let mut by_pixel: Vec<(u32, u32, f32)> = readings.iter().map(|&(_, u, v, z)| (u, v, z)).collect();
    by_pixel.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
    let mut deviations = Vec::with_capacity(by_pixel.len());
    for pixel in by_pixel.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|p| p.len() > 1) {
        let median = pixel[pixel.len() / 2].2;
        deviations.extend(pixel.iter().map(|p| (p.2 - median).abs() / median));
    }
    if deviations.len() < MIN_READINGS {
        return false;
    }
    let at = (deviations.len() - 1) * 9 / 10;
    *deviations.select_nth_unstable_by(at, f32::total_cmp).1 <= STATIC_DEVIATION
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
