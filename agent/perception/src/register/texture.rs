//! A view's picture as something to align by: a pyramid of locally normalised grey values.
//!
//! Each pixel's grey value, less the mean around it, over the standard deviation around it: exposure, white balance and
//! slow shading drop out, edges and texture stay ([Engel 2018] corrects exposure by two numbers a picture; a part on a
//! turntable turns under the light, which no two numbers can express).

use crate::organized::OrganizedCloud;
use crate::view::{Intrinsics, luma};
use image::RgbImage;

/// Levels of the pyramid; each halves the picture.
pub(super) const LEVELS: usize = 3;
/// Half the window over which grey values are normalised, pixels.
const HALF_WINDOW: usize = 7;
/// Contrast (of 255) that counts as noise: flat regions are not blown up.
const NOISE: f32 = 6.0;
/// Steps per unit of normalised value.
const STEPS: f32 = 32.0;
/// Least slope of a pixel that takes part, normalised units per pixel.
const LEAST_SLOPE: f32 = 0.15;
/// Most points that are kept of a view.
const KEPT_POINTS: usize = 16_000;
/// Fewest points with which a picture says anything.
const FEWEST_POINTS: usize = 400;

/// One level of the pyramid.
#[derive(Clone, Debug)]
struct Level {
    camera: Intrinsics,
    /// Normalised grey values in steps, row-major.
    steps: Vec<i8>,
}

/// A value of the picture where a point is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) value: f32,
    /// How it changes where the point moves, per metre, camera frame.
    pub(super) gradient: [f32; 3],
}

/// Locally normalised picture of a view, from fine to coarse.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    levels: Vec<Level>,
}

/// Points of a view where its picture has structure, camera frame.
#[derive(Clone, Debug, Default)]
pub(super) struct TexturedPoints {
    /// Metres.
    pub(super) points: Vec<[f32; 3]>,
    /// Normalised grey value and its gradient in space at each level of the pyramid.
    pub(super) samples: Vec<[Sample; LEVELS]>,
}

impl Texture {
    /// The pyramid of `rgb`, seen by `camera`, whose finest level has `1 / stride` of its columns.
    pub(super) fn new(rgb: &RgbImage, camera: &Intrinsics, stride: usize) -> Self {
        let (width, height) = (rgb.width() as usize, rgb.height() as usize);
        let grey: Vec<f32> = rgb.pixels().map(|p| luma(p.0)).collect();
        let (mut width, mut height, mut grey) = shrunk(&grey, width, height, stride.max(1));
        let mut camera = shrunk_camera(camera, stride.max(1), width, height);
        let mut levels = Vec::with_capacity(LEVELS);
        for level in 0..LEVELS {
            if level > 0 {
                (width, height, grey) = shrunk(&grey, width, height, 2);
                camera = shrunk_camera(&camera, 2, width, height);
            }
            levels.push(Level { camera, steps: normalised(&grey, width, height) });
        }
        Self { levels }
    }

    /// The picture at `level` where the camera sees `p` (camera frame, metres); `None` outside of it.
    #[inline]
    pub(super) fn at(&self, level: usize, p: [f32; 3]) -> Option<Sample> {
        let Level { camera, steps } = &self.levels[level];
        let (fx, fy) = (camera.fx as f32, camera.fy as f32);
        let nearness = 1.0 / p[2];
        let u = fx * p[0] * nearness + camera.cx as f32;
        let v = fy * p[1] * nearness + camera.cy as f32;
        let (width, height) = (camera.width as usize, camera.height as usize);
        // Not at the border, where the window of the normalisation is cut.
        if !(p[2] > 0.0 && u >= 1.0 && v >= 1.0 && u < width as f32 - 2.0 && v < height as f32 - 2.0) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        let (a, b) = (u - column as f32, v - row as f32);
        let i = row * width + column;
        let [top_left, top_right, low_left, low_right] =
            [i, i + 1, i + width, i + width + 1].map(|i| f32::from(steps[i]) / STEPS);
        let (top, low) = (top_left + a * (top_right - top_left), low_left + a * (low_right - low_left));
        let across = (1.0 - b) * (top_right - top_left) + b * (low_right - low_left);
        // The slope of the picture through the projection.
        let (x, y) = (across * fx * nearness, (low - top) * fy * nearness);
        Some(Sample { value: top + b * (low - top), gradient: [x, y, -(x * p[0] + y * p[1]) * nearness] })
    }
}

impl TexturedPoints {
    /// The pixels of `cloud` (every `stride`-th column and row) where `texture` has structure, a normal is known and
    /// `wanted` (row-major pixel index) agrees, thinned to at most `most`; `None` where they are too few to align by.
    pub(super) fn select(
        cloud: &OrganizedCloud,
        texture: &Texture,
        stride: usize,
        most: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let (width, height) = (cloud.intrinsics.width as usize, cloud.intrinsics.height as usize);
        let camera = &texture.levels[0].camera;
        let focal_length = (camera.fx as f32).min(camera.fy as f32);
        let mut all = Self::default();
        for v in (0..height).step_by(stride.max(1)) {
            for i in (v * width..(v + 1) * width).step_by(stride.max(1)) {
                if cloud.normals[i] == [0.0; 3] || !wanted(i) {
                    continue;
                }
                let Some(p) = cloud.smooth_point(i) else { continue };
                let p = [p.x as f32, p.y as f32, p.z as f32];
                let samples: [Option<Sample>; LEVELS] = std::array::from_fn(|level| texture.at(level, p));
                let [Some(fine), Some(middle), Some(coarse)] = samples else { continue };
                if fine.gradient[0].hypot(fine.gradient[1]) * p[2] < LEAST_SLOPE * focal_length {
                    continue;
                }
                all.points.push(p);
                all.samples.push([fine, middle, coarse]);
            }
        }
        let step = all.points.len().div_ceil(most).max(1);
        let points: Vec<[f32; 3]> = all.points.into_iter().step_by(step).collect();
        let samples = all.samples.into_iter().step_by(step).collect();
        (points.len() >= FEWEST_POINTS).then_some(Self { points, samples })
    }
}

/// A view's picture, and the points of it that are looked for in the pictures of others.
#[derive(Clone, Debug)]
pub struct ViewTexture {
    pub(super) picture: Texture,
    pub(super) points: TexturedPoints,
}

impl ViewTexture {
    /// Of a view's colours and its points where `wanted`, with the surface's pixels `stride` pixels of the picture wide.
    pub(super) fn of(
        rgb: &RgbImage,
        cloud: &OrganizedCloud,
        stride: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let picture = Texture::new(rgb, &cloud.intrinsics, stride);
        let points = TexturedPoints::select(cloud, &picture, stride, KEPT_POINTS, wanted)?;
        Some(Self { picture, points })
    }

    /// Of a picture with the columns and rows of `cloud`, and at most `most` of its points.
    pub(super) fn on(picture: Texture, cloud: &OrganizedCloud, most: usize) -> Option<Self> {
        let points = TexturedPoints::select(cloud, &picture, 1, most, |_| true)?;
        Some(Self { picture, points })
    }
}

/// `grey` with boxes of `factor` by `factor` pixels averaged; what does not fill a box is cut.
fn shrunk(grey: &[f32], width: usize, height: usize, factor: usize) -> (usize, usize, Vec<f32>) {
    if factor == 1 {
        return (width, height, grey.to_vec());
    }
    let (columns, rows) = (width / factor, height / factor);
    let mut out = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let mut sum = 0.0;
            for line in grey[row * factor * width..].chunks(width).take(factor) {
                sum += line[column * factor..(column + 1) * factor].iter().sum::<f32>();
            }
            out.push(sum / (factor * factor) as f32);
        }
    }
    (columns, rows, out)
}

/// The camera of a picture that was shrunk by averaging boxes.
fn shrunk_camera(camera: &Intrinsics, factor: usize, width: usize, height: usize) -> Intrinsics {
    Intrinsics { width: width as u32, height: height as u32, ..camera.scaled(1.0 / factor as f64) }
}

/// Grey values less their local mean, over their local standard deviation, in steps.
fn normalised(grey: &[f32], width: usize, height: usize) -> Vec<i8> {
    let squares: Vec<f32> = grey.iter().map(|g| g * g).collect();
    let (mean, square) = (box_mean(grey, width, height), box_mean(&squares, width, height));
    grey.iter()
        .zip(mean.iter().zip(&square))
        .map(|(g, (mean, square))| {
            let deviation = ((square - mean * mean).max(0.0) + NOISE * NOISE).sqrt();
            // A cast saturates: what stands out by more than four deviations is cut.
            (STEPS * (g - mean) / deviation).round() as i8
        })
        .collect()
}

/// Mean over the window around each pixel, as much of it as lies in the picture.
fn box_mean(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let mut rows = vec![0.0_f32; values.len()];
    for (line, out) in values.chunks(width).zip(rows.chunks_mut(width)) {
        slide(line.len(), |i| f64::from(line[i]), |i, mean| out[i] = mean);
    }
    let mut all = vec![0.0_f32; values.len()];
    for column in 0..width {
        slide(height, |i| f64::from(rows[i * width + column]), |i, mean| all[i * width + column] = mean);
    }
    all
}

/// Sliding mean of `length` values.
fn slide(length: usize, value: impl Fn(usize) -> f64, mut set: impl FnMut(usize, f32)) {
    let (mut sum, mut count) = (0.0, 0_usize);
    for i in 0..length.min(HALF_WINDOW) {
        sum += value(i);
        count += 1;
    }
    for i in 0..length {
        if i + HALF_WINDOW < length {
            sum += value(i + HALF_WINDOW);
            count += 1;
        }
        if i > HALF_WINDOW {
            sum -= value(i - HALF_WINDOW - 1);
            count -= 1;
        }
        set(i, (sum / count.max(1) as f64) as f32);
    }
}
