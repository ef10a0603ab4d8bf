//! Closed curves on the surface, drawn where nothing hides them.

use crate::camera::Camera;
use crate::scene::Scene;
use crate::visibility::{DepthBuffer, Samples};

/// A closed curve on the surface.
#[derive(Clone, Copy, Debug)]
pub struct Outline<'a> {
    /// Its points, table frame, metres; the last is joined with the first.
    pub curve: &'a [[f64; 3]],
    /// Its colour.
    pub color: [u8; 3],
    /// Width of the line in pixels of the picture.
    pub width: f64,
    /// How far before it the surface may lie, metres: curves are simplified and surfaces are not smooth.
    pub tolerance: f64,
}

/// Which outline covers each sample.
pub(crate) struct Marks {
    width: usize,
    of_sample: Vec<u16>,
}

impl Marks {
    /// The outline at a sample.
    pub(crate) fn at(&self, x: usize, y: usize) -> Option<usize> {
        match self.of_sample.get(y * self.width + x) {
            None | Some(&u16::MAX) => None,
            Some(&outline) => Some(usize::from(outline)),
        }
    }
}

/// Draws `outlines` over `samples`, `scale` of them along the edge of a pixel: what lies on the outside of the surface. Later
/// ones lie over earlier ones; those past the first 65535 are left out.
pub(crate) fn draw(outlines: &[Outline<'_>], scene: &Scene<'_>, samples: &Samples, scale: f64) -> Marks {
    let depth = &samples.depth;
    let camera: &Camera = &depth.camera;
    let mut marks = Marks { width: depth.width, of_sample: Vec::new() };
    if outlines.is_empty() {
        return marks;
    }
    marks.of_sample = vec![u16::MAX; depth.width * depth.height];
    for (number, outline) in (0..u16::MAX).zip(outlines) {
        let radius = outline.width * scale / 2.0;
        for (from, to) in segments(outline.curve) {
            let (Some(a), Some(b)) = (camera.project(from), camera.project(to)) else { continue };
            // Half a sample a step.
            let steps = (2.0 * (b.0 - a.0).hypot(b.1 - a.1)).ceil().clamp(1.0, 1e4);
            for step in 0..=steps as u32 {
                let t = f64::from(step) / steps;
                let point = [0, 1, 2].map(|k| from[k] + t * (to[k] - from[k]));
                let seen = depth.sample(&point).is_some_and(|(at, z)| {
                    z <= f64::from(depth.depths[at]) + outline.tolerance && samples.may_show(scene, at)
                });
                if seen {
                    let (u, v) = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
                    marks.disc(u, v, radius, depth, number);
                }
            }
        }
    }
    marks
}

/// The sides of a closed curve.
fn segments(curve: &[[f64; 3]]) -> impl Iterator<Item = (&[f64; 3], &[f64; 3])> {
    curve.iter().zip(curve.iter().cycle().skip(1))
}

impl Marks {
    fn disc(&mut self, u: f64, v: f64, radius: f64, depth: &DepthBuffer, number: u16) {
        let range = |c: f64, size: usize| {
            let first = (c - radius).ceil().clamp(0.0, size as f64) as usize;
            let last = ((c + radius).floor() + 1.0).clamp(0.0, size as f64) as usize;
            first..last
        };
        for y in range(v, depth.height) {
            for x in range(u, depth.width) {
                if (x as f64 - u).powi(2) + (y as f64 - v).powi(2) <= radius * radius {
                    self.of_sample[y * self.width + x] = number;
                }
            }
        }
    }
}
