//! The pinhole camera that an organized cloud was computed with, read off its points: files of clouds do not say it.
//!
//! A point in column u and row v of the cloud has u = fx x / z + cx and v = fy y / z + cy. Both are lines, which are fitted by
//! least squares; a cloud that is in no camera's frame, or has another width, fits none.

use semascan_perception::view::Intrinsics;

/// Root mean square distance in pixels between the points' images and their places in the cloud that rounding explains.
const OFF: f64 = 0.5;

/// A camera, and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FittedPinhole {
    pub(crate) intrinsics: Intrinsics,
    /// Root mean square distance of the points' images from their places, in pixels.
    pub(crate) off: f64,
}

/// The camera that sees each point in the pixel of its place in the cloud: a least-squares line through the pixels' columns
/// over `x / z`, and one through their rows over `y / z`.
pub(crate) fn pinhole(width: u32, height: u32, positions: &[[f32; 3]]) -> Result<FittedPinhole, String> {
    if width < 2 || height < 2 {
        return Err(format!("{width} x {height} points: the cloud is not organized, so it is no picture"));
    }
    let (mut columns, mut rows) = (Line::default(), Line::default());
    for (i, [x, y, z]) in positions.iter().map(|p| p.map(f64::from)).enumerate() {
        if z > 0.0 && x.is_finite() && y.is_finite() && z.is_finite() {
            columns.add(x / z, (i % width as usize) as f64);
            rows.add(y / z, (i / width as usize) as f64);
        }
    }
    let fitted = columns.fit().zip(rows.fit()).filter(|(u, v)| u.slope > 0.0 && v.slope > 0.0);
    let (u, v) = fitted.ok_or("the points show no camera: they are too few, or lie in one row, or face away")?;
    let off = u.residual.hypot(v.residual);
    if off > OFF {
        return Err(format!("the points are not a pinhole camera's picture: {off:.1} pixels off on average"));
    }
    let intrinsics = Intrinsics { width, height, fx: u.slope, fy: v.slope, cx: u.offset, cy: v.offset };
    Ok(FittedPinhole { intrinsics, off })
}

/// Sums of a line fit.
#[derive(Default)]
struct Line {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// A fitted line.
struct Fitted {
    slope: f64,
    offset: f64,
    /// Root mean square.
    residual: f64,
}

impl Line {
    fn add(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
    }

    /// `None` where the points are too few or all `x` are the same.
    fn fit(&self) -> Option<Fitted> {
        let (mean_x, mean_y) = (self.x / self.n, self.y / self.n);
        let (xx, xy) = (self.xx / self.n - mean_x * mean_x, self.xy / self.n - mean_x * mean_y);
        let yy = self.yy / self.n - mean_y * mean_y;
        (self.n >= 3.0 && xx > 1e-12).then(|| {
            let slope = xy / xx;
            Fitted { slope, offset: mean_y - slope * mean_x, residual: (yy - slope * xy).max(0.0).sqrt() }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_picture_is_refused() {
        let plane = |place: fn(usize) -> [f32; 3]| (0..16).map(place).collect::<Vec<_>>();
        let line = plane(|i| [0.1 * i as f32, 0.0, 1.0]);
        for (width, height, points) in
            [(16, 1, line.clone()), (4, 4, line), (4, 4, vec![[f32::NAN; 3]; 16]), (4, 4, vec![[0.0, 0.0, -1.0]; 16])]
        {
            assert!(pinhole(width, height, &points).is_err());
        }
    }
}
