//! Space that the views saw to be empty: space carving by depth ([Curless and Levoy 1996], section 4).
//!
//! A camera measures no depth where its background is far away, and from a depth that is missing nothing follows. But another
//! view that measured the turntable behind a place saw that nothing is there. Where that holds for all of a line of sight within
//! the measuring volume, it ends on background.

use crate::{CapturedView, MeasuringVolume};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use semascan_perception::view::Intrinsics;

/// Most cells of the grid: 16 MB.
const MOST_CELLS: f64 = 16e6;
/// Voxels beyond the measuring volume that have to be seen to be empty, too: the volume is known as well as the poses are.
const MARGIN: f64 = 5.5;
/// Steps along a line of sight, cells.
const STEP: f64 = 0.5;
/// Voxels, and footprints of a pixel, that depth may be wrong by.
const SLACK: (f64, f64) = (1.0, 1.0);

/// A grid of cells over the measuring volume.
#[derive(Clone, Debug)]
pub struct EmptySpace {
    volume: MeasuringVolume,
    /// The box that the cells fill: the volume and a margin.
    grid: MeasuringVolume,
    /// Edge of the voxels of the model, metres.
    voxel: f64,
    /// Edge of a cell, metres.
    cell: f64,
    /// Cells along x, y, z.
    size: [usize; 3],
    /// Whether a view saw that a cell is empty; x runs fastest.
    is_empty: Vec<bool>,
}

impl EmptySpace {
    /// Nothing has been seen yet.
    ///
    /// * `volume`: where the part can be.
    /// * `voxel`: edge of the voxels that the model was made of, metres.
    pub fn new(volume: MeasuringVolume, voxel: f64) -> Self {
        let grid = volume.widened(MARGIN * voxel);
        let extent = grid.greatest - grid.least;
        let cell = voxel.max((extent.x * extent.y * extent.z / MOST_CELLS).cbrt());
        let size: [usize; 3] = std::array::from_fn(|axis| (extent[axis] / cell).ceil().max(1.0) as usize);
        Self { volume, grid, voxel, cell, size, is_empty: vec![false; size.iter().product()] }
    }

    /// Where the part can be.
    pub fn volume(&self) -> &MeasuringVolume {
        &self.volume
    }

    /// Notes the cells that a view looked through.
    pub fn see(&mut self, view: &CapturedView<'_>) {
        let camera_from_table = view.table_from_camera.inverse();
        let [columns, rows, _] = self.size;
        let (least, cell) = (self.grid.least, self.cell);
        // Half the diagonal of a cell, and what its depth in this view may be wrong by.
        let reach = 0.5 * 3.0_f64.sqrt() * cell + SLACK.0 * self.voxel;
        let pose = view.uncertainty.map_or(0.0, |u| u.translation);
        self.is_empty.par_iter_mut().enumerate().filter(|(_, is_empty)| !**is_empty).for_each(|(at, is_empty)| {
            let place = [at % columns, at / columns % rows, at / columns / rows];
            let centre = least + Vector3::from(place.map(|i| (i as f64 + 0.5) * cell));
            let seen = camera_from_table * centre;
            let least = seen.z + reach + pose + SLACK.1 * view.intrinsics.footprint(seen.z);
            *is_empty = least_depth_around(view, &seen).is_some_and(|depth| depth > least);
        });
    }

    /// Whether all that the line of sight of the pixel in column `u` and row `v` passes of the cells was seen to be empty; no, where
    /// it passes none.
    pub(crate) fn is_empty_along(&self, view: &CapturedView<'_>, u: usize, v: usize) -> bool {
        let origin = view.table_from_camera.translation.vector;
        let direction = (view.table_from_camera.rotation * ray(&view.intrinsics, u, v)).normalize();
        let Some((enter, leave)) = self.grid.passage(&origin, &direction) else { return false };
        let step = STEP * self.cell;
        let steps = ((leave - enter) / step).ceil().max(1.0) as usize;
        (0..=steps).all(|k| {
            let at = origin + direction * (enter + k as f64 * step).min(leave);
            self.cell_at(&Point3::from(at)).is_none_or(|cell| self.is_empty[cell])
        })
    }

    fn cell_at(&self, point: &Point3<f64>) -> Option<usize> {
        let place = (point - self.grid.least).map(|c| (c / self.cell).floor());
        let [x, y, z]: [Option<usize>; 3] = std::array::from_fn(|axis| {
            (place[axis] >= 0.0 && place[axis] < self.size[axis] as f64).then_some(place[axis] as usize)
        });
        Some(x? + self.size[0] * (y? + self.size[1] * z?))
    }
}

/// The line of sight of a pixel, in the camera frame.
fn ray(intrinsics: &Intrinsics, u: usize, v: usize) -> Vector3<f64> {
    intrinsics.unproject(u as f64, v as f64, 1.0).coords
}

/// The least depth of the pixel that shows a point in the camera frame and of those around it; `None` where one of them was not
/// measured: at a rim, depth is worth little.
fn least_depth_around(view: &CapturedView<'_>, point: &Point3<f64>) -> Option<f64> {
    let at = view.intrinsics.project(point).and_then(|(u, v)| view.intrinsics.pixel(u, v))?;
    let (width, height) = (view.intrinsics.width as usize, view.intrinsics.height as usize);
    let (u, v) = (at % width, at / width);
    let mut least = f64::INFINITY;
    for y in v.checked_sub(1)?..v + 2 {
        for x in u.checked_sub(1)?..u + 2 {
            let depth = (x < width && y < height).then(|| f64::from(view.depth[y * width + x]))?;
            if !(depth > 0.0 && depth.is_finite()) {
                return None;
            }
            least = least.min(depth);
        }
    }
    Some(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use nalgebra::Isometry3;

    const CAMERA: Intrinsics = Intrinsics { width: 120, height: 90, fx: 100.0, fy: 100.0, cx: 60.0, cy: 45.0 };

    /// Half a metre from the middle of the volume, on that side.
    fn from(side: Vector3<f64>) -> Isometry3<f64> {
        Isometry3::face_towards(&Point3::from(side * 0.5), &Point3::origin(), &Vector3::new(0.3, -1.0, 0.2))
    }

    fn space() -> EmptySpace {
        let corner = Point3::new(0.05, 0.05, 0.05);
        EmptySpace::new(MeasuringVolume { least: (-corner.coords).into(), greatest: corner }, 2e-3)
    }

    #[test]
    fn what_another_view_looked_through_is_empty_and_what_hid_something_is_not() {
        let rgb = RgbImage::new(CAMERA.width, CAMERA.height);
        let pixels = (CAMERA.width * CAMERA.height) as usize;
        let (near, far, nothing) = (vec![0.4_f32; pixels], vec![0.8_f32; pixels], vec![0.0_f32; pixels]);
        let view = |depth, side| CapturedView {
            rgb: &rgb,
            depth,
            intrinsics: CAMERA,
            table_from_camera: from(side),
            uncertainty: None,
            space: None,
        };
        let blind = view(&nothing, Vector3::x());
        let is_empty = |space: &EmptySpace| space.is_empty_along(&blind, 60, 45);
        let mut seen = space();
        assert!(!is_empty(&seen), "nobody looked");
        assert!(!seen.is_empty_along(&blind, 2, 45), "it passes by: that says the volume");
        seen.see(&blind);
        assert!(!is_empty(&seen), "what has no depth says nothing");
        seen.see(&view(&near, Vector3::z()));
        assert!(!is_empty(&seen), "something stands before it");
        seen.see(&view(&far, Vector3::z()));
        assert!(is_empty(&seen));
        // One pixel of the other view sees something in the way.
        let mut dotted = far.clone();
        dotted[45 * 120 + 60] = 0.5;
        let mut seen = space();
        seen.see(&view(&dotted, Vector3::z()));
        assert!(!is_empty(&seen));
    }

    #[test]
    fn a_large_volume_has_coarser_cells() {
        let volume = MeasuringVolume { least: Point3::origin(), greatest: Point3::new(2.0, 2.0, 1.0) };
        let space = EmptySpace::new(volume, 1e-3);
        let least = space.grid.least;
        assert!(space.cell > 6e-3 && space.is_empty.len() < 17_000_000, "{} {}", space.cell, space.is_empty.len());
        assert_eq!(space.cell_at(&(least - Vector3::x() * 1e-6)), None);
        assert_eq!(space.cell_at(&(least + Vector3::repeat(1e-6))), Some(0));
    }
}
