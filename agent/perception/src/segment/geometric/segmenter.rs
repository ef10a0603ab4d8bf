//! A segmenter whose masks are fitted to the geometry of the view: the fusion segmentation of [Eye-in-hand 2020]
//! around any network.

use super::fusion_segmentation::{FusionConfig, PatchImage, fuse};
use super::lcccp::ColorCriterion;
use super::noise_filters::NoiseFilter;
use super::points::ColoredPoints;
use super::segmented_cloud::{GeometricConfig, SegmentedCloud};
use super::slic::{SlicConfig, slic};
use super::voxel_grid::NONE;
use crate::segment::segmentation::{SegmentError, Segmentation, Segmenter};
use crate::view::View;

/// Where patches come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchMethod {
    /// The method of [Eye-in-hand 2020]: supervoxels joined by convexity and colour; superpixels where there is no depth.
    Lcccp {
        /// Voxel edge in median pixel footprints of the view; supervoxels are four voxels wide.
        voxel_in_pixels: f32,
        /// The colour criterion.
        color: ColorCriterion,
    },
    /// Its alternative: superpixels of the picture.
    Slic(SlicConfig),
}

impl PatchMethod {
    /// LCCCP as it is tuned for views of parts: shading does not part surfaces.
    pub const LCCCP: Self =
        Self::Lcccp { voxel_in_pixels: 2.5, color: ColorCriterion { gamma: 20.0, illumination_robust: true } };
    /// SLIC with its usual compactness.
    pub const SLIC: Self = Self::Slic(SlicConfig { step: 12, compactness: 10.0, iterations: 10 });
}

/// Superpixels where nothing was measured: glosses, shadows, the room behind the cell.
const UNMEASURED: SlicConfig = SlicConfig { step: 12, compactness: 10.0, iterations: 4 };

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
    /// The method of [Eye-in-hand 2020] around `inner`.
    pub fn new(inner: S, method: PatchMethod) -> Self {
        Self { inner, method, fusion: FusionConfig::default(), noise: Some(NoiseFilter::default()) }
    }

    /// Fits `segmentation` of `view` to the geometry.
    pub fn fit(&self, view: &View, segmentation: &Segmentation) -> Segmentation {
        match self.method {
            PatchMethod::Lcccp { voxel_in_pixels, color } => {
                let mut depth = view.depth.metres.clone();
                if let Some(noise) = &self.noise {
                    let noisy = noise.mark(&depth, view.depth.width as usize);
                    depth.iter_mut().zip(noisy).filter(|(_, n)| *n).for_each(|(z, _)| *z = 0.0);
                }
                let Some(median) = median(&depth) else { return segmentation.clone() };
                let voxel = voxel_in_pixels * view.intrinsics.footprint(median.into()) as f32;
                let points = ColoredPoints::of_depth(&view.intrinsics, &depth, &view.rgb);
                let config = GeometricConfig { color: Some(color), ..GeometricConfig::new(voxel) };
                let cut = SegmentedCloud::new(&points, &config);
                let (mut patches, mut fine) = (cut.of_point(), cut.supervoxels.of_point);
                let superpixels = slic(&view.rgb, &UNMEASURED);
                fill(&mut patches, &superpixels, &view.depth.metres);
                fill(&mut fine, &superpixels, &view.depth.metres);
                let image = PatchImage { patches: &patches, fine: Some(&fine) };
                let mut fused = fuse(segmentation, &image, &self.fusion);
                // A point that hangs in the air belongs to no object, whatever is painted on its pixel.
                for i in (0..patches.len()).filter(|&i| patches[i] == NONE) {
                    fused.components.set(i, 0);
                    if let Some(instance) = fused.instances.get_mut(i) {
                        *instance = 0;
                    }
                }
                fused
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

/// Gives pixels without depth the superpixel they lie in as their patch, numbered on from the patches there are. Masks
/// cover these pixels too, and the picture is all there is to fit them to.
fn fill(patches: &mut [u32], superpixels: &[u32], depth: &[f32]) {
    let first = patches.iter().filter(|&&p| p != NONE).max().map_or(0, |p| p + 1);
    for (patch, (superpixel, _)) in
        patches.iter_mut().zip(superpixels.iter().zip(depth)).filter(|(_, (_, z))| **z <= 0.0)
    {
        *patch = first + superpixel;
    }
}

/// Median of the measured depths.
fn median(depth: &[f32]) -> Option<f32> {
    let mut z: Vec<f32> = depth.iter().copied().filter(|&z| z > 0.0).collect();
    let middle = z.len() / 2;
    (!z.is_empty()).then(|| *z.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_without_depth_take_the_picture_s_patch() {
        let mut patches = [0, NONE, 4, NONE];
        fill(&mut patches, &[0, 0, 1, 1], &[1.0, 0.0, 1.0, 0.7]);
        assert_eq!(patches, [0, 5, 4, NONE], "a point without a patch gets none");
    }
}
