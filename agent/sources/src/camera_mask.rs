//! Finds the pixels that show the robot itself: a gripper or cable that moves with the camera.
//!
//! Two tests, both needed. Its depth stays the same from view to view; and other views look straight through the place
//! where it would be if it belonged to the scene (a part that turns under the camera passes the first test alone). A place
//! of which no view says anything is not known to be the robot, and stays.
//! Depth of near, dark grippers is sparse and noisy, so both tests work on blocks of pixels pooled over all views.
//!
//! What is found grows over ragged rims, but only where it is clearly nearer than the scene, as a gripper is: what stands
//! still behind a turntable is far, and must not take the part before it. A result that would take most of the picture
//! is no robot, and is not applied.

use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use semascan_perception::view::{DepthImage, Intrinsics};

/// Edge of a block in pixels.
const BLOCK: u32 = 8;

/// Fewest views, and fewest depth readings of a block, for a verdict.
const MIN_VIEWS: usize = 4;
const MIN_READINGS: usize = 12;

/// Fewest times that another view says something of a block's place, for a verdict.
const MIN_TESTIMONY: u32 = 4;

/// Deviation of a pixel's depth from its median over the views (90th percentile over a block) that still counts as
/// unchanged, as a share of the depth.
const STATIC_DEVIATION: f32 = 0.05;

/// A view sees through a point if it measures this much farther behind it (share of depth, and metres).
const SEES_THROUGH: (f64, f64) = (0.1, 0.02);

/// Largest share of the views' testimony that may support a place in the scene.
const MOST_SUPPORT: f64 = 0.3;

/// A block belongs to its attached neighbour if nearly all of it is nearer than this many times the neighbour's depth; and
/// that may take neighbours only if the scene is farther than as many times its depth.
const AS_NEAR: f32 = 1.5;

/// Largest share of the pixels, and of those with depth, that may be the robot.
const MOST_TAKEN: f64 = 0.5;

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraPixels {
    /// Nothing moves with the camera, or there are too few views with poses to know.
    Nothing,
    /// Pixels to ignore in every view (row-major).
    Found {
        /// Whether the pixel is to be ignored.
        ignore: Vec<bool>,
        /// Their share of the pixels that have depth.
        share: f64,
    },
    /// So many that they are no robot: none is to be ignored.
    TooMany {
        /// The share of the pixels that have depth.
        share: f64,
    },
}

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

/// What a block of pixels shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// Something that moves with the camera.
    Attached,
    /// A place of the scene: other views confirm it.
    Scene,
    /// Something whose depth stays the same, and of whose place the views say too little.
    Still,
    /// Too little is known.
    Unknown,
}

/// The pixels that show the robot in every view.
pub fn find(views: &[PosedDepth]) -> CameraPixels {
    let Some(first) = views.first() else { return CameraPixels::Nothing };
    let (width, height) = (first.depth.width, first.depth.height);
    if views.len() < MIN_VIEWS || views.iter().any(|v| (v.depth.width, v.depth.height) != (width, height)) {
        return CameraPixels::Nothing;
    }
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let block = |b: u32| (b % columns, b / columns);
    let verdicts: Vec<Verdict> = (0..columns * rows).into_par_iter().map(|b| verdict(views, block(b))).collect();
    if !verdicts.contains(&Verdict::Attached) {
        return CameraPixels::Nothing;
    }
    let ranges: Vec<_> = (0..columns * rows).into_par_iter().map(|b| depth_range(views, block(b))).collect();
    let blocks = grown(&verdicts, columns, &ranges);
    let at = |i: u32| blocks[((i / width / BLOCK) * columns + i % width / BLOCK) as usize];
    let ignore: Vec<bool> = (0..width * height).map(at).collect();
    let (mut measured, mut taken) = (0_u64, 0_u64);
    for view in views {
        for (_, ignored) in view.depth.metres.iter().zip(&ignore).filter(|(z, _)| **z > 0.0) {
            measured += 1;
            taken += u64::from(*ignored);
        }
    }
    let share = taken as f64 / measured.max(1) as f64;
    let of_picture = ignore.iter().filter(|i| **i).count() as f64 / ignore.len() as f64;
    if share.max(of_picture) > MOST_TAKEN {
        CameraPixels::TooMany { share }
    } else {
        CameraPixels::Found { ignore, share }
    }
}

/// Median and 90th percentile of a block's depth over all views; `None` without readings.
fn depth_range(views: &[PosedDepth], block: (u32, u32)) -> Option<(f32, f32)> {
    let mut depths: Vec<f32> = readings(views, block, 0).iter().map(|r| r.3).collect();
    depths.sort_unstable_by(f32::total_cmp);
    let last = depths.len().checked_sub(1)?;
    Some((depths[last / 2], depths[last * 9 / 10]))
}

/// The attached blocks, with those beside a near one that are, in all views, about as near: ragged rims and slanted sides;
/// and with a ring of one block around these, because the rim of a near gripper is where its depth is worst.
fn grown(verdicts: &[Verdict], columns: u32, ranges: &[Option<(f32, f32)>]) -> Vec<bool> {
    let rows = verdicts.len() as u32 / columns;
    let around = |b: u32| {
        let (x, y) = (b % columns, b / columns);
        let xs = x.saturating_sub(1)..=(x + 1).min(columns - 1);
        let ys = y.saturating_sub(1)..=(y + 1).min(rows - 1);
        ys.flat_map(move |y| xs.clone().map(move |x| y * columns + x))
    };
    let scene = nearest_of_the_scene(verdicts, ranges);
    let mut taken: Vec<bool> = verdicts.iter().map(|v| *v == Verdict::Attached).collect();
    // Each with the depth that its own neighbours may have: the limit of the block where the region began.
    let limit = |b: u32| {
        let limit = AS_NEAR * ranges[b as usize]?.0;
        scene.is_some_and(|scene| limit < scene).then_some((b, limit))
    };
    let blocks = || 0..verdicts.len() as u32;
    let mut near: Vec<(u32, f32)> = blocks().filter(|&b| taken[b as usize]).filter_map(limit).collect();
    // Where a robot is in sight, what is as near before the scene and as still is another part of it.
    if !near.is_empty() {
        let still: Vec<(u32, f32)> =
            blocks().filter(|&b| verdicts[b as usize] == Verdict::Still).filter_map(limit).collect();
        still.iter().for_each(|(b, _)| taken[*b as usize] = true);
        near.extend(still);
    }
    let mut next = 0;
    while let Some(&(b, limit)) = near.get(next) {
        next += 1;
        for n in around(b) {
            let is_near = ranges[n as usize].is_some_and(|(_, far)| far < limit);
            if is_near && !taken[n as usize] {
                taken[n as usize] = true;
                near.push((n, limit));
            }
        }
    }
    for n in near.iter().flat_map(|(b, _)| around(*b)) {
        taken[n as usize] = true;
    }
    taken
}

/// Depth from which on nine tenths of the scene's blocks lie; `None` if no block is known to be the scene's.
fn nearest_of_the_scene(verdicts: &[Verdict], ranges: &[Option<(f32, f32)>]) -> Option<f32> {
    let of_scene = verdicts.iter().zip(ranges).filter(|(v, _)| **v == Verdict::Scene);
    let mut depths: Vec<f32> = of_scene.filter_map(|(_, range)| Some((*range)?.0)).collect();
    depths.sort_unstable_by(f32::total_cmp);
    depths.get(depths.len() / 10).copied()
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

/// What the views say of a block together.
fn verdict(views: &[PosedDepth], block: (u32, u32)) -> Verdict {
    let readings = readings(views, block, BLOCK / 2);
    let mut seen_by: Vec<usize> = readings.iter().map(|r| r.0).collect();
    seen_by.dedup();
    if readings.len() < MIN_READINGS || seen_by.len() < MIN_VIEWS {
        return Verdict::Unknown;
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
    if through + supported < MIN_TESTIMONY {
        return if is_static(&readings) { Verdict::Still } else { Verdict::Unknown };
    }
    if f64::from(supported) > MOST_SUPPORT * f64::from(through + supported) {
        return Verdict::Scene;
    }
    if is_static(&readings) { Verdict::Attached } else { Verdict::Unknown }
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

    fn found(views: &[PosedDepth]) -> Option<Vec<bool>> {
        match find(views) {
            CameraPixels::Found { ignore, .. } => Some(ignore),
            _ => None,
        }
    }

    #[test]
    fn a_gripper_is_found_and_a_wall_at_constant_depth_is_not() {
        let mask = found(&views(true)).expect("gripper");
        assert!(mask[5 * 64 + 5] && mask[5 * 64 + 14]);
        assert!(!mask[40 * 64 + 40]);
        assert_eq!(find(&views(false)), CameraPixels::Nothing);
    }

    #[test]
    fn places_that_no_other_view_says_anything_of_are_no_robot() {
        // Steps of more than the picture is wide: no two views have anything in common.
        let mut apart = views(false);
        for (i, view) in apart.iter_mut().enumerate() {
            view.table_from_camera = Isometry3::translation(3.0 * i as f64, 0.0, 0.0);
        }
        assert_eq!(find(&apart), CameraPixels::Nothing);
    }

    /// A box of 0.12 m that turns before a standing camera, as the camera's poses in the box's frame have it; behind it a
    /// wall that stands still, `far` metres away, in the upper `share` of the rows.
    fn turntable(far: f32, share: f64) -> Vec<PosedDepth> {
        let k = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
        let view = |i: u32| {
            let turned = Isometry3::rotation(Vector3::y() * (0.5 * f64::from(i)));
            let camera_from_part = Isometry3::translation(0.0, 0.0, 0.6) * turned;
            let part_from_camera = camera_from_part.inverse();
            let metres = (0..64 * 48_u32).map(|p| {
                let ray = k.unproject((p % 64).into(), (p / 64).into(), 1.0).coords;
                let (from, along) = (part_from_camera.translation.vector, part_from_camera.rotation * ray);
                // Slabs of the box: where the ray enters the last of them before it leaves the first.
                let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
                for axis in 0..3 {
                    let (a, b) = ((-0.06 - from[axis]) / along[axis], (0.06 - from[axis]) / along[axis]);
                    (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
                }
                let wall = if f64::from(p / 64) < 48.0 * share { far } else { 0.0 };
                if enters < leaves { enters as f32 } else { wall }
            });
            let depth = DepthImage { width: 64, height: 48, metres: metres.collect() };
            PosedDepth { intrinsics: k, depth, table_from_camera: part_from_camera }
        };
        (0..12).map(view).collect()
    }

    #[test]
    fn what_stands_still_behind_a_turntable_does_not_take_the_part() {
        for (far, share) in [(1.2, 0.3), (1.2, 1.0), (6.0, 0.45), (6.0, 1.0)] {
            let views = turntable(far, share);
            let ignored = found(&views).unwrap_or_else(|| vec![false; 64 * 48]);
            let (mut part, mut taken) = (0, 0);
            for view in &views {
                for (z, ignored) in view.depth.metres.iter().zip(&ignored) {
                    part += u32::from(*z > 0.0 && *z < 0.7);
                    taken += u32::from(*z > 0.0 && *z < 0.7 && *ignored);
                }
            }
            assert!(part > 1000 && taken * 20 < part, "{far} m, {share}: {taken} of {part} pixels of the part");
        }
    }

    #[test]
    fn what_would_be_most_of_the_picture_is_no_robot() {
        // Poses that are wrong make everything look attached.
        let mut wrong = views(false);
        for (i, view) in wrong.iter_mut().enumerate() {
            view.table_from_camera = Isometry3::translation(0.0, 0.0, 0.3 * i as f64);
        }
        assert!(!matches!(find(&wrong), CameraPixels::Found { .. }), "{:?}", find(&wrong));
    }
}
