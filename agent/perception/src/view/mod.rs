//! One RGB-D capture and what is known about where it was taken.

mod camera_model;
mod chain;
mod luma;
mod sharpness;

pub use camera_model::{CameraModel, Distortion, UnusableCamera, check_intrinsics};
pub use chain::Chain;
pub use luma::{LUMA_WEIGHTS, luma, luma_rounded};
pub use sharpness::sharpness;

use image::RgbImage;
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};
use std::sync::Arc;

/// Pinhole camera in pixels; `(0, 0)` is the centre of the first pixel. Optical frame: x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length in pixels.
    pub fx: f64,
    /// Focal length in pixels.
    pub fy: f64,
    /// Principal point in pixels.
    pub cx: f64,
    /// Principal point in pixels.
    pub cy: f64,
}

impl Intrinsics {
    /// Point in the camera frame (metres) of pixel `(u, v)` at depth `z` along the optical axis.
    pub fn unproject(&self, u: f64, v: f64, z: f64) -> Point3<f64> {
        Point3::new((u - self.cx) / self.fx * z, (v - self.cy) / self.fy * z, z)
    }

    /// Pixel `(u, v)` of a point in the camera frame; `None` behind the camera.
    pub fn project(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        (p.z > 0.0).then(|| (self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy))
    }

    /// Row-major index of the pixel that the image point `(u, v)` lies in; `None` outside of the picture.
    pub fn pixel(&self, u: f64, v: f64) -> Option<usize> {
        let inside = |c: f64, size: u32| (c >= -0.5 && c < f64::from(size) - 0.5).then_some((c + 0.5) as usize);
        Some(inside(v, self.height)? * self.width as usize + inside(u, self.width)?)
    }

    /// The same camera with pixels `1 / factor` as wide; the picture covers at least what it covered.
    pub fn scaled(&self, factor: f64) -> Self {
        let size = |n: u32| ((f64::from(n) * factor).ceil() as u32).max(1);
        Self {
            width: size(self.width),
            height: size(self.height),
            fx: self.fx * factor,
            fy: self.fy * factor,
            // The corner of the picture, half a pixel before the centre of the first, stays where it is.
            cx: (self.cx + 0.5) * factor - 0.5,
            cy: (self.cy + 0.5) * factor - 0.5,
        }
    }

    /// The part of the picture from pixel (`left`, `top`), `width` by `height`; what lies beyond the picture is left out.
    pub fn cropped(&self, left: u32, top: u32, width: u32, height: u32) -> Self {
        let (left, top) = (left.min(self.width), top.min(self.height));
        Self {
            width: width.min(self.width - left),
            height: height.min(self.height - top),
            cx: self.cx - f64::from(left),
            cy: self.cy - f64::from(top),
            ..*self
        }
    }

    /// Edge of a pixel's footprint in metres on a surface that faces the camera at depth `z`.
    pub fn footprint(&self, z: f64) -> f64 {
        z / (self.fx * self.fy).sqrt()
    }
}

/// Depth along the optical axis in metres, row-major; 0 where nothing was measured. Never NaN or negative.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` values.
    pub metres: Vec<f32>,
}

impl DepthImage {
    /// Depth of pixel `(u, v)`, or `None` where nothing was measured.
    pub fn at(&self, u: u32, v: u32) -> Option<f32> {
        let z = *self.metres.get((v * self.width + u) as usize)?;
        (z > 0.0).then_some(z)
    }
}

/// What is known about the camera's pose before any registration. Covariances are over (rotation, translation) in
/// radians and metres, in the camera frame.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseEvidence {
    /// Robot and turntable readings.
    Chain {
        /// The readings.
        chain: Chain,
        /// Their joint uncertainty as a camera-pose covariance.
        covariance: Matrix6<f64>,
    },
    /// The camera's pose in the scene, which then is the table frame.
    World {
        /// Camera pose.
        table_from_camera: Isometry3<f64>,
        /// Its uncertainty.
        covariance: Matrix6<f64>,
    },
    /// Nothing is known.
    None,
}

impl PoseEvidence {
    /// The camera's pose as the evidence has it; `None` if there is none.
    pub fn table_from_camera(&self) -> Option<Isometry3<f64>> {
        match self {
            Self::Chain { chain, .. } => Some(chain.table_from_camera()),
            Self::World { table_from_camera, .. } => Some(*table_from_camera),
            Self::None => None,
        }
    }
}

/// Diagonal pose covariance from standard deviations of rotation (radians) and translation (metres), camera frame.
pub fn covariance_of_prior(sigma_rotation: f64, sigma_translation: f64) -> Matrix6<f64> {
    let (r, t) = (sigma_rotation * sigma_rotation, sigma_translation * sigma_translation);
    Matrix6::from_diagonal(&Vector6::new(r, r, r, t, t, t))
}

/// Labels that came with a view: recorded masks or simulated truth. Row-major, one value a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedLabels {
    /// Component class; 0 = none, [`Self::UNKNOWN`] = nobody knows.
    pub components: Vec<u16>,
    /// Defect class; 0 = none, [`Self::UNKNOWN`] = nobody knows.
    pub defects: Vec<u16>,
    /// Instance; 0 = not separated.
    pub instances: Vec<u16>,
}

impl RecordedLabels {
    /// Class of a pixel of which nothing is known: it votes for no class, not for none either.
    pub const UNKNOWN: u16 = u16::MAX;

    /// Whether pixel `i` is known to show a component; not past the end.
    pub fn shows_component(&self, i: usize) -> bool {
        self.components.get(i).is_some_and(|class| *class != 0 && *class != Self::UNKNOWN)
    }
}

/// What a simulated or laboratory source knows to be true of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewTruth {
    /// The camera's true pose.
    pub table_from_camera: Isometry3<f64>,
}

/// One capture. Its pictures are shared: a copy of a view costs nothing, and a stage that wants other colours makes a view
/// with those alone.
#[derive(Clone, Debug)]
pub struct View {
    /// Position in the capture order, from 0. An inspection numbers its views itself.
    pub index: u32,
    /// Capture time in seconds on the source's clock; `None` where the source does not know it.
    pub stamp: Option<f64>,
    /// The camera, for colour and depth alike.
    pub intrinsics: Intrinsics,
    /// Colour.
    pub rgb: Arc<RgbImage>,
    /// Depth.
    pub depth: Arc<DepthImage>,
    /// What is known about the pose.
    pub pose: PoseEvidence,
    /// Recorded labels, if any.
    pub labels: Option<Arc<RecordedLabels>>,
    /// Truth, if known.
    pub truth: Option<ViewTruth>,
}

/// A part of a view that has another size than its camera's picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the {part} has {found} pixels, the camera's picture {width} x {height}")]
pub struct SizeMismatch {
    /// The part: colour, depth or labels.
    pub part: &'static str,
    /// Its pixels.
    pub found: usize,
    /// Columns of the camera's picture.
    pub width: u32,
    /// Rows of the camera's picture.
    pub height: u32,
}

impl View {
    /// Checks that colour, depth and labels have the size of the camera's picture, so that stages need not.
    ///
    /// # Errors
    /// [`SizeMismatch`] naming the first part that has another size.
    pub fn check_sizes(&self) -> Result<(), SizeMismatch> {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let pixels = width as usize * height as usize;
        let refuse = |part, found| Err(SizeMismatch { part, found, width, height });
        if self.rgb.dimensions() != (width, height) {
            return refuse("colour picture", self.rgb.pixels().len());
        }
        if (self.depth.width, self.depth.height) != (width, height) || self.depth.metres.len() != pixels {
            return refuse("depth picture", self.depth.metres.len());
        }
        let labels = self.labels.as_deref();
        for column in labels.into_iter().flat_map(|l| [&l.components, &l.defects, &l.instances]) {
            if column.len() != pixels {
                return refuse("recorded labels", column.len());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_another_size_is_named() {
        let view = View {
            index: 0,
            stamp: None,
            intrinsics: Intrinsics { width: 4, height: 3, fx: 4.0, fy: 4.0, cx: 1.5, cy: 1.0 },
            rgb: Arc::new(RgbImage::new(4, 3)),
            depth: Arc::new(DepthImage { width: 4, height: 3, metres: vec![0.5; 12] }),
            pose: PoseEvidence::None,
            labels: Some(Arc::new(RecordedLabels {
                components: vec![0; 12],
                defects: vec![0; 12],
                instances: vec![0; 12],
            })),
            truth: None,
        };
        assert_eq!(view.check_sizes(), Ok(()));
        let part = |view: View| view.check_sizes().expect_err("another size").part;
        assert_eq!(part(View { rgb: Arc::new(RgbImage::new(3, 4)), ..view.clone() }), "colour picture");
        let depth = Arc::new(DepthImage { width: 4, height: 3, metres: vec![0.5; 11] });
        assert_eq!(part(View { depth, ..view.clone() }), "depth picture");
        let mut labels = view.labels.clone();
        labels.as_mut().map(Arc::make_mut).expect("labels").defects.pop();
        assert_eq!(part(View { labels, ..view }), "recorded labels");
    }

    #[test]
    fn a_scaled_camera_sees_the_same_rays() {
        let k = Intrinsics { width: 641, height: 480, fx: 600.0, fy: 610.0, cx: 310.0, cy: 250.0 };
        let half = k.scaled(0.5);
        assert_eq!((half.width, half.height), (321, 240));
        let p = Point3::new(0.1, -0.05, 0.7);
        let ((u, v), (hu, hv)) = (k.project(&p).expect("ahead"), half.project(&p).expect("ahead"));
        assert!((hu + 0.5 - (u + 0.5) / 2.0).abs() < 1e-9 && (hv + 0.5 - (v + 0.5) / 2.0).abs() < 1e-9);
    }
}
