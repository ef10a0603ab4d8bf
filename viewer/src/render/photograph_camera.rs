//! The camera of a photograph: where a place of the table frame lies in the picture. Pure figures, for the list of photographs and
//! for the graphics device.

use glam::{Mat4, Quat, Vec2, Vec3};
use semascan_protocol as wire;

/// A pinhole camera at a pose. The centre of the first pixel is (0, 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotographCamera {
    /// From the table frame (metres) to the camera's: x right, y down, z forward.
    pub camera_from_table: Mat4,
    /// Focal lengths, pixels.
    pub focal: Vec2,
    /// Principal point, pixels.
    pub center: Vec2,
    /// Columns and rows of the picture.
    pub size: Vec2,
}

impl PhotographCamera {
    /// From a view's pose `table_from_camera` and camera as the agent sent them; `None` if their figures make no camera.
    pub fn from_wire(pose: &wire::Pose, camera: &wire::Intrinsics) -> Option<Self> {
        let rotation = Quat::from_xyzw(pose.qx as f32, pose.qy as f32, pose.qz as f32, pose.qw as f32);
        let translation = Vec3::new(pose.tx as f32, pose.ty as f32, pose.tz as f32);
        let focal = Vec2::new(camera.fx as f32, camera.fy as f32);
        let center = Vec2::new(camera.cx as f32, camera.cy as f32);
        let size = Vec2::new(camera.width as f32, camera.height as f32);
        let valid_pose = rotation.is_finite() && rotation.length_squared() > 0.5 && translation.is_finite();
        let valid_camera =
            focal.is_finite() && focal.min_element() > 0.0 && center.is_finite() && size.min_element() >= 1.0;
        (valid_pose && valid_camera).then(|| Self {
            camera_from_table: Mat4::from_rotation_translation(rotation.normalize(), translation).inverse(),
            focal,
            center,
            size,
        })
    }

    /// Where the camera stands, metres, table frame.
    pub fn eye(&self) -> Vec3 {
        self.camera_from_table.inverse().transform_point3(Vec3::ZERO)
    }

    /// The pixel that shows a place (metres, table frame), and how far in front of the camera that is, metres; `None` if it lies
    /// behind the camera or outside of the picture.
    pub fn project(&self, place: Vec3) -> Option<(Vec2, f32)> {
        let p = self.camera_from_table.transform_point3(place);
        if p.z.is_nan() || p.z <= 1e-4 {
            return None;
        }
        let pixel = self.focal * p.truncate() / p.z + self.center;
        let is_inside = pixel.cmpge(Vec2::splat(-0.5)).all() && pixel.cmplt(self.size - 0.5).all();
        is_inside.then_some((pixel, p.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a metre above the table, looking down; its x is the table's, its y the table's -y.
    fn camera() -> PhotographCamera {
        let pose = wire::Pose { qx: 1.0, tz: 0.5, ..wire::Pose::default() };
        let intrinsics = wire::Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5 };
        PhotographCamera::from_wire(&pose, &intrinsics).expect("a camera")
    }

    #[test]
    fn a_place_is_found_in_the_picture() {
        let (pixel, distance) = camera().project(Vec3::new(0.1, 0.05, 0.1)).expect("seen");
        assert!((pixel - Vec2::new(319.5 + 150.0, 239.5 - 75.0)).length() < 1e-3, "{pixel}");
        assert!((distance - 0.4).abs() < 1e-6);
        assert!((camera().eye() - Vec3::new(0.0, 0.0, 0.5)).length() < 1e-6);
    }

    #[test]
    fn what_is_behind_or_beside_is_not_in_it() {
        assert_eq!(camera().project(Vec3::new(0.0, 0.0, 0.6)), None);
        assert_eq!(camera().project(Vec3::new(0.5, 0.0, 0.0)), None);
        assert_eq!(camera().project(Vec3::splat(f32::NAN)), None);
    }

    #[test]
    fn hostile_figures_make_no_camera() {
        let pose = wire::Pose { qw: 1.0, ..wire::Pose::default() };
        let good = wire::Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 };
        assert!(PhotographCamera::from_wire(&pose, &good).is_some());
        for bad in [
            wire::Intrinsics { width: 0, ..good },
            wire::Intrinsics { fx: 0.0, ..good },
            wire::Intrinsics { cy: f64::NAN, ..good },
        ] {
            assert!(PhotographCamera::from_wire(&pose, &bad).is_none());
        }
        assert!(PhotographCamera::from_wire(&wire::Pose { qw: 0.0, ..pose }, &good).is_none());
        assert!(PhotographCamera::from_wire(&wire::Pose { tx: f64::INFINITY, ..pose }, &good).is_none());
    }
}
