//! The corners of a grid of AprilTags. The small squares between the tags make a crossing of each tag's corner, so the crossings are
//! found as on a chessboard. Four of them that enclose black from white are read; tags tell where in the grid they are.

use crate::detect::{DetectError, crossings, view};
use crate::print::dictionary;
use calib_targets_aruco::{MarkerCell, Matcher, ScanDecodeConfig, decode_marker_in_cell};
use calib_targets_chessboard::detect_corners;
use calib_targets_core::Coord;
use image::GrayImage;
use nalgebra::{Point2, Vector2};
use semascan_calibration::{Board, Corner, agreeing, homography};

/// Nearest crossings of which the next corner of a tag is looked for: corners of bits come as weak ones, too.
const NEIGHBOURS: usize = 250;
/// Distance from an edge at which its colours are looked at, as a share of its length: half of a bit's.
const BESIDE: f32 = 1.0 / 16.0;
/// Least difference of these, as a share of the picture's contrast.
const EDGE: f32 = 0.25;
/// Least edge of a tag, pixels.
const LEAST_EDGE: f32 = 12.0;
/// Bits that may be read wrongly, of tags whose codes differ by eleven.
const WRONG_BITS: u8 = 2;
/// Edge at which a tag is read, pixels.
const READ_AT: f32 = 60.0;
/// Error of a tag's middle up to which it agrees with the grid, in distances of tags.
const AGREES: f64 = 0.2;
/// The same of a corner.
const CORNER_AGREES: f64 = 0.1;

/// A quadrilateral with a tag in it.
struct Tag {
    /// Its place in the grid: column, row.
    place: Point2<f64>,
    corners: [Point2<f64>; 4],
}

pub(crate) fn detect(board: &Board, picture: &GrayImage) -> Result<Vec<Corner>, DetectError> {
    let Board::AprilGrid { columns, rows, tag_mm, gap_mm, dictionary: name } = board else {
        return Err(DetectError::Board("it is no grid of tags".into()));
    };
    let matcher = Matcher::new(dictionary(name)?, WRONG_BITS);
    let points: Vec<Point2<f32>> =
        detect_corners(&view(picture), &crossings()).iter().map(|crossing| crossing.position).collect();
    let config = ScanDecodeConfig::default();
    let outlines = outlines(&points, picture);
    let mut tags = Vec::new();
    for corners_img in outlines.iter().copied() {
        let cell = MarkerCell::new(Coord::new(0, 0), corners_img);
        let Some(read) = decode_marker_in_cell(&view(picture), &cell, READ_AT, &config, &matcher) else { continue };
        if read.inverted || read.id >= columns * rows {
            continue;
        }
        tags.push(Tag {
            place: Point2::new(f64::from(read.id % columns), f64::from(read.id / columns)),
            corners: corners_img.map(|p| Point2::new(f64::from(p.x), f64::from(p.y))),
        });
    }
    let few = || {
        let (tags, outlines, crossings) = (tags.len(), outlines.len(), points.len());
        DetectError::Unseen(format!(
            "{tags} tags are read in {outlines} outlines of {crossings} crossings, too few for a grid"
        ))
    };
    // Where tags are by their middles: their corners follow, whichever way a print turns its tags.
    let places: Vec<Point2<f64>> = tags.iter().map(|tag| tag.place).collect();
    let middles: Vec<Point2<f64>> = tags.iter().map(Tag::middle).collect();
    let edge = tags.iter().map(|tag| (tag.corners[1] - tag.corners[0]).norm()).fold(f64::INFINITY, f64::min);
    let agrees = agreeing(&places, &middles, AGREES * edge);
    let kept: Vec<&Tag> = tags.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(tag, _)| tag).collect();
    let of = |points: &[Point2<f64>]| -> Vec<Point2<f64>> {
        points.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(point, _)| *point).collect()
    };
    if kept.len() < 4 {
        return Err(few());
    }
    let grid = homography(&of(&places), &of(&middles)).ok_or_else(few)?;
    let back = grid.try_inverse().ok_or_else(few)?;

    let pitch = tag_mm + gap_mm;
    let mut corners: Vec<Corner> = Vec::new();
    for tag in kept {
        for corner in &tag.corners {
            // From the middle of its tag, in distances of tags.
            let Some(place) = Point2::from_homogeneous(back * corner.to_homogeneous()) else { continue };
            let half = 0.5 * tag_mm / pitch;
            let side: Vector2<f64> = (place - tag.place).map(f64::signum);
            if (place - tag.place - half * side).norm() > CORNER_AGREES {
                continue;
            }
            let board_mm = [tag.place.x, tag.place.y];
            let board_mm = [0, 1].map(|k| board_mm[k] * pitch + if side[k] > 0.0 { *tag_mm } else { 0.0 });
            if !corners.iter().any(|other| other.board_mm == board_mm) {
                corners.push(Corner { board_mm, pixel: [corner.x, corner.y] });
            }
        }
    }
    Ok(corners)
}

impl Tag {
    fn middle(&self) -> Point2<f64> {
        // Where the diagonals cross: a homography takes middles there, and not to the mean of the corners.
        let [a, b, c, d] = self.corners;
        let (first, second) = (c - a, d - b);
        let along = (b - a).perp(&second) / first.perp(&second);
        a + along * first
    }
}

/// Quadrilaterals of crossings whose edges all have black on their right and white on their left, clockwise in the picture, each once.
fn outlines(points: &[Point2<f32>], picture: &GrayImage) -> Vec<[Point2<f32>; 4]> {
    let contrast = contrast(picture);
    let edges: Vec<Vec<usize>> = points
        .iter()
        .map(|corner| {
            let mut order: Vec<(f32, usize)> = points
                .iter()
                .enumerate()
                .map(|(k, p)| ((p - corner).norm(), k))
                .filter(|(d, _)| *d >= LEAST_EDGE)
                .collect();
            order.sort_by(|a, b| a.0.total_cmp(&b.0));
            let near = order.into_iter().take(NEIGHBOURS).map(|(_, k)| k);
            near.filter(|k| is_edge(picture, corner, &points[*k], contrast)).collect()
        })
        .collect();
    let mut found = Vec::new();
    // Each begins at the corner with the least number, so that it comes once.
    for first in 0..points.len() {
        for second in edges[first].iter().filter(|k| **k > first) {
            for third in edges[*second].iter().filter(|k| **k > first) {
                for fourth in edges[*third].iter().filter(|k| **k > first && *k != second) {
                    if edges[*fourth].contains(&first) {
                        found.push([first, *second, *third, *fourth].map(|k| points[k]));
                    }
                }
            }
        }
    }
    found
}

/// Whether there is black all along the right of a line, half a bit beside it, and white along its left.
fn is_edge(picture: &GrayImage, from: &Point2<f32>, to: &Point2<f32>, contrast: f32) -> bool {
    let along = to - from;
    let right = Vector2::new(-along.y, along.x) * BESIDE;
    let grey = |at: Point2<f32>| {
        let (x, y) = (at.x.round(), at.y.round());
        let is_inside = x >= 0.0 && y >= 0.0 && x < picture.width() as f32 && y < picture.height() as f32;
        is_inside.then(|| f32::from(picture.get_pixel(x as u32, y as u32).0[0]))
    };
    [0.15, 0.3, 0.5, 0.7, 0.85].iter().all(|share| {
        let on = from + along * *share;
        matches!((grey(on - right), grey(on + right)), (Some(left), Some(right)) if left - right > EDGE * contrast)
    })
}

/// Difference of the grey values that a twentieth of the pixels is above and below of.
fn contrast(picture: &GrayImage) -> f32 {
    let mut counts = [0_usize; 256];
    picture.pixels().for_each(|grey| counts[usize::from(grey.0[0])] += 1);
    let few = counts.iter().sum::<usize>() / 20;
    let reached = |greys: &[usize]| {
        let mut sum = 0;
        let at = greys.iter().position(|count| {
            sum += count;
            sum > few
        });
        at.unwrap_or(0)
    };
    let low = reached(&counts);
    counts.reverse();
    let high = 255 - reached(&counts);
    high.saturating_sub(low) as f32
}
