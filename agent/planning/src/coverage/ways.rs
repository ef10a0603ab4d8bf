//! What the rays of a view say of the cells on their way.

use super::{Cell, NO_RETURN, State};
use nalgebra::{Isometry3, Point3};
use semascan_perception::fuse::KeptDepth;
use semascan_perception::view::Intrinsics;

/// Cells before a measured point up to which the way to it is free.
const BEFORE: f64 = 1.0;
/// Cells behind which a point must lie so that the view looks through a cell of surface.
const THROUGH: f64 = 2.0;
/// Half edge of the window around a pixel in which nothing may be measured, so that a ray without a measurement is one into
/// nothing; in cells.
const ALONE: f64 = 2.0;

/// The rays of a view.
pub(super) struct Ways<'a> {
    view: &'a KeptDepth<'a>,
    camera_from_table: Isometry3<f64>,
    k: Intrinsics,
    edge: f64,
    /// Sums of measured pixels above and left of each: how many there are in a window follows from four of them.
    measured: Vec<u32>,
}

impl<'a> Ways<'a> {
    pub(super) fn of(view: &'a KeptDepth<'a>, edge: f64) -> Self {
        let k = view.intrinsics;
        let (width, height) = (k.width as usize, k.height as usize);
        let mut measured = vec![0; (width + 1) * (height + 1)];
        for v in 0..height {
            let mut row = 0;
            for u in 0..width {
                row += u32::from(view.metres[v * width + u] > 0.0);
                measured[(v + 1) * (width + 1) + u + 1] = measured[v * (width + 1) + u + 1] + row;
            }
        }
        Self { view, camera_from_table: view.table_from_camera.inverse(), k, edge, measured }
    }

    /// Says what the ray through `centre` (table frame) says of its cell.
    pub(super) fn follow(&self, cell: &mut Cell, centre: &Point3<f64>) {
        let p = self.camera_from_table * centre;
        let Some((u, v)) = self.k.project(&p) else { return };
        let Some(pixel) = self.k.pixel(u, v) else { return };
        let depth = f64::from(self.view.metres[pixel]);
        if depth > 0.0 {
            let before = (depth - p.z) / self.edge;
            match cell.state {
                State::Unknown if before > BEFORE => cell.state = State::Free,
                State::Surface if before > THROUGH => {
                    cell.views -= 1;
                    if cell.views <= 0 {
                        *cell = Cell { state: State::Free, ..super::UNKNOWN };
                    }
                }
                _ => {}
            }
        } else if cell.state == State::Unknown && self.is_alone(pixel, p.z) {
            cell.odds *= NO_RETURN;
        }
    }

    /// Whether nothing was measured around `pixel`.
    fn is_alone(&self, pixel: usize, depth: f64) -> bool {
        let (width, height) = (self.k.width as usize, self.k.height as usize);
        let half = (ALONE * self.edge / self.k.footprint(depth)).ceil() as usize;
        let (u, v) = (pixel % width, pixel / width);
        let (left, right) = (u.saturating_sub(half), (u + half + 1).min(width));
        let (top, bottom) = (v.saturating_sub(half), (v + half + 1).min(height));
        let sum = |v: usize, u: usize| self.measured[v * (width + 1) + u];
        sum(bottom, right) + sum(top, left) == sum(top, right) + sum(bottom, left)
    }
}
