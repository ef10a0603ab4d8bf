//! Samples to pixels: Lambert's law with a lamp beside the camera, contours where the depth jumps, outlines of findings, and the
//! mean of a pixel's samples in linear light.

use crate::camera::Camera;
use crate::outline::{Marks, Outline};
use crate::scene::{Scene, linear, srgb};
use crate::visibility::{Hit, Samples};
use image::RgbImage;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Light that comes from everywhere.
const AMBIENT: f32 = 0.38;
/// The lamp in the camera's frame: above and left of it.
const LAMP: [f32; 3] = [-0.35, -0.55, -1.0];
/// Depths of neighbouring samples that differ by more than this part of the diagonal of the part have a contour between them.
const JUMP: f64 = 0.012;
/// Difference of the light of two samples up to which they agree.
const AGREEMENT: f32 = 0.01;
/// Steps of light that are told apart: finer than those of a picture, also where it is dark.
const LEVELS: usize = 8192;
/// Grey of the inside of an open surface, linear light, and the width of its hatching in samples.
const INSIDE: f32 = 0.36;
const HATCH: usize = 6;
/// What a contour leaves of the light.
const CONTOUR: f32 = 0.35;

/// Where the light comes from in a picture of `camera`: a unit vector in the table frame.
pub(crate) fn lamp(camera: &Camera) -> Vector3<f32> {
    (camera.table_from_camera.rotation.cast::<f32>() * Vector3::from(LAMP)).normalize()
}

/// The picture of `samples`, each pixel the mean of `supersampling` squared ones.
pub(crate) fn shade(
    scene: &Scene<'_>,
    samples: &Samples,
    marks: &Marks,
    outlines: &[Outline<'_>],
    supersampling: u32,
) -> RgbImage {
    let step = supersampling as usize;
    let (width, height) = (samples.depth.width / step, samples.depth.height / step);
    let inks: Vec<[f32; 3]> = outlines.iter().map(|outline| outline.color.map(linear)).collect();
    let jump = (JUMP * scene.diagonal()) as f32;
    let values: Vec<u8> = (0..=LEVELS).map(|level| srgb(level as f32 / LEVELS as f32)).collect();
    let value = |light: f32| values.get((light * LEVELS as f32 + 0.5) as usize).copied().unwrap_or(255);
    let at = |x: usize, y: usize| match marks.at(x, y) {
        Some(outline) => inks[outline],
        None => light_at(scene, samples, (x, y), jump),
    };
    let mut pixels = vec![0_u8; 3 * width * height];
    pixels.par_chunks_mut(3 * width).enumerate().for_each(|(row, pixels)| {
        for (column, pixel) in pixels.chunks_exact_mut(3).enumerate() {
            let (first, last) = ((column * step, row * step), (column * step + step - 1, row * step + step - 1));
            let others = [(last.0, first.1), (first.0, last.1)];
            let is_marked = [first, last].iter().chain(&others).any(|(x, y)| marks.at(*x, *y).is_some());
            // Pixels within the background or within one triangle of one colour need one sample.
            let triangle = samples.triangle(first.0, first.1);
            let is_one =
                !is_marked && [last, others[0], others[1]].iter().all(|(x, y)| samples.triangle(*x, *y) == triangle);
            if is_one && triangle.is_none_or(|number| scene.is_of_one_color(number)) {
                pixel.copy_from_slice(&at(first.0, first.1).map(&value));
                continue;
            }
            // Where the samples on one diagonal agree, the others do.
            let (a, b) = (at(first.0, first.1), at(last.0, last.1));
            let mut sum = [0, 1, 2].map(|k| a[k] + b[k]);
            let mut n = 2.0;
            if is_marked || (0..3).any(|k| (a[k] - b[k]).abs() > AGREEMENT) {
                for y in first.1..=last.1 {
                    for x in (first.0..=last.0).filter(|x| (*x, y) != first && (*x, y) != last) {
                        let light = at(x, y);
                        sum = [0, 1, 2].map(|k| sum[k] + light[k]);
                        n += 1.0;
                    }
                }
            }
            pixel.copy_from_slice(&sum.map(|light| value(light / n)));
        }
    });
    RgbImage::from_raw(width as u32, height as u32, pixels).unwrap_or_default()
}

/// Light of one sample.
fn light_at(scene: &Scene<'_>, samples: &Samples, (x, y): (usize, usize), jump: f32) -> [f32; 3] {
    let Some(Hit { triangle, weights, mut facing, is_outside }) = samples.hit(scene, x, y) else { return [1.0; 3] };
    let corner = triangle.map(|v| v as usize);
    if facing.is_nan() {
        let [a, b, c] = corner.map(|v| Vector3::from(scene.mesh.vertices.positions[v]));
        facing = (b - a).cross(&(c - a)).try_normalize(0.0).map_or(1.0, |normal| normal.dot(&samples.lamp));
    }
    // Where the inside of the surface is seen, nothing is known of what lies before it: it is grey and without classes.
    if !is_outside {
        facing = -facing;
    }
    // A vertex stands for the surface nearest to it: classes do not blend into each other.
    let nearest = (1..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    let mut light = AMBIENT + (1.0 - AMBIENT) * facing.max(0.0);
    if is_contour(samples, x, y, jump) {
        light *= CONTOUR;
    }
    let color = match is_outside {
        true => scene.colors[corner[nearest]],
        // Hatched, so that it is no class.
        false => [if ((x + y) / HATCH).is_multiple_of(2) { INSIDE } else { 0.8 * INSIDE }; 3],
    };
    color.map(|c| c * light)
}

/// Whether a neighbour lies much deeper, or is background: the nearer surface gets the contour.
fn is_contour(samples: &Samples, x: usize, y: usize, jump: f32) -> bool {
    let buffer = &samples.depth;
    let depth = |x: usize, y: usize| buffer.depths[y * buffer.width + x];
    let own = depth(x, y);
    let mut neighbours = [own; 4];
    if x > 0 {
        neighbours[0] = depth(x - 1, y);
    }
    if x + 1 < buffer.width {
        neighbours[1] = depth(x + 1, y);
    }
    if y > 0 {
        neighbours[2] = depth(x, y - 1);
    }
    if y + 1 < buffer.height {
        neighbours[3] = depth(x, y + 1);
    }
    neighbours.iter().any(|z| *z > own + jump)
}
