//! A small software rasterizer for pictures of a model, and for what of its surface a camera sees: no GPU, no window, the same
//! picture on every machine.
//!
//! | file | what |
//! |---|---|
//! | `camera.rs` | perspective cameras that show the whole part, or one finding |
//! | `scene.rs` | the mesh with the colours that it is drawn in |
//! | `eye.rs`, `curtain.rs` | which blocks of the mesh a camera may see, and which are behind what is drawn |
//! | `visibility.rs` | triangles to a depth buffer and the triangle at each sample |
//! | `shading.rs` | samples to colours: Lambert's law, contours, outlines, and their mean in each pixel |
//! | `outline.rs` | closed curves drawn on the surface |
//! | `seen_surface.rs` | the place on the surface at each pixel, without a picture |
//!
//! Anti-aliasing is by supersampling: every pixel is the mean of `supersampling` squared samples in linear light. Bands of rows
//! are computed side by side; within one the triangles come in their order, so that the result does not depend on the number
//! of threads.

mod camera;
mod curtain;
mod eye;
mod outline;
mod scene;
mod seen_surface;
mod shading;
mod visibility;

pub use camera::{Camera, Direction, Framing};
pub use outline::Outline;
pub use scene::Scene;
pub use seen_surface::{SeenSurface, SurfacePlace};
pub use visibility::DepthBuffer;

use image::RgbImage;
use semascan_perception::view::Intrinsics;
use visibility::Samples;

/// Samples along an edge of a pixel.
const SUPERSAMPLING: u32 = 2;

/// A picture of the surface, and how deep it lies behind each sample.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture, sRGB on white.
    pub image: RgbImage,
    /// Depths of the samples that it was made of.
    pub depth: DepthBuffer,
}

/// Draws `scene` as `camera` sees it, with `outlines` on its surface: those of their parts that nothing hides.
pub fn render(scene: &Scene<'_>, camera: &Camera, outlines: &[Outline<'_>]) -> Rendering {
    let fine = Camera { intrinsics: finer(&camera.intrinsics), ..*camera };
    let samples = Samples::of(scene, &fine);
    let marks = outline::draw(outlines, scene, &samples, f64::from(SUPERSAMPLING));
    let image = shading::shade(scene, &samples, &marks, outlines, SUPERSAMPLING);
    Rendering { image, depth: samples.depth }
}

/// How deep the surface lies at the centre of each pixel of `camera`. Triangles that reach behind it are left out.
pub fn depths(scene: &Scene<'_>, camera: &Camera) -> DepthBuffer {
    Samples::of(scene, camera).depth
}

/// The camera with the samples in place of pixels.
fn finer(k: &Intrinsics) -> Intrinsics {
    k.scaled(f64::from(SUPERSAMPLING))
}

#[cfg(test)]
mod fixtures;
#[cfg(test)]
mod tests;
