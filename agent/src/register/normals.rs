//! Normals on the pixel grid, in time that hardly depends on the window.
//!
//! A plane is affine in inverse depth over the image (`1/z = a u + b v + c`), so a normal is one small linear
//! least-squares fit over a window. Where the whole window belongs to one surface the fit's sums are separable: seven
//! taps along rows, seven along columns, over tiles that stay in the cache. Where it does not (near depth steps), or
//! holds too few points, the window is walked and what belongs to another surface left out.

use crate::acquire::Intrinsics;
use rayon::prelude::*;

/// Half edge of the fitting window in pixels; the wide one is tried where the narrow one holds too few points.
const NARROW: i32 = 3;
const WIDE: i32 = 6;
/// Fewest points for a fit.
const MIN_POINTS: f32 = 8.0;
/// Neighbours whose inverse depth differs by more than this share belong to another surface.
const SAME_SURFACE: f32 = 0.015;
/// Points nearer to a line than this share of their spread leave the plane open.
const FLATTEST: f32 = 0.05;

/// Edges of a tile without its border.
const TILE_WIDTH: usize = 64;
const TILE_HEIGHT: usize = 32;
const BORDER: usize = NARROW as usize;
const TAPS: usize = 2 * BORDER + 1;
const PADDED_WIDTH: usize = TILE_WIDTH + 2 * BORDER;
const PADDED_HEIGHT: usize = TILE_HEIGHT + 2 * BORDER;

type Row = [f32; TILE_WIDTH];
type PaddedRow = [f32; PADDED_WIDTH];

/// Sums over a window of `(du, dv, w)`, `w` the inverse depth less a reference.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: f32,
    u: f32,
    v: f32,
    w: f32,
    uu: f32,
    uv: f32,
    vv: f32,
    uw: f32,
    vw: f32,
}

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
}

const NO_SUMS: AlongRow = AlongRow {
    n: [0.0; TILE_WIDTH],
    u: [0.0; TILE_WIDTH],
    uu: [0.0; TILE_WIDTH],
    w: [0.0; TILE_WIDTH],
    uw: [0.0; TILE_WIDTH],
    low: [f32::INFINITY; TILE_WIDTH],
    high: [f32::NEG_INFINITY; TILE_WIDTH],
};

/// Working memory of one thread.
struct Scratch {
    measured: [PaddedRow; PADDED_HEIGHT],
    inverse: [PaddedRow; PADDED_HEIGHT],
    rows: Vec<AlongRow>,
}

/// Depth in metres on the grid of a camera; 0 or less where there is none.
#[derive(Clone, Copy)]
pub(super) struct Grid<'a> {
    pub(super) k: &'a Intrinsics,
    pub(super) depth: &'a [f32],
}

/// Unit normals towards the camera of the pixels that have depth and are `wanted` (all, if absent); zero elsewhere.
pub(super) fn fit_normals(grid: Grid<'_>, wanted: Option<&[bool]>) -> Vec<[f32; 3]> {
    let width = grid.k.width as usize;
    let mut normals = vec![[0.0; 3]; grid.depth.len()];
    if width == 0 {
        return normals;
    }
    normals.par_chunks_mut(width * TILE_HEIGHT).enumerate().for_each_init(Scratch::new, |scratch, (band, out)| {
        let top = band * TILE_HEIGHT;
        let rows = out.len() / width;
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
                    let i = (top + v) * width + left + u;
                    if is_wanted(i) {
                        out[v * width + left + u] = scratch.normal(grid, u, v, (left + u, top + v), reference);
                    }
                }
            }
        }
    });
    normals
}

impl Scratch {
    fn new() -> Self {
        Self {
            measured: [[0.0; PADDED_WIDTH]; PADDED_HEIGHT],
            inverse: [[0.0; PADDED_WIDTH]; PADDED_HEIGHT],
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
            sums.add(measured, inverse);
        }
    }

    /// Normal at column `u` and row `v` of the tile, pixel `(x, y)` of the picture.
    fn normal(&self, grid: Grid<'_>, u: usize, v: usize, at: (usize, usize), reference: f32) -> [f32; 3] {
        let own = self.inverse[v + BORDER][u + BORDER];
        let gate = SAME_SURFACE * (own + reference);
        let mut sums = Sums::default();
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (tap, row) in self.rows[v..v + TAPS].iter().enumerate() {
            let dv = tap as f32 - BORDER as f32;
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
        }
        let one_surface = high - own <= gate && own - low <= gate;
        if one_surface && let Some(normal) = sums.normal(grid.k, at, reference) {
            return normal;
        }
        [NARROW, WIDE]
            .into_iter()
            .filter(|half| !(one_surface && *half == NARROW))
            .find_map(|half| walk(grid, at, half).normal(grid.k, at, own + reference))
            .unwrap_or([0.0; 3])
    }
}

impl AlongRow {
    fn add(&mut self, measured: &PaddedRow, inverse: &PaddedRow) {
        for tap in 0..TAPS {
            let du = tap as f32 - BORDER as f32;
            let (measured, inverse) = (&measured[tap..tap + TILE_WIDTH], &inverse[tap..tap + TILE_WIDTH]);
            for u in 0..TILE_WIDTH {
                let (m, w) = (measured[u], inverse[u]);
                self.n[u] += m;
                self.u[u] += du * m;
                self.uu[u] += du * du * m;
                self.w[u] += w;
                self.uw[u] += du * w;
                self.low[u] = self.low[u].min(if m > 0.0 { w } else { f32::INFINITY });
                self.high[u] = self.high[u].max(if m > 0.0 { w } else { f32::NEG_INFINITY });
            }
        }
    }
}

/// Sums over the window of half edge `half` at pixel `(u, v)`, other surfaces left out; `w` relative to the centre's.
fn walk(grid: Grid<'_>, (u, v): (usize, usize), half: i32) -> Sums {
    let (width, height) = (grid.k.width as i32, grid.k.height as i32);
    let (u, v) = (u as i32, v as i32);
    let own = 1.0 / grid.depth[(v * width + u) as usize];
    let mut sums = Sums::default();
    for y in (v - half).max(0)..=(v + half).min(height - 1) {
        for x in (u - half).max(0)..=(u + half).min(width - 1) {
            let z = grid.depth[(y * width + x) as usize];
            if z <= 0.0 {
                continue;
            }
            let w = 1.0 / z - own;
            if w.abs() > SAME_SURFACE * own {
                continue;
            }
            let (du, dv) = ((x - u) as f32, (y - v) as f32);
            sums.n += 1.0;
            sums.u += du;
            sums.v += dv;
            sums.w += w;
            sums.uu += du * du;
            sums.uv += du * dv;
            sums.vv += dv * dv;
            sums.uw += du * w;
            sums.vw += dv * w;
        }
    }
    sums
}

impl Sums {
    /// The plane's unit normal towards the camera at pixel `(u, v)`; `None` if the points do not hold one.
    fn normal(&self, k: &Intrinsics, (u, v): (usize, usize), reference: f32) -> Option<[f32; 3]> {
        if self.n < MIN_POINTS {
            return None;
        }
        // About the mean the normal equations fall apart into two unknowns and one.
        let share = 1.0 / self.n;
        let (mu, mv, mw) = (self.u * share, self.v * share, self.w * share);
        let (uu, uv, vv) = (self.uu - self.u * mu, self.uv - self.u * mv, self.vv - self.v * mv);
        let (uw, vw) = (self.uw - self.u * mw, self.vw - self.v * mw);
        let determinant = uu * vv - uv * uv;
        if determinant <= FLATTEST * uu * vv {
            return None;
        }
        let a = (vv * uw - uv * vw) / determinant;
        let b = (uu * vw - uv * uw) / determinant;
        let c = mw - a * mu - b * mv + reference;
        // 1/z = a du + b dv + c  <=>  n.p = 1 with n as below; the camera is on the side of -n.
        let x = a * k.fx as f32;
        let y = b * k.fy as f32;
        let z = c - a * (u as f32 - k.cx as f32) - b * (v as f32 - k.cy as f32);
        let length = (x * x + y * y + z * z).sqrt();
        (length.is_finite() && length > 0.0).then(|| [-x / length, -y / length, -z / length])
    }
}
