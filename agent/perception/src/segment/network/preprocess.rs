//! From a view to the tensor that a network takes, and from its output back to pixels.
//!
//! Channels and scaling are the manifest's. A picture is padded to the multiple that the network needs, with real pixels
//! where the picture has them and repeated ones beyond; networks of a fixed size get a resized picture. Depth is never
//! interpolated: between two surfaces there is none.

use super::manifest::{Channel, Input};
use super::region::Window;
use crate::view::View;

/// How a window of the picture lies in a network's input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// What is wanted.
    pub(super) window: Window,
    /// What the network sees; holds the window.
    seen: Window,
    /// Width and height of the input.
    pub(super) size: (usize, usize),
    /// Whether `seen` is stretched to the input's size rather than padded.
    stretched: bool,
}

impl Frame {
    /// The frame for `window` of a picture (columns, rows).
    pub(super) fn new(window: Window, picture: (u32, u32), input: &Input) -> Self {
        if let (Some(width), Some(height)) = (input.width, input.height) {
            return Self { window, seen: window, size: (width as usize, height as usize), stretched: true };
        }
        let padded = |n: u32| n.div_ceil(input.multiple.max(1)) * input.multiple.max(1);
        let (width, height) = (padded(window.width), padded(window.height));
        let seen = window.grown(width, height, picture);
        Self { window, seen, size: (width as usize, height as usize), stretched: false }
    }

    /// Column and row of the picture, in pixels, at column `x` and row `y` of the input.
    fn source(&self, x: usize, y: usize) -> (f32, f32) {
        let (x, y) = (x as f32, y as f32);
        if !self.stretched {
            return (self.seen.left as f32 + x, self.seen.top as f32 + y);
        }
        let (sx, sy) = self.scale();
        (self.seen.left as f32 + (x + 0.5) * sx - 0.5, self.seen.top as f32 + (y + 0.5) * sy - 0.5)
    }

    /// Pixels of the picture for one of the input.
    fn scale(&self) -> (f32, f32) {
        (self.seen.width as f32 / self.size.0 as f32, self.seen.height as f32 / self.size.1 as f32)
    }

    /// The input tensor of `view`, channel after channel: `channels * height * width` values.
    pub(super) fn tensor(&self, view: &View, input: &Input) -> Vec<f32> {
        let (width, height) = self.size;
        let plane = width * height;
        let mut tensor = vec![0.0; plane * input.channels.len()];
        for (channel, values) in input.channels.iter().zip(tensor.chunks_exact_mut(plane.max(1))) {
            match (channel, &input.color, &input.depth) {
                (Channel::Depth, _, Some(scale)) => {
                    let picture = (view.depth.width as usize, view.depth.height as usize);
                    self.fill(values, picture, false, |u, v| match view.depth.at(u as u32, v as u32) {
                        Some(z) => ((z - scale.near) / (scale.far - scale.near)).clamp(0.0, 1.0),
                        None => scale.missing,
                    });
                }
                (color, Some(scale), _) => {
                    let c = match color {
                        Channel::Red => 0,
                        Channel::Green => 1,
                        _ => 2,
                    };
                    let (columns, rows) = (view.rgb.width() as usize, view.rgb.height() as usize);
                    let bytes = view.rgb.as_raw();
                    self.fill(values, (columns, rows), true, |u, v| {
                        (f32::from(bytes[(v * columns + u) * 3 + c]) / 255.0 - scale.mean[c]) / scale.std[c]
                    });
                }
                // A checked manifest has a scale for each of its channels.
                _ => {}
            }
        }
        tensor
    }

    /// Fills a plane of the input from the pixels `at` (column, row) of a `picture` (columns, rows), interpolated where
    /// the input is stretched and they `blend`, else the nearest; what lies beyond `seen` repeats its rim.
    fn fill(&self, values: &mut [f32], picture: (usize, usize), blend: bool, at: impl Fn(usize, usize) -> f32) {
        let (right, bottom) = (self.seen.left + self.seen.width, self.seen.top + self.seen.height);
        for (y, row) in values.chunks_exact_mut(self.size.0.max(1)).enumerate() {
            for (x, value) in row.iter_mut().enumerate() {
                let (u, v) = self.source(x, y);
                let u = u.clamp(self.seen.left as f32, right as f32 - 1.0);
                let v = v.clamp(self.seen.top as f32, bottom as f32 - 1.0);
                *value = if self.stretched && blend {
                    bilinear(picture.0, picture.1, u, v, &at)
                } else {
                    // Half a pixel more: the conversion cuts off.
                    let nearest = |c: f32, end: usize| ((c + 0.5) as usize).min(end.saturating_sub(1));
                    at(nearest(u, picture.0), nearest(v, picture.1))
                };
            }
        }
    }

    /// The window's pixels of planes of the output, plane after plane, row-major.
    pub(super) fn restore(&self, mut planes: Vec<f32>) -> Vec<f32> {
        let (width, height) = self.size;
        let size = (width * height).max(1);
        if self.stretched {
            let (sx, sy) = self.scale();
            let mut window = Vec::with_capacity(planes.len() / size * self.window.pixels());
            for plane in planes.chunks_exact(size) {
                for v in 0..self.window.height {
                    for u in 0..self.window.width {
                        let (x, y) = ((u as f32 + 0.5) / sx - 0.5, (v as f32 + 0.5) / sy - 0.5);
                        window.push(bilinear(width, height, x, y, |x, y| plane[y * width + x]));
                    }
                }
            }
            return window;
        }
        // Rows move forward within the same memory: they are many, and fresh memory costs more than the move.
        let (right, down) = ((self.window.left - self.seen.left) as usize, (self.window.top - self.seen.top) as usize);
        let mut end = 0;
        for plane in 0..planes.len() / size {
            for v in 0..self.window.height as usize {
                let start = plane * size + (down + v) * width + right;
                planes.copy_within(start..start + self.window.width as usize, end);
                end += self.window.width as usize;
            }
        }
        planes.truncate(end);
        planes
    }

    /// The window's pixels of labels that lie on the input.
    pub(super) fn restore_labels(&self, labels: &[u16]) -> Vec<u16> {
        let at = |u: u32, v: u32| {
            let (right, down) = (self.window.left - self.seen.left + u, self.window.top - self.seen.top + v);
            let (sx, sy) = if self.stretched { self.scale() } else { (1.0, 1.0) };
            let nearest = |c: u32, scale: f32, end: usize| (((c as f32 + 0.5) / scale) as usize).min(end - 1);
            labels.get(nearest(down, sy, self.size.1) * self.size.0 + nearest(right, sx, self.size.0))
        };
        let pixels = (0..self.window.height).flat_map(|v| (0..self.window.width).map(move |u| (u, v)));
        pixels.map(|(u, v)| at(u, v).copied().unwrap_or(0)).collect()
    }

    /// Labels of the input's pixels from those of a picture of `columns`.
    pub(super) fn labels(&self, picture: &[u16], columns: u32) -> Vec<u16> {
        let mut labels = vec![0.0; self.size.0 * self.size.1];
        let columns = columns as usize;
        let rows = picture.len() / columns.max(1);
        self.fill(&mut labels, (columns, rows), false, |u, v| {
            picture.get(v * columns + u).copied().map_or(0.0, f32::from)
        });
        labels.into_iter().map(|label| label as u16).collect()
    }
}

/// The value at (x, y), in pixels, of a picture of `width` by `height` that `at` reads; beyond its rim, that of the rim.
pub(super) fn bilinear(width: usize, height: usize, x: f32, y: f32, at: impl Fn(usize, usize) -> f32) -> f32 {
    let split = |c: f32, end: usize| {
        let c = c.clamp(0.0, end.saturating_sub(1) as f32);
        let whole = c as usize;
        (whole, (whole + 1).min(end.saturating_sub(1)), c - whole as f32)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (split(x, width), split(y, height));
    if fx == 0.0 && fy == 0.0 {
        return at(x0, y0);
    }
    let row = |y: usize| at(x0, y) * (1.0 - fx) + at(x1, y) * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::network::manifest::{ColorScale, DepthScale};
    use crate::view::{DepthImage, Intrinsics, PoseEvidence};
    use image::{Rgb, RgbImage};
    use std::sync::Arc;

    const WIDTH: u32 = 50;
    const HEIGHT: u32 = 40;

    /// Red grows with the column, green with the row; depth is 0.4 m, with a hole at the first pixel.
    fn view() -> View {
        let mut metres = vec![0.4; (WIDTH * HEIGHT) as usize];
        metres[0] = 0.0;
        View {
            index: 0,
            stamp: None,
            intrinsics: Intrinsics { width: WIDTH, height: HEIGHT, fx: 50.0, fy: 50.0, cx: 25.0, cy: 20.0 },
            rgb: Arc::new(RgbImage::from_fn(WIDTH, HEIGHT, |u, v| Rgb([u as u8 * 4, v as u8 * 4, 7]))),
            depth: Arc::new(DepthImage { width: WIDTH, height: HEIGHT, metres }),
            pose: PoseEvidence::None,
            labels: None,
            truth: None,
        }
    }

    fn input(multiple: u32, size: Option<(u32, u32)>) -> Input {
        Input {
            tensor: "image".into(),
            channels: vec![Channel::Red, Channel::Green, Channel::Blue, Channel::Depth],
            multiple,
            width: size.map(|s| s.0),
            height: size.map(|s| s.1),
            footprint: None,
            color: Some(ColorScale { mean: [0.5, 0.0, 0.0], std: [0.25, 1.0, 1.0] }),
            depth: Some(DepthScale { near: 0.2, far: 0.6, missing: -1.0 }),
        }
    }

    #[test]
    fn channels_are_scaled_as_the_manifest_says() {
        let (view, input) = (view(), input(1, None));
        let frame = Frame::new(Window::whole(WIDTH, HEIGHT), (WIDTH, HEIGHT), &input);
        let tensor = frame.tensor(&view, &input);
        let plane = (WIDTH * HEIGHT) as usize;
        let at = |c: usize, u: usize, v: usize| tensor[c * plane + v * WIDTH as usize + u];
        assert!((at(0, 10, 3) - (40.0 / 255.0 - 0.5) / 0.25).abs() < 1e-6);
        assert!((at(1, 10, 3) - 12.0 / 255.0).abs() < 1e-6);
        assert!((at(3, 10, 3) - 0.5).abs() < 1e-6);
        assert!((at(3, 0, 0) - -1.0).abs() < 1e-6, "nothing was measured there");
    }

    #[test]
    fn padding_takes_real_pixels_first_and_the_window_comes_back() {
        let (view, input) = (view(), input(16, None));
        let window = Window { left: 3, top: 30, width: 20, height: 10 };
        let frame = Frame::new(window, (WIDTH, HEIGHT), &input);
        assert_eq!(frame.size, (32, 16));
        assert_eq!(frame.seen, Window { left: 0, top: 24, width: 32, height: 16 });
        let tensor = frame.tensor(&view, &input);
        let green = frame.restore(tensor[32 * 16..2 * 32 * 16].to_vec());
        assert_eq!(green.len(), 200);
        assert!((green[0] - 120.0 / 255.0).abs() < 1e-6 && (green[199] - 156.0 / 255.0).abs() < 1e-6);
        // A picture smaller than the padded size repeats its rim.
        let frame = Frame::new(Window::whole(WIDTH, HEIGHT), (WIDTH, HEIGHT), &input);
        assert_eq!(frame.size, (64, 48));
        let tensor = frame.tensor(&view, &input);
        assert_eq!(tensor[49], tensor[63]);
        assert_eq!(tensor[39 * 64], tensor[47 * 64]);
    }

    #[test]
    fn a_fixed_size_stretches_and_shrinks_back() {
        let (view, input) = (view(), input(1, Some((100, 80))));
        let frame = Frame::new(Window::whole(WIDTH, HEIGHT), (WIDTH, HEIGHT), &input);
        let tensor = frame.tensor(&view, &input);
        assert_eq!(tensor.len(), 4 * 100 * 80);
        let red = frame.restore(tensor[..100 * 80].to_vec());
        for u in 2..48 {
            let wanted = (u as f32 * 4.0 / 255.0 - 0.5) / 0.25;
            assert!((red[5 * WIDTH as usize + u] - wanted).abs() < 0.01, "column {u}: {}", red[u]);
        }
    }

    #[test]
    fn between_pixels_values_are_mixed() {
        let at = |x: usize, y: usize| (x + 10 * y) as f32;
        assert!((bilinear(3, 3, 0.5, 1.5, at) - 15.5).abs() < 1e-6);
        assert_eq!(bilinear(3, 3, -4.0, 9.0, at), 20.0);
    }
}
