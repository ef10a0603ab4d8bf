//! What the numbers of a scene are: BOP has millimetres and a `depth_scale`, but scenes are written with metres in place of
//! either.
//!
//! Where views overlap, poses and depth check each other: a point that one view measures is looked up in the others, with
//! the translations in each unit that comes into question. This gives the factor between poses and depth, not which of
//! the two is wrong: that is said by the size of the depth, if only one of them leaves it plausible. Otherwise the scene is
//! refused, for a figure in the wrong unit is worse than none.

use crate::camera_mask::PosedDepth;
use nalgebra::Isometry3;
use semascan_perception::view::DepthImage;

/// Median depths, in metres, that views of a part or a room have.
const PLAUSIBLE: (f64, f64) = (0.03, 20.0);
/// The same where a scene's depth is floating point numbers whose unit must be guessed: it is that of ordinary sensors.
const ORDINARY: (f64, f64) = (0.1, 10.0);

/// Columns and rows between the pixels that are looked up.
const GRID: usize = 24;
/// Depths that agree differ by less: a share, and metres.
const AGREES: (f64, f64) = (0.015, 0.003);

/// Factors between poses and depth that a wrong unit makes: metres, centimetres, tenths and thousandths of a millimetre.
const FACTORS: [f64; 4] = [1000.0, 10.0, 0.1, 0.001];
/// A factor is believed if this much more of the surface agrees under it than under none: times, and share.
const CLEARLY: (f64, f64) = (2.0, 0.1);

/// What poses and depth say of each other's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finding {
    /// Nothing speaks against the units as they are written.
    Consistent,
    /// The translations are to be multiplied: nothing else leaves the depth plausible.
    Poses(f64),
    /// The depth is to be multiplied: nothing else makes it plausible.
    Depth(f64),
    /// They differ by this factor, and either may be wrong.
    Ambiguous(f64),
}

/// Compares the translations of `views` with their depth, both as the scene's files have them.
pub(super) fn compare(views: &[PosedDepth]) -> Finding {
    let written = agreement(views, 1.0);
    let scored = FACTORS.map(|factor| (factor, agreement(views, factor)));
    let Some((factor, best)) = scored.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Finding::Consistent;
    };
    // Views that show alike surfaces agree best if all of them were taken from one place: that says nothing.
    if best <= CLEARLY.0 * written.max(agreement(views, 0.0)) + CLEARLY.1 {
        return Finding::Consistent;
    }
    let Some(depth) = median_depth(views.iter().map(|v| &v.depth)) else { return Finding::Consistent };
    match (is_plausible(depth), is_plausible(depth / factor)) {
        (true, false) => Finding::Poses(factor),
        (false, true) => Finding::Depth(1.0 / factor),
        _ => Finding::Ambiguous(factor),
    }
}

/// Whether views of a part or a room have this median depth, in metres.
pub(super) fn is_plausible(depth: f64) -> bool {
    (PLAUSIBLE.0..=PLAUSIBLE.1).contains(&depth)
}

/// Metres that a floating point number 1 means, where `median` is the median of such depths and `scale` the metres that
/// `depth_scale` says; `None` if it is none of metres, millimetres and what `depth_scale` says.
pub(crate) fn float_unit(median: f64, scale: f64) -> Option<f64> {
    let ordinary = |unit: &f64| (ORDINARY.0..=ORDINARY.1).contains(&(median * unit));
    [scale, 1.0, 1e-3].into_iter().find(ordinary)
}

/// Median of all depths, in metres.
pub(super) fn median_depth<'a>(pictures: impl Iterator<Item = &'a DepthImage>) -> Option<f64> {
    let sampled = pictures.flat_map(|depth| depth.metres.iter().step_by(17));
    let mut depths: Vec<f32> = sampled.copied().filter(|z| *z > 0.0).collect();
    let middle = depths.len() / 2;
    (!depths.is_empty()).then(|| f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1))
}

/// Share of the points of all views that another view confirms where it should see them, if translations are multiplied
/// by `factor`.
fn agreement(views: &[PosedDepth], factor: f64) -> f64 {
    let scaled = |pose: &Isometry3<f64>| {
        let mut pose = *pose;
        // Of the recorded pose, camera_from_table: its inverse has the same factor.
        pose.translation.vector *= factor;
        pose
    };
    let poses: Vec<Isometry3<f64>> = views.iter().map(|v| scaled(&v.table_from_camera)).collect();
    let (mut points, mut confirmed) = (0_u32, 0_u32);
    for (i, view) in views.iter().enumerate() {
        for (j, other) in views.iter().enumerate().filter(|(j, _)| *j != i) {
            let other_from_view = poses[j].inverse() * poses[i];
            let (width, height) = (view.depth.width, view.depth.height);
            for v in (0..height).step_by((height as usize / GRID).max(1)) {
                for u in (0..width).step_by((width as usize / GRID).max(1)) {
                    let Some(z) = view.depth.at(u, v) else { continue };
                    points += 1;
                    let p = other_from_view * view.intrinsics.unproject(u.into(), v.into(), z.into());
                    let pixel = other.intrinsics.project(&p).and_then(|(u, v)| other.intrinsics.pixel(u, v));
                    let measured = pixel.and_then(|i| other.depth.metres.get(i)).copied().map_or(0.0, f64::from);
                    confirmed += u32::from(measured > 0.0 && (measured - p.z).abs() < AGREES.0 * p.z + AGREES.1);
                }
            }
        }
    }
    if points == 0 { 0.0 } else { f64::from(confirmed) / f64::from(points) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};
    use semascan_perception::view::Intrinsics;

    /// Views of a floor and a ball on it from around; translations times `poses`, depth times `depth`.
    fn views(poses: f64, depth: f32) -> Vec<PosedDepth> {
        let k = Intrinsics { width: 96, height: 72, fx: 110.0, fy: 110.0, cx: 47.5, cy: 35.5 };
        let view = |i: u32| {
            let angle = 0.5 * f64::from(i);
            let eye = Point3::new(0.4 * angle.cos(), 0.4 * angle.sin(), 0.3);
            let mut pose = Isometry3::face_towards(&eye, &Point3::origin(), &-Vector3::z());
            let metres = (0..96 * 72_u32)
                .map(|p| {
                    let ray = pose.rotation * k.unproject((p % 96).into(), (p / 96).into(), 1.0).coords;
                    let center = Point3::new(0.0, 0.0, 0.04) - eye;
                    let (a, b) = (ray.norm_squared(), ray.dot(&center));
                    let root = b * b - a * (center.norm_squared() - 0.04 * 0.04);
                    let floor = if ray.z < 0.0 { -eye.z / ray.z } else { 0.0 };
                    depth * if root > 0.0 { (b - root.sqrt()) / a } else { floor } as f32
                })
                .collect();
            pose.translation.vector *= poses;
            PosedDepth { intrinsics: k, depth: DepthImage { width: 96, height: 72, metres }, table_from_camera: pose }
        };
        (0..5).map(view).collect()
    }

    #[test]
    fn a_unit_that_only_one_reading_makes_plausible_is_found() {
        assert_eq!(compare(&views(1.0, 1.0)), Finding::Consistent);
        assert_eq!(compare(&views(1e-3, 1.0)), Finding::Poses(1000.0));
        assert_eq!(compare(&views(1e3, 1.0)), Finding::Poses(0.001));
        assert!(matches!(compare(&views(1.0, 1e-3)), Finding::Depth(f) if (f - 1000.0).abs() < 1e-6));
        assert!(matches!(compare(&views(1.0, 1e3)), Finding::Depth(f) if (f - 1e-3).abs() < 1e-9));
    }

    #[test]
    fn a_factor_of_ten_is_not_guessed() {
        assert_eq!(compare(&views(0.1, 1.0)), Finding::Ambiguous(10.0));
        assert_eq!(compare(&views(1.0, 10.0)), Finding::Ambiguous(10.0));
    }

    #[test]
    fn one_view_or_views_of_nothing_in_common_say_nothing() {
        assert_eq!(compare(&views(1e-3, 1.0)[..1]), Finding::Consistent);
        assert_eq!(compare(&[]), Finding::Consistent);
        // A wall, seen in places that have nothing in common.
        let k = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
        let wall = |i: u32| PosedDepth {
            intrinsics: k,
            depth: DepthImage { width: 64, height: 48, metres: vec![0.5; 64 * 48] },
            table_from_camera: Isometry3::translation(f64::from(i), 0.0, 0.0),
        };
        assert_eq!(compare(&(0..4).map(wall).collect::<Vec<_>>()), Finding::Consistent);
    }

    #[test]
    fn floating_point_depth_is_what_depth_scale_says_if_that_can_be() {
        assert_eq!(float_unit(480.0, 1e-3), Some(1e-3));
        assert_eq!(float_unit(4800.0, 1e-4), Some(1e-4));
        assert_eq!(float_unit(0.48, 1e-4), Some(1.0));
        assert_eq!(float_unit(480.0, 1e-4), Some(1e-3));
        assert_eq!(float_unit(0.48, 1.0), Some(1.0));
        assert_eq!(float_unit(1e6, 1e-3), None);
    }
}
