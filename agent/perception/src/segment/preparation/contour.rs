//! Background by edges and an active contour ([Wang 2023], "Remove the background of the image").
//!
//! Edges are those of [Canny 1986], with an upper threshold 2.5 times the lower. A closed contour starts around the
//! picture and creeps inwards: each point goes where the energy `alpha E_elastic + beta E_bending + gamma E_external`
//! is least among the pixels about it (the greedy scheme of [Williams 1992]). The paper's external energy is the
//! distance from the contour's centre, which draws it in; what holds it is the edge under it, a term that the paper
//! shows in its figure but not in its equation. Outside the contour is background.

use super::noise::luminance;
use image::{GrayImage, Luma, RgbImage};
use imageproc::distance_transform::{Norm, distance_transform};
use imageproc::drawing::draw_polygon_mut;
use imageproc::edges::canny;
use imageproc::point::Point;

/// Weights and size of the contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snake {
    /// Weight of even spacing.
    pub elastic: f32,
    /// Weight of smoothness.
    pub bending: f32,
    /// Weight of the pull to the centre.
    pub external: f32,
    /// Weight of the edge that holds a point.
    pub edge: f32,
    /// Points of the contour.
    pub points: usize,
    /// Most rounds.
    pub rounds: usize,
}

impl Default for Snake {
    fn default() -> Self {
        Self { elastic: 0.4, bending: 0.3, external: 1.0, edge: 3.0, points: 160, rounds: 400 }
    }
}

/// Canny's lower and upper threshold of the gradient.
const GRADIENT: (f32, f32) = (30.0, 75.0);
/// Half edge of the neighbourhood that a point moves in, pixels.
const STEP: i32 = 2;
/// Pixels from an edge at which it no longer holds a point.
const HOLD: f32 = 2.0;

/// True outside the contour around the picture's content, row-major. A picture without edges is all background.
pub fn background(rgb: &RgbImage, snake: &Snake) -> Vec<bool> {
    let (width, height) = rgb.dimensions();
    let outside = vec![true; (width * height) as usize];
    if width < 16 || height < 16 || snake.points < 8 {
        return outside;
    }
    let grey = luminance(rgb);
    let grey = GrayImage::from_fn(width, height, |u, v| Luma([grey.values[(v * width + u) as usize].round() as u8]));
    let edges = canny(&grey, GRADIENT.0, GRADIENT.1);
    let Some((low, high)) = extent(&edges) else { return outside };
    // How far the nearest edge is; saturates at 255.
    let away = distance_transform(&edges, Norm::L2);
    let mut contour = rectangle(low, high, snake.points);
    for _ in 0..snake.rounds {
        if !creep(&mut contour, &away, snake) {
            break;
        }
    }
    inside(&contour, width, height).into_iter().map(|inside| !inside).collect()
}

/// Lowest and highest pixel of the edges; `None` without edges.
fn extent(edges: &GrayImage) -> Option<([i32; 2], [i32; 2])> {
    let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
    for (u, v, _) in edges.enumerate_pixels().filter(|(_, _, p)| p.0[0] > 0) {
        for (axis, at) in [u as i32, v as i32].into_iter().enumerate() {
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    (low[0] < high[0] && low[1] < high[1]).then_some((low, high))
}

/// Points at even distances around a rectangle.
fn rectangle(low: [i32; 2], high: [i32; 2], points: usize) -> Vec<[i32; 2]> {
    let (w, h) = ((high[0] - low[0]) as f32, (high[1] - low[1]) as f32);
    (0..points)
        .map(|k| {
            let way = k as f32 / points as f32 * 2.0 * (w + h);
            let (x, y) = if way < w {
                (way, 0.0)
            } else if way < w + h {
                (w, way - w)
            } else if way < 2.0 * w + h {
                (2.0 * w + h - way, h)
            } else {
                (0.0, 2.0 * (w + h) - way)
            };
            [low[0] + x.round() as i32, low[1] + y.round() as i32]
        })
        .collect()
}

/// Moves each point once; whether any moved.
fn creep(contour: &mut [[i32; 2]], away: &GrayImage, snake: &Snake) -> bool {
    let n = contour.len();
    let centre = [0, 1].map(|a| contour.iter().map(|p| p[a] as f32).sum::<f32>() / n as f32);
    let distance = |p: [i32; 2], q: [i32; 2]| (((p[0] - q[0]).pow(2) + (p[1] - q[1]).pow(2)) as f32).sqrt();
    let spacing = (0..n).map(|i| distance(contour[i], contour[(i + 1) % n])).sum::<f32>() / n as f32;
    let mut moved = false;
    for i in 0..n {
        let (before, after, own) = (contour[(i + n - 1) % n], contour[(i + 1) % n], contour[i]);
        let energy = |p: [i32; 2]| {
            let elastic = (distance(p, before) - spacing).abs();
            let bend = [0, 1].map(|a| (before[a] - 2 * p[a] + after[a]) as f32);
            let bending = (bend[0] * bend[0] + bend[1] * bend[1]).sqrt();
            let external = ((p[0] as f32 - centre[0]).powi(2) + (p[1] as f32 - centre[1]).powi(2)).sqrt();
            let edge = f32::from(away.get_pixel(p[0] as u32, p[1] as u32).0[0]);
            let held = (1.0 - edge / HOLD).max(0.0);
            snake.elastic * elastic + snake.bending * bending + snake.external * external
                - snake.edge * STEP as f32 * held
        };
        let mut best = (own, energy(own));
        for y in (own[1] - STEP).max(0)..=(own[1] + STEP).min(away.height() as i32 - 1) {
            for x in (own[0] - STEP).max(0)..=(own[0] + STEP).min(away.width() as i32 - 1) {
                let candidate = ([x, y], energy([x, y]));
                if candidate.1 < best.1 {
                    best = candidate;
                }
            }
        }
        moved |= best.0 != own;
        contour[i] = best.0;
    }
    moved
}

/// Which pixels lie inside the contour.
fn inside(contour: &[[i32; 2]], width: u32, height: u32) -> Vec<bool> {
    let mut polygon: Vec<Point<i32>> = contour.iter().map(|p| Point::new(p[0], p[1])).collect();
    polygon.dedup();
    // The drawing closes the polygon itself.
    while polygon.len() > 1 && polygon.first() == polygon.last() {
        polygon.pop();
    }
    let mut mask = GrayImage::new(width, height);
    if polygon.len() >= 3 {
        draw_polygon_mut(&mut mask, &polygon, Luma([255]));
    }
    mask.into_raw().into_iter().map(|m| m > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// An ellipse, textured, before an even backdrop.
    fn ellipse() -> (RgbImage, Vec<bool>) {
        let on = |u: u32, v: u32| ((u as f32 - 110.0) / 60.0).powi(2) + ((v as f32 - 70.0) / 40.0).powi(2) < 1.0;
        let rgb = RgbImage::from_fn(220, 150, |u, v| {
            if on(u, v) { Rgb([170 + (u % 7) as u8, 160, 150 + (v % 5) as u8]) } else { Rgb([40, 42, 46]) }
        });
        (rgb, (0..220 * 150).map(|i| on(i % 220, i / 220)).collect())
    }

    #[test]
    fn the_contour_settles_on_the_object() {
        let (rgb, truth) = ellipse();
        let background = background(&rgb, &Snake::default());
        let both = background.iter().zip(&truth).filter(|(b, t)| !**b && **t).count();
        let either = background.iter().zip(&truth).filter(|(b, t)| !**b || **t).count();
        let iou = both as f64 / either as f64;
        assert!(iou > 0.93, "IoU {iou}");
    }

    #[test]
    fn without_edges_everything_is_background() {
        let plain = RgbImage::from_pixel(64, 48, Rgb([9; 3]));
        assert!(background(&plain, &Snake::default()).iter().all(|b| *b));
        assert_eq!(background(&RgbImage::new(3, 2), &Snake::default()), [true; 6]);
    }
}
