//! A segmenter whose masks are fitted to the geometry of the view: P1's fusion segmentation around any network.

use super::fusion_segmentation::{FusionConfig, PatchImage, fuse};
use super::lcccp::ColourCriterion;
use super::slic::{SlicConfig, slic};
use super::{ColouredPoints, GeometricConfig, NoiseFilter, SegmentedCloud};
use crate::acquire::View;
use crate::segment::{SegmentError, Segmentation, Segmenter};

/// Where patches come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchMethod {
    /// P1's method: supervoxels joined by convexity and colour.
    Lcccp {
        /// Voxel edge in median pixel footprints of the view; supervoxels are four voxels wide.
        voxel_in_pixels: f32,
        /// The colour criterion.
        colour: ColourCriterion,
    },
    /// P1's alternative: superpixels of the picture.
    Slic(SlicConfig),
}

impl PatchMethod {
    /// LCCCP as it is tuned for views of parts: shading does not part surfaces.
    pub const LCCCP: Self =
        Self::Lcccp { voxel_in_pixels: 3.0, colour: ColourCriterion { gamma: 20.0, illumination_robust: true } };
    /// SLIC with its usual compactness.
    pub const SLIC: Self = Self::Slic(SlicConfig { step: 12, compactness: 10.0, iterations: 10 });
}

/// Asks `inner` and fits its component masks to patches of the view. A view without depth passes unchanged.
#[derive(Clone, Debug)]
pub struct GeometricSegmenter<S> {
    /// Whose masks are fitted.
    pub inner: S,
    /// Where patches come from.
    pub method: PatchMethod,
    /// When a patch takes a label.
    pub fusion: FusionConfig,
    /// Pixels that take no part in patches; `None` keeps all.
    pub noise: Option<NoiseFilter>,
}

impl<S: Segmenter> GeometricSegmenter<S> {
    /// P1's method around `inner`.
    pub fn new(inner: S, method: PatchMethod) -> Self {
        Self { inner, method, fusion: FusionConfig::default(), noise: Some(NoiseFilter::default()) }
    }

    /// Fits `segmentation` of `view` to the geometry.
    pub fn fit(&self, view: &View, segmentation: &Segmentation) -> Segmentation {
        match self.method {
            PatchMethod::Lcccp { voxel_in_pixels, colour } => {
                let mut depth = view.depth.metres.clone();
                if let Some(noise) = &self.noise {
                    let noisy = noise.mark(&depth, view.depth.width as usize);
                    depth.iter_mut().zip(noisy).filter(|(_, n)| *n).for_each(|(z, _)| *z = 0.0);
                }
                let Some(median) = median(&depth) else { return segmentation.clone() };
                let voxel = voxel_in_pixels * view.intrinsics.footprint(median.into()) as f32;
                let points = ColouredPoints::of_depth(&view.intrinsics, &depth, &view.rgb);
                let config = GeometricConfig { colour: Some(colour), ..GeometricConfig::new(voxel) };
                let cut = SegmentedCloud::new(&points, &config);
                let image = PatchImage { patches: &cut.of_point(), fine: Some(&cut.supervoxels.of_point) };
                fuse(segmentation, &image, &self.fusion)
            }
            PatchMethod::Slic(config) => {
                fuse(segmentation, &PatchImage { patches: &slic(&view.rgb, &config), fine: None }, &self.fusion)
            }
        }
    }
}

impl<S: Segmenter> Segmenter for GeometricSegmenter<S> {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let given = self.inner.segment(view)?;
        Ok(self.fit(view, &given))
    }
}

/// Median of the measured depths.
fn median(depth: &[f32]) -> Option<f32> {
    let mut z: Vec<f32> = depth.iter().copied().filter(|&z| z > 0.0).collect();
    let middle = z.len() / 2;
    (!z.is_empty()).then(|| *z.select_nth_unstable_by(middle, f32::total_cmp).1)
}
