//! The plane through a window: its sums, and the fit.

use crate::view::Intrinsics;

/// Fewest points for a fit.
const MIN_POINTS: f32 = 8.0;
/// Points nearer to a line than this share of their spread leave the plane open.
const FLATTEST: f32 = 0.05;

/// Neighbours whose inverse depth differs by more than this share belong to another surface.
pub(super) const SAME_SURFACE: f32 = 0.015;

/// Depth in metres on the grid of a camera; 0 or less where there is none.
#[derive(Clone, Copy)]
pub(in crate::organized) struct Grid<'a> {
    pub(in crate::organized) k: &'a Intrinsics,
    pub(in crate::organized) depth: &'a [f32],
}

/// Sums over a window of `(du, dv, w)`, `w` the inverse depth less a reference.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) n: f32,
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) w: f32,
    pub(super) uu: f32,
    pub(super) uv: f32,
    pub(super) vv: f32,
    pub(super) uw: f32,
    pub(super) vw: f32,
}

/// Sums over the window of half edge `half` at pixel `(u, v)`, other surfaces left out; `w` relative to the centre's.
pub(super) fn walk(grid: Grid<'_>, (u, v): (usize, usize), half: i32) -> Sums {
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
    /// The plane's unit normal towards the camera at pixel `(u, v)` and its inverse depth there; `None` if the points do
    /// not hold a plane.
    pub(super) fn plane(&self, k: &Intrinsics, (u, v): (usize, usize), reference: f32) -> Option<([f32; 3], f32)> {
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
        (length.is_finite() && length > 0.0).then(|| ([-x / length, -y / length, -z / length], c))
    }
}
