//! A view as the search for a turntable needs it: small, so that all views of a recording fit into memory together.

use crate::view::{Intrinsics, View, luma};

/// Most columns of a thinned picture.
const COLUMNS: usize = 320;
/// Half the window over which grey values are normalised, pixels.
const HALF_WINDOW: usize = 6;
/// Contrast (of 255) that counts as noise: flat regions are not blown up.
const NOISE: f32 = 4.0;

/// A thinned view: about 0.7 MB.
#[derive(Clone, Debug)]
pub struct TurningView {
    /// The camera of the thinned picture.
    pub(super) camera: Intrinsics,
    /// Metres along the optical axis, row-major; 0 where nothing was measured.
    pub(super) depth: Vec<f32>,
    /// Grey values less the mean around them, over the deviation around them: free of exposure and slow shading.
    pub(super) grey: Vec<f32>,
    /// Grey values as they are, 0 to 255.
    pub(super) raw: Vec<u8>,
    /// Whether a label says that the pixel is of the part; empty without labels.
    pub(super) part: Vec<bool>,
}

impl TurningView {
    /// Of a view.
    pub fn of(view: &View) -> Self {
        let (width, height) = (view.rgb.width() as usize, view.rgb.height() as usize);
        let factor = width.div_ceil(COLUMNS).max(1);
        let (columns, rows) = (width / factor, height / factor);
        let mut grey = vec![0.0_f32; columns * rows];
        for (v, line) in view.rgb.rows().enumerate().filter(|(v, _)| v / factor < rows) {
            for (u, p) in line.enumerate().filter(|(u, _)| u / factor < columns) {
                grey[(v / factor) * columns + u / factor] += luma(p.0) / (factor * factor) as f32;
            }
        }
        // A mean of depths across an edge would lie on no surface: the middle pixel stands for its block.
        let middle = |i: usize| (i / columns * factor + factor / 2) * width + i % columns * factor + factor / 2;
        let depth = (0..columns * rows).map(|i| view.depth.metres[middle(i)]).collect();
        let part = view.labels.as_deref().map(|l| (0..columns * rows).map(|i| l.shows_component(middle(i))).collect());
        let shrink = 1.0 / factor as f64;
        let scaled = view.intrinsics.scaled(shrink);
        let off = (factor / 2) as f64 - 0.5 * (factor - 1) as f64;
        // The middle pixel of an even block lies half a pixel beside the block's centre.
        let camera = Intrinsics {
            width: columns as u32,
            height: rows as u32,
            cx: scaled.cx - off * shrink,
            cy: scaled.cy - off * shrink,
            ..scaled
        };
        let raw = grey.iter().map(|g| g.round() as u8).collect();
        Self { camera, depth, raw, grey: normalised(&grey, columns, rows), part: part.unwrap_or_default() }
    }

    /// The normalised grey value at the image point `(u, v)` inside the picture.
    #[inline]
    pub(super) fn grey_at(&self, u: f64, v: f64) -> f32 {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let (u, v) = (u.clamp(0.0, width as f64 - 1.001), v.clamp(0.0, height as f64 - 1.001));
        let (x, y) = (u as usize, v as usize);
        let (a, b) = ((u - x as f64) as f32, (v - y as f64) as f32);
        let i = y * width + x;
        let g = &self.grey;
        let (right, below) = (usize::from(x + 1 < width), if y + 1 < height { width } else { 0 });
        let top = g[i] + a * (g[i + right] - g[i]);
        let low = g[i + below] + a * (g[i + below + right] - g[i + below]);
        top + b * (low - top)
    }
}

/// Grey values less their local mean, over their local standard deviation, cut at four of these.
fn normalised(grey: &[f32], width: usize, height: usize) -> Vec<f32> {
    // Sums over the rectangle before each pixel.
    let mut sums = vec![(0.0_f64, 0.0_f64); (width + 1) * (height + 1)];
    for v in 0..height {
        let mut line = (0.0, 0.0);
        for u in 0..width {
            let g = f64::from(grey[v * width + u]);
            line = (line.0 + g, line.1 + g * g);
            let above = sums[v * (width + 1) + u + 1];
            sums[(v + 1) * (width + 1) + u + 1] = (above.0 + line.0, above.1 + line.1);
        }
    }
    let mut out = Vec::with_capacity(grey.len());
    for v in 0..height {
        let (top, low) = (v.saturating_sub(HALF_WINDOW), (v + HALF_WINDOW + 1).min(height));
        for u in 0..width {
            let (left, right) = (u.saturating_sub(HALF_WINDOW), (u + HALF_WINDOW + 1).min(width));
            let at = |v: usize, u: usize| sums[v * (width + 1) + u];
            let (a, b, c, d) = (at(low, right), at(top, right), at(low, left), at(top, left));
            let n = ((low - top) * (right - left)) as f64;
            let (mean, square) = ((a.0 - b.0 - c.0 + d.0) / n, (a.1 - b.1 - c.1 + d.1) / n);
            let deviation = ((square - mean * mean).max(0.0) as f32 + NOISE * NOISE).sqrt();
            out.push(((grey[v * width + u] - mean as f32) / deviation).clamp(-4.0, 4.0));
        }
    }
    out
}
