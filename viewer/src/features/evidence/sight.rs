//! Which photographs show a place on the surface, the best first: the one with the most pixels on a patch of it, by the rule
//! that textures are made by, too (`semascan_geometry::sight`), less what blur takes. What other surface hides is left out.

use crate::render::photograph_camera::PhotographCamera;
use crate::state::views::ViewEntry;
use glam::{DVec3, Vec2, Vec3};
use semascan_geometry::occupancy::Occupancy;
use semascan_geometry::sight::{Blur, pixels_per_metre};
use std::fmt::Write;

/// How a photograph shows a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Number of the view.
    pub view: u32,
    /// Its camera.
    pub camera: PhotographCamera,
    /// The pixel.
    pub pixel: Vec2,
    /// Distance in front of the camera, metres.
    pub distance: f32,
    /// Cosine between the surface's normal and the way to the camera.
    pub cosine: f32,
    /// Pixels that a millimetre of the surface covers, mean over its directions.
    pub pixels_per_millimetre: f32,
    /// Share of these that blur leaves, against the photographs of the other views; 1 if it is not known.
    pub sharp: f32,
}

/// The photographs that show a place of the table frame (metres) with this unit normal, the best first.
///
/// * `surface`: where surface is; `None` if that is not known, and nothing is taken for hidden.
pub fn sights<'a>(
    place: Vec3,
    normal: Vec3,
    views: impl Iterator<Item = &'a ViewEntry> + Clone,
    surface: Option<&Occupancy>,
) -> Vec<Sight> {
    let blur = Blur::among(views.clone().filter(|view| view.accepted).map(|view| view.sharpness));
    let accepted = views.filter(|view| view.accepted);
    let seen = accepted.filter_map(|view| {
        let camera = PhotographCamera::from_wire(view.pose.as_ref()?, view.intrinsics.as_ref()?)?;
        let (pixel, distance) = camera.project(place)?;
        let to_camera = camera.eye() - place;
        let (way, toward) = (to_camera.length(), to_camera.normalize_or_zero());
        let cosine = toward.dot(normal);
        let pixels_per_metre =
            pixels_per_metre(camera.focal.to_array().map(f64::from), cosine.into(), distance.into())?;
        let double = |v: Vec3| v.as_dvec3().to_array();
        if surface.is_some_and(|s| s.is_hidden(double(place), double(normal), double(toward), way.into())) {
            return None;
        }
        let pixels_per_millimetre = (pixels_per_metre * 1e-3) as f32;
        let sharp = blur.leaves(view.sharpness);
        Some(Sight { view: view.index, camera, pixel, distance, cosine, pixels_per_millimetre, sharp })
    });
    let mut list: Vec<Sight> = seen.collect();
    let worth = |sight: &Sight| sight.pixels_per_millimetre * sight.sharp;
    list.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    list
}

/// Closed curves on the surface (metres, table frame) as a path of SVG in the pixels of a photograph, whose first pixel is from 0 to 1.
/// What lies outside the picture is left out.
pub fn path_of(camera: &PhotographCamera, curves: &[Vec<[f64; 3]>]) -> String {
    let mut path = String::new();
    for curve in curves {
        let mut is_drawing = false;
        for place in curve.iter().chain(curve.first()) {
            let Some((pixel, _)) = camera.project(DVec3::from(*place).as_vec3()) else {
                is_drawing = false;
                continue;
            };
            let to = if is_drawing { 'L' } else { 'M' };
            // Writing to a string does not fail.
            let _ = write!(path, "{to}{:.2} {:.2}", pixel.x + 0.5, pixel.y + 0.5);
            is_drawing = true;
        }
    }
    path
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use semascan_protocol::{Intrinsics, Pose, ViewReport};

    /// A view from `height` metres above the table at `x`, looking down.
    pub(crate) fn view(index: u32, x: f64, height: f64) -> ViewEntry {
        ViewEntry::from(&ViewReport {
            index,
            accepted: true,
            table_from_camera: Some(Pose { qx: 1.0, tx: x, tz: height, ..Pose::default() }),
            intrinsics: Some(Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5 }),
            ..ViewReport::default()
        })
    }

    fn seen_by(views: &[ViewEntry], normal: Vec3, surface: Option<&Occupancy>) -> Vec<u32> {
        sights(Vec3::ZERO, normal, views.iter(), surface).iter().map(|sight| sight.view).collect()
    }

    #[test]
    fn the_nearest_and_straightest_photograph_comes_first() {
        let views = [view(0, 0.0, 0.8), view(1, 0.0, 0.4), view(2, 0.2, 0.4), view(3, 2.0, 0.4)];
        assert_eq!(seen_by(&views, Vec3::Z, None), [1, 2, 0], "the last does not have it in its picture");
        let best = sights(Vec3::ZERO, Vec3::Z, views.iter(), None)[0];
        assert!((best.pixels_per_millimetre - 1.5).abs() < 1e-4, "600 / 400 mm: {}", best.pixels_per_millimetre);
        assert!((best.cosine - 1.0).abs() < 1e-6 && (best.pixel - Vec2::new(319.5, 239.5)).length() < 1e-3);
    }

    #[test]
    fn a_blurred_photograph_comes_later() {
        let mut views = [view(0, 0.0, 0.4), view(1, 0.0, 0.5), view(2, 0.1, 0.5)];
        for (view, sharpness) in views.iter_mut().zip([0.05, 0.4, 0.5]) {
            view.sharpness = Some(sharpness);
        }
        assert_eq!(seen_by(&views, Vec3::Z, None), [1, 2, 0]);
        let last = sights(Vec3::ZERO, Vec3::Z, views.iter(), None)[2];
        assert!(last.sharp < 0.5 && (last.pixels_per_millimetre - 1.5).abs() < 1e-4, "{last:?}");
        views[0].accepted = false;
        views[2].sharpness = None;
        let rest = sights(Vec3::ZERO, Vec3::Z, views.iter(), None);
        assert!(rest.len() == 2 && rest.iter().all(|sight| sight.sharp == 1.0), "{rest:?}");
    }

    #[test]
    fn an_outline_is_drawn_where_the_camera_saw_it() {
        let views = [view(0, 0.0, 0.6)];
        let camera = sights(Vec3::ZERO, Vec3::Z, views.iter(), None)[0].camera;
        let square = vec![[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.01, 0.0]];
        assert_eq!(path_of(&camera, &[square]), "M320.00 240.00L330.00 240.00L330.00 230.00L320.00 240.00");
        let beside = vec![[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.01, 0.0, 0.0]];
        assert_eq!(path_of(&camera, &[beside]), "M320.00 240.00M330.00 240.00L320.00 240.00");
        assert_eq!(path_of(&camera, &[Vec::new()]), "");
    }

    #[test]
    fn what_faces_away_or_is_hidden_is_not_shown() {
        let mut rejected = view(1, 0.0, 0.4);
        rejected.accepted = false;
        let mut without_pose = view(2, 0.0, 0.4);
        without_pose.pose = None;
        let views = [view(0, 0.0, 0.4), rejected, without_pose, view(3, 0.2, 0.4)];
        assert_eq!(seen_by(&views, Vec3::Z, None), [0, 3]);
        assert!(seen_by(&views, Vec3::NEG_Z, None).is_empty());
        // A roof over the place hides it from above; the camera of view 3 looks past its edge.
        let roof = |i: usize| [-0.03 + 1e-3 * (i % 60) as f32, -0.03 + 1e-3 * (i / 60) as f32, 0.08];
        let floor = |i: usize| [-0.1 + 4e-3 * (i % 50) as f32, -0.1 + 4e-3 * (i / 50) as f32, 0.0];
        let points: Vec<[f32; 3]> = (0..3600).map(roof).chain((0..2500).map(floor)).collect();
        let surface = Occupancy::of(&points, 1e-3).expect("points");
        assert_eq!(seen_by(&views, Vec3::Z, Some(&surface)), [3]);
        // A roof above the camera hides nothing.
        let low = [view(5, 0.0, 0.06)];
        assert_eq!(seen_by(&low, Vec3::Z, Some(&surface)), [5]);
    }
}
