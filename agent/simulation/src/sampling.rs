//! Where to look from: the random sampling of [Remanufacturing paper], or a regular turn that covers the part.

use glam::Vec3;
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::random::Stream;
use semascan_inspection::planning::{Viewpoint, look_at};
use semascan_perception::view::Intrinsics;

/// How viewpoints are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Regular steps of the table at three heights.
    Turn,
    /// At random, as P0 sampled its dataset.
    Random,
}

/// What the camera looks at: a sphere around the part, in the table frame, on the table's axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    /// Height of the centre, metres.
    pub(super) height: f64,
    /// Metres.
    pub(super) radius: f64,
    /// Half of the camera's smaller field of view, radians.
    pub(super) half_view: f64,
}

impl Target {
    /// The part between two corners (metres, table frame), seen by `k`.
    pub(super) fn around((low, high): (Vec3, Vec3), k: &Intrinsics) -> Self {
        let smaller = (f64::from(k.width) / k.fx).min(f64::from(k.height) / k.fy);
        Self {
            height: f64::from(0.5 * (low.z + high.z)),
            radius: f64::from(0.5 * (high - low).length()),
            half_view: (0.5 * smaller).atan(),
        }
    }

    fn centre(&self) -> Point3<f64> {
        Point3::new(0.0, 0.0, self.height)
    }

    fn on_sphere(&self, azimuth: f64, polar: f64, r: f64) -> Point3<f64> {
        self.centre() + Vector3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()) * r
    }
}

/// The sampling of [Remanufacturing paper]: azimuth and polar angle 45 to 90 degrees, 400 to 600 mm (here `distance`,
/// metres), the view turned by up to 10 degrees about each of its axes, the table anywhere.
pub(super) fn random_viewpoint(s: &mut Stream, distance: (f32, f32), target: &Target) -> Viewpoint {
    let mut within = |low: f32, high: f32| f64::from(s.range(low, high));
    let (azimuth, polar) = (within(45.0, 90.0).to_radians(), within(45.0, 90.0).to_radians());
    let eye = target.on_sphere(azimuth, polar, within(distance.0, distance.1));
    let mut jitter = || within(-10.0, 10.0).to_radians();
    let turn = UnitQuaternion::from_euler_angles(jitter(), jitter(), jitter());
    let table_angle = within(0.0, 360.0).to_radians();
    Viewpoint { tablebase_from_camera: look_at(eye, target.centre()) * turn, table_angle }
}

/// Viewpoint `index` of `count`.
pub(super) fn viewpoint(sampling: Sampling, seed: u64, index: u32, count: u32, target: &Target) -> Viewpoint {
    match sampling {
        Sampling::Random => random_viewpoint(&mut Stream::new(seed, &format!("viewpoint {index}")), (0.4, 0.6), target),
        // Every turn step at the next of three heights; the second half of many views fills the first one's gaps.
        Sampling::Turn => {
            const HEIGHTS: [f64; 3] = [68.0, 48.0, 86.0];
            let distance = (target.radius / target.half_view.sin() * 1.02).clamp(0.4, 0.6);
            let polar = HEIGHTS[index as usize % HEIGHTS.len()].to_radians();
            let eye = target.on_sphere(67.5_f64.to_radians(), polar, distance);
            let table_angle = std::f64::consts::TAU * f64::from(index) / f64::from(count.max(1));
            Viewpoint { tablebase_from_camera: look_at(eye, target.centre()), table_angle }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: Target = Target { height: 0.15, radius: 0.14, half_view: 0.36 };

    #[test]
    fn random_views_keep_the_ranges_of_the_paper() {
        for index in 0..200 {
            let v = viewpoint(Sampling::Random, 7, index, 200, &TARGET);
            let eye = v.tablebase_from_camera.translation.vector - nalgebra::Vector3::new(0.0, 0.0, TARGET.height);
            let polar = (eye.z / eye.norm()).acos().to_degrees();
            let azimuth = eye.y.atan2(eye.x).to_degrees();
            assert!((0.4..=0.6).contains(&eye.norm()), "{}", eye.norm());
            assert!((45.0..=90.001).contains(&polar) && (44.999..=90.001).contains(&azimuth), "{polar} {azimuth}");
            let axis = v.tablebase_from_camera.rotation * nalgebra::Vector3::z();
            let off = axis.angle(&-eye).to_degrees();
            assert!(off < 15.0, "looks {off} degrees past the part");
        }
    }

    #[test]
    fn a_turn_goes_once_around() {
        let angles: Vec<f64> = (0..12).map(|i| viewpoint(Sampling::Turn, 7, i, 12, &TARGET).table_angle).collect();
        assert!(angles.windows(2).all(|p| (p[1] - p[0] - std::f64::consts::TAU / 12.0).abs() < 1e-9));
    }
}
