//! The corners of a chessboard. It has no markers: which corner is the first is told by the colours of the squares, so all of the
//! board must be in the picture, and its sizes must differ by an odd number.

use crate::detect::{DetectError, crossings, view};
use calib_targets_chessboard::{ChessboardDetector, ChessboardParams, detect_corners};
use image::GrayImage;
use nalgebra::{Point2, Vector2};
use semascan_calibration::Corner;
use std::collections::HashMap;

/// Crossings by their place in a grid.
type Grid = HashMap<(i32, i32), Point2<f64>>;

/// * `sizes`: squares along a row, and rows.
pub(crate) fn detect(sizes: (u32, u32), square_mm: f64, picture: &GrayImage) -> Result<Vec<Corner>, DetectError> {
    let crossings = detect_corners(&view(picture), &crossings());
    let detector =
        ChessboardDetector::new(ChessboardParams::default()).map_err(|error| DetectError::Board(error.to_string()))?;
    let found =
        detector.detect(&crossings).ok_or_else(|| DetectError::Unseen("there is no grid of crossings".into()))?;
    let mut grid: Grid = found
        .corners
        .iter()
        .map(|c| ((c.grid.u, c.grid.v), Point2::new(f64::from(c.position.x), f64::from(c.position.y))))
        .collect();
    let wanted = (sizes.0 as i32 - 1, sizes.1 as i32 - 1);
    let mut seen = (0, 0);
    for _ in 0..4 {
        grid = turned(&grid);
        let width = grid.keys().map(|k| k.0).max().unwrap_or(0) + 1;
        let height = grid.keys().map(|k| k.1).max().unwrap_or(0) + 1;
        seen = (width, height);
        if seen == wanted && first_is_black(&grid, picture) {
            let corners = grid.iter().map(|((u, v), p)| Corner {
                board_mm: [f64::from(u + 1) * square_mm, f64::from(v + 1) * square_mm],
                pixel: [p.x, p.y],
            });
            let mut corners: Vec<Corner> = corners.collect();
            corners
                .sort_by(|a, b| a.board_mm[1].total_cmp(&b.board_mm[1]).then(a.board_mm[0].total_cmp(&b.board_mm[0])));
            return Ok(corners);
        }
    }
    Err(DetectError::Unseen(format!(
        "{} x {} corners are seen, and all of its {} x {} must be",
        seen.0, seen.1, wanted.0, wanted.1
    )))
}

/// The grid turned by a quarter, right-handed as before.
fn turned(grid: &Grid) -> Grid {
    let last = grid.keys().map(|k| k.1).max().unwrap_or(0);
    grid.iter().map(|((u, v), p)| ((last - v, *u), *p)).collect()
}

/// Whether the square above and left of the first corner is black, by the grey values of those inside of the board.
fn first_is_black(grid: &Grid, picture: &GrayImage) -> bool {
    let mut even_less_odd = 0.0;
    for (u, v) in grid.keys() {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(du, dv)| grid.get(&(u + du, v + dv)));
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let middle: Vector2<f64> = (a.coords + b.coords + c.coords + d.coords) / 4.0;
        let (x, y) = (middle.x.round(), middle.y.round());
        if x >= 0.0 && y >= 0.0 && x < f64::from(picture.width()) && y < f64::from(picture.height()) {
            let grey = f64::from(picture.get_pixel(x as u32, y as u32).0[0]);
            even_less_odd += if (u + v) % 2 == 0 { grey } else { -grey };
        }
    }
    even_less_odd < 0.0
}
