//! The surface about a depth pixel, for what must know its depth a fraction of a pixel beside: a plane, whose inverse depth
//! is linear in the pixel.
//!
//! A slope is taken only where the pixels on both sides were measured and lie on one line with it; at an edge, a crease or a
//! hole there is none, and the pixel's own depth holds. So no depth is made between two surfaces.

use semascan_perception::view::DepthImage;

/// Largest bend of a surface within three pixels that is still taken for a plane, as a share of its inverse depth.
const BENT: f64 = 0.003;

/// Inverse depth about a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LocalPlane {
    /// At the pixel's centre, 1/m.
    pub(super) inverse: f64,
    /// By how much more a column to the right, a row down.
    pub(super) slope: [f64; 2],
}

impl LocalPlane {
    /// The surface that pixel `(u, v)` shows; `None` where it was not measured.
    pub(super) fn at(depth: &DepthImage, u: u32, v: u32) -> Option<Self> {
        let inverse = 1.0 / f64::from(depth.at(u, v)?);
        let slope = [
            slope(inverse, neighbour(depth, u.checked_sub(1), Some(v)), neighbour(depth, u.checked_add(1), Some(v))),
            slope(inverse, neighbour(depth, Some(u), v.checked_sub(1)), neighbour(depth, Some(u), v.checked_add(1))),
        ];
        Some(Self { inverse, slope })
    }

    /// Depth in metres `right` columns and `down` rows from the pixel's centre.
    pub(super) fn depth_at(&self, right: f64, down: f64) -> f64 {
        1.0 / (self.inverse + self.slope[0] * right + self.slope[1] * down)
    }

    /// The plane that faces the camera at the pixel's depth.
    pub(super) fn facing(&self) -> Self {
        Self { slope: [0.0; 2], ..*self }
    }
}

/// Inverse depth of a neighbour; `None` beside the picture and where it was not measured.
fn neighbour(depth: &DepthImage, u: Option<u32>, v: Option<u32>) -> Option<f64> {
    let (u, v) = (u?, v?);
    if u >= depth.width || v >= depth.height {
        return None;
    }
    Some(1.0 / f64::from(depth.at(u, v)?))
}

/// The slope through a pixel and its neighbours on both sides; 0 where they are not on one line.
fn slope(here: f64, before: Option<f64>, after: Option<f64>) -> f64 {
    match before.zip(after) {
        Some((before, after)) if (before - 2.0 * here + after).abs() <= BENT * here => 0.5 * (after - before),
        _ => 0.0,
    }
}
