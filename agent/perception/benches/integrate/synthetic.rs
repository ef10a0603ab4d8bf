//! A seeded surface seen by a moving camera: views that cost no rendering, every pixel with depth, noise and labels.

use image::RgbImage;
use nalgebra::{Isometry3, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rayon::prelude::*;
use semascan_perception::fuse::LabelledView;
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::segment::{ClassField, Segmentation};
use semascan_perception::view::{DepthImage, Intrinsics};

/// How views are labelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Labels {
    /// One class a pixel.
    Hard,
    /// Six class probabilities of eight bits.
    Soft,
}

impl Labels {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard_labels",
            Self::Soft => "soft_labels",
        }
    }
}

/// Component classes of the surface.
const CLASSES: usize = 6;
/// Standard deviation of depth, metres, and the step it is recorded in.
const SIGMA: f64 = 6e-5;
const STEP: f32 = 1e-5;

/// After this distance along x or y the surface and its classes are the same again, metres.
pub(crate) const PERIOD: f64 = 0.15;
/// Edge of a patch of one class, metres.
const PATCH: f64 = PERIOD / CLASSES as f64;

/// A wavy wall around z = 0 in the table frame; cameras look at it from 0.55 m before it.
pub(crate) struct SyntheticScene {
    pub(crate) intrinsics: Intrinsics,
    seed: u64,
}

impl SyntheticScene {
    pub(crate) fn new(seed: u64, width: u32, height: u32) -> Self {
        let f = 0.96 * f64::from(width);
        let (cx, cy) = (0.5 * f64::from(width - 1), 0.5 * f64::from(height - 1));
        Self { intrinsics: Intrinsics { width, height, fx: f, fy: f, cx, cy }, seed }
    }

    /// Height of the surface over the wall; it repeats itself every [`PERIOD`] along x and y.
    fn surface(x: f64, y: f64) -> f64 {
        let (x, y) = (x * std::f64::consts::TAU / PERIOD, y * std::f64::consts::TAU / PERIOD);
        0.015 * x.sin() * y.cos() + 0.004 * (5.0 * x + 2.0 * y).sin()
    }

    /// Where the camera of view `index` is: a slow dance before the wall.
    pub(crate) fn pose(&self, index: u32) -> Isometry3<f64> {
        let t = f64::from(index);
        let offset = Vector3::new(0.05 * (t * 0.7).sin(), 0.04 * (t * 0.45).cos(), -0.55 + 0.02 * (t * 0.3).sin());
        Isometry3::new(offset, Vector3::new(0.12 * (t * 0.5).sin(), 0.15 * (t * 0.6).cos(), 0.05 * t.sin()))
    }

    /// True depth of every pixel of view `index`, with noise.
    pub(crate) fn depth(&self, index: u32) -> DepthImage {
        let k = self.intrinsics;
        let pose = self.pose(index);
        let row = |v: u32| -> Vec<f32> {
            let mut random = Pcg32::seed_from_u64(self.seed ^ u64::from(index) << 32 ^ u64::from(v) << 8);
            (0..k.width)
                .map(|u| {
                    let ray = pose.rotation * k.unproject(u.into(), v.into(), 1.0).coords;
                    let eye = pose.translation.vector;
                    // Fixed-point iteration towards the surface: it is much flatter than the rays are steep.
                    let mut z = -eye.z / ray.z;
                    for _ in 0..6 {
                        let p = eye + ray * z;
                        z = (Self::surface(p.x, p.y) - eye.z) / ray.z;
                    }
                    let noise: f64 = (0..4).map(|_| random.random::<f64>() - 0.5).sum::<f64>() * 3.0_f64.sqrt();
                    ((z + SIGMA * noise) as f32 / STEP).round() * STEP
                })
                .collect()
        };
        let metres = (0..k.height).into_par_iter().flat_map_iter(row).collect();
        DepthImage { width: k.width, height: k.height, metres }
    }

    /// View `index` with normals.
    pub(crate) fn view(&self, index: u32, labels: Labels) -> LabelledView {
        let k = self.intrinsics;
        let depth = self.depth(index);
        let pose = self.pose(index);
        let pixels = depth.metres.len();
        let place = |i: usize| -> Point3<f64> {
            let (u, v) = (i % k.width as usize, i / k.width as usize);
            pose * k.unproject(u as f64, v as f64, depth.metres[i].into())
        };
        // Classes in patches, their borders uncertain.
        let class_at = |p: &Point3<f64>| {
            ((p.x / PATCH).floor() as i64 + 2 * (p.y / PATCH).floor() as i64).rem_euclid(CLASSES as i64)
        };
        let to_border = |p: &Point3<f64>| {
            let along = |c: f64| (c / PATCH - (c / PATCH).round()).abs() * PATCH;
            along(p.x).min(along(p.y))
        };
        let classes: Vec<u16> = (0..pixels).into_par_iter().map(|i| class_at(&place(i)) as u16).collect();
        let components = match labels {
            Labels::Hard => ClassField::Hard(classes.clone()),
            Labels::Soft => {
                let soft = |i: usize| {
                    let class = usize::from(classes[i]);
                    let sure = (0.6 + to_border(&place(i)) * 200.0).min(1.0);
                    let mut p = [((1.0 - sure) * 255.0 / (CLASSES - 1) as f64) as u8; CLASSES];
                    p[class] = (sure * 255.0) as u8;
                    (p, ((1.0 - sure) * 200.0) as u8)
                };
                let each: Vec<([u8; CLASSES], u8)> = (0..pixels).into_par_iter().map(soft).collect();
                ClassField::Soft {
                    classes: CLASSES,
                    probabilities: each.iter().flat_map(|(p, _)| *p).collect(),
                    sigma: each.iter().map(|(_, s)| *s).collect(),
                    model_sigma: Vec::new(),
                }
            }
        };
        let mut random = Pcg32::seed_from_u64(self.seed ^ u64::from(index));
        let rgb = classes
            .iter()
            .flat_map(|&c| {
                [40 + 30 * c as u8, 200 - 25 * c as u8, 90].map(|v| v.saturating_add(random.random_range(0..6)))
            })
            .collect();
        LabelledView {
            index,
            cloud: OrganizedCloud::new(k, &depth, None),
            rgb: std::sync::Arc::new(RgbImage::from_raw(k.width, k.height, rgb).expect("one colour a pixel")),
            segmentation: Segmentation {
                components,
                defects: ClassField::Hard(vec![0; pixels]),
                instances: classes,
                network: None,
            },
            table_from_camera: pose,
        }
    }
}
