//! A camera pose as line segments: the pyramid of its field of view, a tick on its upper side, its axis.

use super::request::CameraFrustum;
use super::segment::{Segment, polyline};
use crate::display::ColorScheme;
use glam::Vec3;

/// The segments of one frustum, drawn `depth` metres deep.
pub fn segments(frustum: &CameraFrustum, depth: f32, color_scheme: ColorScheme) -> Vec<Segment> {
    let (color, width) = match (frustum.current, color_scheme) {
        (true, ColorScheme::Dark) => ([0x5e, 0xc8, 0xff, 0xff], 2.0),
        (true, ColorScheme::Light) => ([0x0b, 0x6c, 0xb8, 0xff], 2.0),
        (false, ColorScheme::Dark) => ([0xb8, 0xc4, 0xd2, 0x48], 1.0),
        (false, ColorScheme::Light) => ([0x4a, 0x58, 0x6a, 0x48], 1.0),
    };
    let depth = if frustum.current { depth } else { depth * 0.5 };
    let [w, h] = frustum.half_size;
    // Camera frame: x right, y down, z forward.
    let table = |x: f32, y: f32, z: f32| frustum.translation + frustum.rotation * (Vec3::new(x, y, z) * depth);
    let eye = frustum.translation;
    let corners = [table(-w, -h, 1.0), table(w, -h, 1.0), table(w, h, 1.0), table(-w, h, 1.0), table(-w, -h, 1.0)];
    let mut segments: Vec<Segment> = polyline(&corners, color, width).collect();
    segments.extend(corners[..4].iter().map(|corner| Segment { from: eye, to: *corner, color, width }));
    let roof = [table(-w * 0.4, -h * 1.12, 1.0), table(0.0, -h * 1.5, 1.0), table(w * 0.4, -h * 1.12, 1.0)];
    segments.extend(polyline(&[roof[0], roof[1], roof[2], roof[0]], color, width));
    segments
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn frustum(current: bool) -> CameraFrustum {
        // Looks straight down from 0.5 m: half a turn about x takes camera z (forward) to table -z.
        let rotation = Quat::from_rotation_x(std::f32::consts::PI);
        CameraFrustum { rotation, translation: Vec3::new(0.0, 0.0, 0.5), half_size: [0.5, 0.4], current }
    }

    #[test]
    fn the_pyramid_opens_where_the_camera_looks() {
        let segments = segments(&frustum(true), 0.1, ColorScheme::Dark);
        let rays: Vec<_> = segments.iter().filter(|s| s.from == Vec3::new(0.0, 0.0, 0.5)).collect();
        assert_eq!(rays.len(), 4);
        for ray in rays {
            assert!((ray.to.z - 0.4).abs() < 1e-6 && (ray.to.x.abs() - 0.05).abs() < 1e-6, "{}", ray.to);
        }
    }

    #[test]
    fn the_roof_is_on_the_upper_side_of_the_picture() {
        // Image y points down; after half a turn about x that is table -y, so up is table +y.
        let segments = segments(&frustum(true), 0.1, ColorScheme::Dark);
        let highest = segments.iter().flat_map(|s| [s.from.y, s.to.y]).fold(f32::MIN, f32::max);
        assert!((highest - 0.06).abs() < 1e-6, "{highest}");
    }

    #[test]
    fn earlier_poses_are_smaller_and_fainter() {
        let (now, before) =
            (segments(&frustum(true), 0.1, ColorScheme::Light), segments(&frustum(false), 0.1, ColorScheme::Light));
        assert!(before[0].color[3] < now[0].color[3] && before[0].width < now[0].width);
        assert!(before[4].from.distance(before[4].to) < now[4].from.distance(now[4].to));
    }
}
