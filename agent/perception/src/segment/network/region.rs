//! The region of interest: the part of the picture in which the part can be.
//!
//! The measuring volume, seen from the pose that the robot reports, is a box in the picture, and the pixels in it whose
//! depth lies in the volume are the part. Networks look at the rectangle around these and a margin, a third of the
//! picture. Where the volume or the pose is unknown, a glance at the whole picture says where the part is (`glance`).

use crate::view::{Intrinsics, View};
use nalgebra::{Isometry3, Point3};

/// A rectangle of pixels, within the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Where the measuring volume is in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// The volume or the pose is unknown, or the camera is in the volume.
    Unknown,
    /// Out of sight.
    None,
    /// In this window.
    In(Window),
}

/// Corners of the measuring volume in the table frame.
pub type Volume = (Point3<f64>, Point3<f64>);

/// Nearest that a corner of the volume may be before the camera, metres: nearer ones are seen everywhere and nowhere.
const NEAREST: f64 = 0.02;
/// Pixels in the volume from which their rectangle is trusted; with fewer, depth has failed.
const ENOUGH: usize = 64;

impl Window {
    /// The whole picture.
    pub fn whole(width: u32, height: u32) -> Self {
        Self { left: 0, top: 0, width, height }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether the pixel in column `u` and row `v` is in it.
    pub fn contains(&self, u: u32, v: u32) -> bool {
        (self.left..self.left + self.width).contains(&u) && (self.top..self.top + self.height).contains(&v)
    }

    /// The window that what is in `volume` takes in `view`, `margin` pixels wider on each side and clipped to the picture;
    /// the volume's own where there is no depth.
    pub fn of_volume(view: &View, volume: Option<&Volume>, margin: u32) -> Sight {
        let k = &view.intrinsics;
        let Some((low, high)) = volume else { return Sight::Unknown };
        let Some(table_from_camera) = view.pose.table_from_camera() else { return Sight::Unknown };
        let Some([left, top, right, bottom]) = bounds(k, &table_from_camera, low, high) else { return Sight::Unknown };
        let clip = |c: f64, end: u32| c.clamp(0.0, f64::from(end)) as u32;
        let (left, right) = (clip(left.floor(), k.width), clip(right.ceil() + 1.0, k.width));
        let (top, bottom) = (clip(top.floor(), k.height), clip(bottom.ceil() + 1.0, k.height));
        let volume_seen = Self { left, top, width: right.saturating_sub(left), height: bottom.saturating_sub(top) };
        let part = volume_seen.measured(view, &table_from_camera, low, high).unwrap_or(volume_seen);
        if part.pixels() > 0 { Sight::In(part.widened(margin, (k.width, k.height))) } else { Sight::None }
    }

    /// The window in a picture that was shrunk by `factor`: the pixels that hold any of it.
    pub(super) fn shrunk(&self, factor: u32) -> Self {
        let (left, top) = (self.left / factor, self.top / factor);
        let right = (self.left + self.width).div_ceil(factor);
        let bottom = (self.top + self.height).div_ceil(factor);
        Self { left, top, width: right - left, height: bottom - top }
    }

    /// The window of a picture that was shrunk by `factor` in the `picture` (columns, rows) itself.
    pub(super) fn enlarged(&self, factor: u32, picture: (u32, u32)) -> Self {
        let (left, top) = (self.left * factor, self.top * factor);
        let right = ((self.left + self.width) * factor).min(picture.0);
        let bottom = ((self.top + self.height) * factor).min(picture.1);
        Self { left, top, width: right - left, height: bottom - top }
    }

    /// The rectangle around the pixels whose depth lies in the volume; `None` if these are few.
    fn measured(
        &self,
        view: &View,
        table_from_camera: &Isometry3<f64>,
        low: &Point3<f64>,
        high: &Point3<f64>,
    ) -> Option<Self> {
        let (mut count, mut columns, mut rows) = (0, (u32::MAX, 0), (u32::MAX, 0));
        for v in self.top..self.top + self.height {
            for u in self.left..self.left + self.width {
                let Some(z) = view.depth.at(u, v) else { continue };
                let p = table_from_camera * view.intrinsics.unproject(f64::from(u), f64::from(v), f64::from(z));
                if (0..3).all(|axis| p[axis] >= low[axis] && p[axis] <= high[axis]) {
                    count += 1;
                    columns = (columns.0.min(u), columns.1.max(u));
                    rows = (rows.0.min(v), rows.1.max(v));
                }
            }
        }
        (count >= ENOUGH).then(|| Self {
            left: columns.0,
            top: rows.0,
            width: columns.1 + 1 - columns.0,
            height: rows.1 + 1 - rows.0,
        })
    }

    /// The window, `margin` pixels wider on each side where the picture allows it.
    pub(super) fn widened(&self, margin: u32, picture: (u32, u32)) -> Self {
        let (left, top) = (self.left.saturating_sub(margin), self.top.saturating_sub(margin));
        let right = (self.left + self.width).saturating_add(margin).min(picture.0);
        let bottom = (self.top + self.height).saturating_add(margin).min(picture.1);
        Self { left, top, width: right - left, height: bottom - top }
    }

    /// The window made larger to at least `width` by `height` where the picture allows it: pixels that are there are
    /// better company at the border than repeated ones.
    pub fn grown(&self, width: u32, height: u32, picture: (u32, u32)) -> Self {
        let grow = |start: u32, length: u32, wanted: u32, end: u32| {
            let wanted = wanted.max(length).min(end);
            let start = start.saturating_sub((wanted - length) / 2).min(end - wanted);
            (start, wanted)
        };
        let (left, width) = grow(self.left, self.width, width, picture.0);
        let (top, height) = grow(self.top, self.height, height, picture.1);
        Self { left, top, width, height }
    }
}

/// Left, top, right and bottom of a box in the picture; `None` if a corner is behind or beside the camera.
fn bounds(
    k: &Intrinsics,
    table_from_camera: &Isometry3<f64>,
    low: &Point3<f64>,
    high: &Point3<f64>,
) -> Option<[f64; 4]> {
    let camera_from_table = table_from_camera.inverse();
    let mut box_ = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let p = camera_from_table * Point3::new(pick(0), pick(1), pick(2));
        let (u, v) = if p.z > NEAREST { k.project(&p)? } else { return None };
        if !(u.is_finite() && v.is_finite()) {
            return None;
        }
        box_ = [box_[0].min(u), box_[1].min(v), box_[2].max(u), box_[3].max(v)];
    }
    Some(box_)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_grows_within_the_picture_only() {
        let window = Window { left: 600, top: 10, width: 30, height: 20 };
        assert_eq!(window.grown(64, 32, (640, 480)), Window { left: 576, top: 4, width: 64, height: 32 });
        assert_eq!(window.grown(8, 512, (640, 480)), Window { left: 600, top: 0, width: 30, height: 480 });
    }

    #[test]
    fn a_shrunk_window_holds_all_of_it() {
        let window = Window { left: 7, top: 9, width: 5, height: 3 };
        let coarse = window.shrunk(3);
        assert_eq!(coarse, Window { left: 2, top: 3, width: 2, height: 1 });
        assert_eq!(coarse.enlarged(3, (11, 100)), Window { left: 6, top: 9, width: 5, height: 3 });
    }
}
