//! Normals on the pixel grid, in time that hardly depends on the window.
//!
//! A plane is affine in inverse depth over the image (`1/z = a u + b v + c`), so a normal is one small linear
//! least-squares fit over a window. Where the whole window belongs to one surface the fit's sums are separable: seven
//! taps along rows, seven along columns, over tiles that stay in the cache. Where it does not (near depth steps), or
//! holds too few points, the window is walked and what belongs to another surface left out.
//!
//! The fit also gives a quieter depth. The mean over 3x3 pixels and the plane over the window both cut a curved
//! surface's corner, by its curvature times their mean square extent; so their difference tells the curvature, and what
//! the mean lost is given back. That matters more than noise: views are averaged, and what biases each alike stays (the
//! plane's own depth would be quieter still, but makes a noisy part a tenth of a millimetre too thin). The estimate is
//! taken where it does not contradict the pixel by more than noise explains [Lepski 1990]; the noise is measured on the
//! spot, by second differences. Where nothing is known of it the depth stays as captured.

mod plane;

pub(super) use plane::Grid;
use plane::{SAME_SURFACE, Sums, walk};
use rayon::prelude::*;

/// Half edge of the fitting window in pixels; the wide one is tried where the narrow one holds too few points.
const NARROW: i32 = 3;
const WIDE: i32 = 6;

/// What the mean over 3x3 pixels loses to curvature, in its differences from the plane over the window: the mean square
/// extent of three pixels is 2/3, of seven 4, and 0.2 = (2/3) / (4 - 2/3).
const LOST_TO_CURVATURE: f32 = 0.2;
/// Standard deviation of the mean with that given back, in deviations of one pixel.
const SMOOTH_DEVIATION: f32 = 0.39;
/// It may differ from the pixel by this many deviations of one pixel: twice that of their difference.
const AGREES: f32 = 1.9;
/// Fewest second differences for an estimate of the noise.
const MIN_BENDS: f32 = 10.0;

/// Edges of a tile without its border.
const TILE_WIDTH: usize = 64;
const TILE_HEIGHT: usize = 32;
const BORDER: usize = NARROW as usize + 1;
const TAPS: usize = 2 * NARROW as usize + 1;
const PADDED_WIDTH: usize = TILE_WIDTH + 2 * BORDER;
const PADDED_HEIGHT: usize = TILE_HEIGHT + 2 * BORDER;

type Row = [f32; TILE_WIDTH];
type PaddedRow = [f32; PADDED_WIDTH];

/// Sums along a row: of the measured pixels, and the extremes of their `w`.
#[derive(Clone)]
struct AlongRow {
    n: Row,
    u: Row,
    uu: Row,
    w: Row,
    uw: Row,
    low: Row,
    high: Row,
    /// Squared second differences along the row, and their number.
    bends: Row,
    bend_count: Row,
}

/// What is fitted at a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Fit {
    normal: [f32; 3],
    /// Less noisy depth and its standard deviation, metres; `None` where nothing is known of the noise.
    smooth: Option<(f32, f32)>,
}

/// Plane fits of a picture, row-major.
#[derive(Clone, Debug)]
pub(super) struct Fits {
    /// Unit normals towards the camera; zero where none was fitted.
    pub(super) normals: Vec<[f32; 3]>,
    /// Depth with less noise, metres; as captured where no better is known.
    pub(super) smooth: Vec<f32>,
    /// Standard deviation of `smooth`, metres; infinite where unknown.
    pub(super) sigma: Vec<f32>,
}

const NO_SUMS: AlongRow = AlongRow {
    n: [0.0; TILE_WIDTH],
    u: [0.0; TILE_WIDTH],
    uu: [0.0; TILE_WIDTH],
    w: [0.0; TILE_WIDTH],
    uw: [0.0; TILE_WIDTH],
    low: [f32::INFINITY; TILE_WIDTH],
    high: [f32::NEG_INFINITY; TILE_WIDTH],
    bends: [0.0; TILE_WIDTH],
    bend_count: [0.0; TILE_WIDTH],
};

/// Working memory of one thread.
struct Scratch {
    measured: [PaddedRow; PADDED_HEIGHT],
    inverse: [PaddedRow; PADDED_HEIGHT],
    bend: PaddedRow,
    bent: PaddedRow,
    rows: Vec<AlongRow>,
}

/// Fits the pixels that have depth and are `wanted` (all, if absent).
pub(super) fn fit_planes(grid: Grid<'_>, wanted: Option<&[bool]>) -> Fits {
    let width = grid.k.width as usize;
    let pixels = grid.depth.len();
    let mut fits =
        Fits { normals: vec![[0.0; 3]; pixels], smooth: grid.depth.to_vec(), sigma: vec![f32::INFINITY; pixels] };
    if width == 0 {
        return fits;
    }
    let band = width * TILE_HEIGHT;
    let bands =
        fits.normals.par_chunks_mut(band).zip(fits.smooth.par_chunks_mut(band)).zip(fits.sigma.par_chunks_mut(band));
    // Bands of rows on all threads, each cut into tiles whose sums fit the cache.
    bands.enumerate().for_each_init(Scratch::new, |scratch, (band, ((normals, smooth), sigma))| {
        let top = band * TILE_HEIGHT;
        let rows = normals.len() / width;
        let is_wanted = |i: usize| grid.depth[i] > 0.0 && wanted.is_none_or(|w| w.get(i).copied().unwrap_or(false));
        for left in (0..width).step_by(TILE_WIDTH) {
            let columns = TILE_WIDTH.min(width - left);
            let mut pixels = (top..top + rows).flat_map(|v| (v * width + left)..(v * width + left + columns));
            // The reference keeps the digits of f32 for what differs within the tile.
            let Some(first) = pixels.find(|&i| is_wanted(i)) else { continue };
            let reference = 1.0 / grid.depth[first];
            scratch.gather(grid, left, top, reference);
            for v in 0..rows {
                for u in 0..columns {
                    let i = v * width + left + u;
                    if !is_wanted(top * width + i) {
                        continue;
                    }
                    let fit = scratch.fit(grid, u, v, (left + u, top + v), reference);
                    normals[i] = fit.normal;
                    if let Some((depth, deviation)) = fit.smooth {
                        (smooth[i], sigma[i]) = (depth, deviation);
                    }
                }
            }
        }
    });
    fits
}

impl Scratch {
    fn new() -> Self {
        Self {
            measured: [[0.0; PADDED_WIDTH]; PADDED_HEIGHT],
            inverse: [[0.0; PADDED_WIDTH]; PADDED_HEIGHT],
            bend: [0.0; PADDED_WIDTH],
            bent: [0.0; PADDED_WIDTH],
            rows: vec![NO_SUMS; PADDED_HEIGHT],
        }
    }

    /// Reads the tile at `(left, top)` with its border and sums along its rows.
    fn gather(&mut self, grid: Grid<'_>, left: usize, top: usize, reference: f32) {
        let (width, height) = (grid.k.width as usize, grid.k.height as usize);
        for (y, ((measured, inverse), sums)) in
            self.measured.iter_mut().zip(&mut self.inverse).zip(&mut self.rows).enumerate()
        {
            *measured = [0.0; PADDED_WIDTH];
            *inverse = [0.0; PADDED_WIDTH];
            sums.clone_from(&NO_SUMS);
            let Some(v) = (top + y).checked_sub(BORDER).filter(|&v| v < height) else { continue };
            let (start, end) = (left.saturating_sub(BORDER), (left + TILE_WIDTH + BORDER).min(width));
            let skipped = start + BORDER - left;
            let depth = &grid.depth[v * width + start..v * width + end];
            for ((&z, measured), inverse) in depth.iter().zip(&mut measured[skipped..]).zip(&mut inverse[skipped..]) {
                let known = z > 0.0;
                *measured = f32::from(u8::from(known));
                *inverse = if known { 1.0 / z - reference } else { 0.0 };
            }
            for u in 1..PADDED_WIDTH - 1 {
                let bend = inverse[u - 1] - 2.0 * inverse[u] + inverse[u + 1];
                let known = measured[u - 1] * measured[u] * measured[u + 1];
                // A step is no noise.
                let smooth = known * f32::from(u8::from(bend.abs() < SAME_SURFACE * reference));
                self.bend[u] = smooth * bend * bend;
                self.bent[u] = smooth;
            }
            sums.add(measured, inverse, &self.bend, &self.bent);
        }
    }

    /// Fit at column `u` and row `v` of the tile, pixel `at` of the picture.
    fn fit(&self, grid: Grid<'_>, u: usize, v: usize, at: (usize, usize), reference: f32) -> Fit {
        let own = self.inverse[v + BORDER][u + BORDER];
        // Sums over the window: those along rows are known, so that only the rows are added up.
        let gate = SAME_SURFACE * (own + reference);
        let mut sums = Sums::default();
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let (mut bends, mut bend_count) = (0.0, 0.0);
        for (tap, row) in self.rows[v + 1..v + 1 + TAPS].iter().enumerate() {
            let dv = (tap as i32 - NARROW) as f32;
            low = low.min(row.low[u]);
            high = high.max(row.high[u]);
            sums.n += row.n[u];
            sums.u += row.u[u];
            sums.uu += row.uu[u];
            sums.w += row.w[u];
            sums.uw += row.uw[u];
            sums.v += dv * row.n[u];
            sums.vv += dv * dv * row.n[u];
            sums.uv += dv * row.u[u];
            sums.vw += dv * row.w[u];
            bends += row.bends[u];
            bend_count += row.bend_count[u];
        }
        // The second difference of white noise has six times its variance.
        let noise = (bend_count >= MIN_BENDS).then(|| (bends / (6.0 * bend_count)).sqrt());
        // Where all of the window is one surface, the sums give the plane.
        let one_surface = high - own <= gate && own - low <= gate;
        if one_surface && let Some((normal, plane)) = sums.plane(grid.k, at, reference) {
            let smooth = noise.map(|noise| self.smooth(u, v, plane, reference, noise));
            return Fit { normal, smooth };
        }
        // Elsewhere the window is walked, and pixels of other surfaces left out; a wider one where it holds too few.
        let normal = [NARROW, WIDE]
            .into_iter()
            .filter(|half| !(one_surface && *half == NARROW))
            .find_map(|half| walk(grid, at, half).plane(grid.k, at, own + reference))
            .map_or([0.0; 3], |(normal, _)| normal);
        let captured = 1.0 / (own + reference);
        Fit { normal, smooth: noise.map(|noise| (captured, noise * captured * captured)) }
    }

    /// The least noisy depth that the pixels allow, and its standard deviation. `plane` is the inverse depth of the plane
    /// through the window, `noise` the deviation of one pixel's.
    fn smooth(&self, u: usize, v: usize, plane: f32, reference: f32, noise: f32) -> (f32, f32) {
        let own = self.inverse[v + BORDER][u + BORDER];
        let (mut count, mut sum) = (0.0, 0.0);
        for row in v + BORDER - 1..=v + BORDER + 1 {
            for column in u + BORDER - 1..=u + BORDER + 1 {
                count += self.measured[row][column];
                sum += self.inverse[row][column];
            }
        }
        // The mean over 3x3 pixels, and what it loses to curvature given back.
        let mean = sum / 9.0;
        let curved = mean + LOST_TO_CURVATURE * (mean - (plane - reference));
        // An incomplete mean is no mean about the pixel.
        let (inverse, deviation) = if count < 9.0 || (own - curved).abs() > AGREES * noise {
            (own + reference, noise)
        } else {
            (curved + reference, SMOOTH_DEVIATION * noise)
        };
        let depth = 1.0 / inverse;
        (depth, deviation * depth * depth)
    }
}

impl AlongRow {
    fn add(&mut self, measured: &PaddedRow, inverse: &PaddedRow, bend: &PaddedRow, bent: &PaddedRow) {
        for tap in 0..TAPS {
            let du = (tap as i32 - NARROW) as f32;
            let window = tap + 1..tap + 1 + TILE_WIDTH;
            let (measured, inverse) = (&measured[window.clone()], &inverse[window.clone()]);
            let (bend, bent) = (&bend[window.clone()], &bent[window]);
            for u in 0..TILE_WIDTH {
                let (m, w) = (measured[u], inverse[u]);
                self.n[u] += m;
                self.u[u] += du * m;
                self.uu[u] += du * du * m;
                self.w[u] += w;
                self.uw[u] += du * w;
                self.low[u] = self.low[u].min(if m > 0.0 { w } else { f32::INFINITY });
                self.high[u] = self.high[u].max(if m > 0.0 { w } else { f32::NEG_INFINITY });
                self.bends[u] += bend[u];
                self.bend_count[u] += bent[u];
            }
        }
    }
}
