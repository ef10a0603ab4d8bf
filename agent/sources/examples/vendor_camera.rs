//! A camera of one's own, as its maker or an integrator would write it: a crate outside of this repository that implements one
//! trait, [`Camera`], and hands it to an inspection. Everything else (lenses, registration of depth, connecting again, counting,
//! the inspection itself) is Semascan's.
//!
//! `cargo run -p semascan-sources --example vendor_camera` inspects a ball on a table with it. In a crate of its own the
//! dependencies are `semascan-sources`, `semascan-inspection`, `semascan-perception`, `image` and `nalgebra`.

use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Point3, Vector3};
use semascan_inspection::Inspection;
use semascan_inspection::source::Source;
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_perception::view::{DepthImage, Intrinsics};
use semascan_sources::OpenOptions;
use semascan_sources::camera::{Camera, CameraError, CameraSource, Capture, DepthCamera, Timing};
use semascan_sources::camera_model::{CameraModel, Distortion};
use std::error::Error;
use std::time::Duration;

/// The camera's own library would stand here: this one computes what it sees.
struct AcmeCamera {
    color_camera: CameraModel,
    depth_camera: DepthCamera,
    taken: u32,
}

impl AcmeCamera {
    /// Opens the camera; what its library says of its lenses is all that is needed of it.
    fn connect() -> Result<Self, String> {
        let lens = |width: u32, height: u32, focal: f64| {
            let (cx, cy) = (f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0);
            let intrinsics = Intrinsics { width, height, fx: focal, fy: focal, cx, cy };
            CameraModel::new(intrinsics, Distortion::None).map_err(|error| error.to_string())
        };
        let depth_camera =
            DepthCamera { model: lens(160, 120, 150.0)?, color_from_depth: Isometry3::translation(0.025, 0.0, 0.0) };
        Ok(Self { color_camera: lens(320, 240, 310.0)?, depth_camera, taken: 0 })
    }

    /// Distance along the optical axis at a pixel: a ball of 60 mm that touches a table 0.5 m away.
    fn measured(camera: &CameraModel, camera_at: f64, u: u32, v: u32) -> f64 {
        let Some(ray) = camera.ray_of_pixel(f64::from(u), f64::from(v)) else { return 0.0 };
        let (table, radius) = (0.5, 0.03);
        let center = Point3::new(camera_at, 0.0, table - radius).coords;
        let (a, b) = (ray.norm_squared(), ray.dot(&center));
        let root = b * b - a * (center.norm_squared() - radius * radius);
        if root > 0.0 { (b - root.sqrt()) / a } else { table / Vector3::z().dot(&ray) }
    }
}

impl Camera for AcmeCamera {
    fn description(&self) -> Vec<(String, String)> {
        vec![("camera".to_owned(), "Acme 3D, serial 17".to_owned())]
    }

    fn capture(&mut self, _patience: Duration) -> Result<Option<Capture>, CameraError> {
        self.taken += 1;
        let model = &self.depth_camera.model;
        let (width, height) = (model.intrinsics().width, model.intrinsics().height);
        let pixels = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
        // The ball lies before the colour camera, and so 25 mm beside the depth camera.
        let metres = pixels.map(|(u, v)| Self::measured(model, -0.025, u, v) as f32).collect();
        let color = RgbImage::from_fn(320, 240, |u, v| {
            let is_ball = Self::measured(&self.color_camera, 0.0, u, v) < 0.499;
            if is_ball { Rgb([200, 60, 40]) } else { Rgb([90, 90, 95]) }
        });
        Ok(Some(Capture {
            stamp: Some(f64::from(self.taken)),
            color,
            color_camera: self.color_camera.clone(),
            depth: DepthImage { width, height, metres },
            depth_camera: Some(self.depth_camera.clone()),
        }))
    }
}

/// The camera as a source of views, which is what an inspection takes.
fn open() -> Result<Box<dyn Source>, Box<dyn Error>> {
    let timing = Timing { views: Some(3), ..Timing::default() };
    let connect = || Ok(Box::new(AcmeCamera::connect()?) as _);
    Ok(Box::new(CameraSource::open("acme:17", timing, &OpenOptions::default(), connect)?))
}

fn main() -> Result<(), Box<dyn Error>> {
    let spec = InspectionSpec { labels: LabelSource::None, ..InspectionSpec::default() };
    let inspected = Inspection::new(spec, open()?)?.start().wait()?;
    let views = inspected.record.views.len();
    eprintln!("{views} views, a model of {} points", inspected.cloud.len());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_becomes_views_with_depth_in_its_colours() {
        let mut source = open().expect("a camera");
        let views: Vec<_> = std::iter::from_fn(|| source.next_view()).map(|view| view.expect("a view")).collect();
        assert_eq!(views.len(), 3);
        let (view, width) = (&views[0], 320);
        assert_eq!((view.intrinsics.width, view.intrinsics.fx), (width, 310.0));
        // The top of the ball is in the middle of the colour picture, and the table beside it.
        let at = |u: u32, v: u32| view.depth.metres[(v * width + u) as usize];
        assert!(
            (at(159, 119) - 0.44).abs() < 1e-3 && (at(200, 30) - 0.5).abs() < 1e-4,
            "{} {}",
            at(159, 119),
            at(200, 30)
        );
        assert_eq!(view.rgb.get_pixel(159, 119).0, [200, 60, 40]);
    }
}
