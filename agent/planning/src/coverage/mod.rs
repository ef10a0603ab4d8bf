//! What the views until now have measured, seen through and left unknown: a grid of cells over the measuring volume, made of
//! the depth pictures that the map keeps, at their registered poses.
//!
//! A cell with measured points is surface. One that a ray passed on its way to a measured point is free. A ray without a
//! measurement says little: it may have met nothing, or a surface that is too dark. Where nothing was measured all around it, it
//! makes surface in the cells along it less likely ([`NO_RETURN`]), and a few such rays make them free for planning; a measurement
//! always counts more. What is left is unknown, and its border to what is free is the frontier.

mod surface;
mod ways;

use crate::reach::Reach;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use semascan_model::{PointFlags, SemanticCloud};
use semascan_perception::fuse::{FuseError, KeptDepth, SemanticMap};
use semascan_perception::view::Intrinsics;

/// Cells along the longest edge of the volume at most.
const MOST_CELLS: f64 = 96.0;
/// Edge of a cell in pixels at the largest distance: so that a seen surface leaves no gaps.
const PIXELS_A_CELL: f64 = 2.0;
/// How much less likely surface becomes by a ray without a measurement: the share of surfaces that give none.
const NO_RETURN: f32 = 0.3;
/// Odds of surface in an unknown cell below which it counts as free.
const AS_GOOD_AS_FREE: f32 = 0.15;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    Unknown,
    Free,
    Surface,
}

/// A cell of the grid. Lengths in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub(crate) state: State,
    /// Odds of surface where the cell is unknown, of 1 at first.
    pub(crate) odds: f32,
    /// Sum of the normals of the points in it.
    pub(crate) normal: [f32; 3],
    /// Largest cosine of incidence under which a view has seen it.
    pub(crate) cosine: f32,
    /// Views that have measured points in it, less those that have looked through it.
    pub(crate) views: i16,
    /// How uncertain the labels of its points are, 0 to 1.
    pub(crate) uncertainty: f32,
}

const UNKNOWN: Cell =
    Cell { state: State::Unknown, odds: 1.0, normal: [0.0; 3], cosine: 0.0, views: 0, uncertainty: 0.0 };

/// Coverage of the measuring volume by views.
#[derive(Clone, Debug)]
pub struct Coverage {
    pub(crate) low: Point3<f64>,
    pub(crate) size: [usize; 3],
    pub(crate) edge: f64,
    pub(crate) cells: Vec<Cell>,
    /// Views of the map that are in it.
    views: usize,
}

/// A cell's outer side, for cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patch {
    /// Metres, table frame.
    pub(crate) centre: [f32; 3],
    /// Unit normal; zero where the surface is too thin to have one.
    pub(crate) normal: [f32; 3],
    /// Index of its cell.
    pub(crate) cell: u32,
    /// Likelihood of surface there: below 1 where it is not known.
    pub(crate) likelihood: f32,
    /// Largest cosine of incidence until now; 0 where it is not known.
    pub(crate) cosine: f32,
    /// How uncertain its labels are, 0 to 1.
    pub(crate) uncertainty: f32,
    /// Views that have seen it.
    pub(crate) views: f32,
}

impl Patch {
    pub(crate) fn is_frontier(&self) -> bool {
        self.views == 0.0
    }
}

impl Coverage {
    /// Nothing is known of the volume between two corners (metres, table frame) that `camera` will look at.
    pub fn new((low, high): (Point3<f64>, Point3<f64>), camera: &Intrinsics, reach: &Reach) -> Self {
        let longest = (high - low).max();
        let edge = (longest / MOST_CELLS).max(PIXELS_A_CELL * camera.footprint(reach.distance.1));
        let size = [0, 1, 2].map(|k| ((high[k] - low[k]) / edge).ceil().max(1.0) as usize);
        Self { low, size, edge, cells: vec![UNKNOWN; size.iter().product()], views: 0 }
    }

    /// Takes in the views of `map` that are new, and what is known of its labels.
    ///
    /// # Errors
    /// [`FuseError`] if a kept view cannot be read back.
    pub fn follow(&mut self, map: &SemanticMap) -> Result<(), FuseError> {
        let kept = map.kept_views();
        for i in self.views..kept.len() {
            self.integrate(&kept.depth(i)?);
            self.views = i + 1;
        }
        self.note_labels(&map.cloud());
        Ok(())
    }

    /// Takes in one view.
    pub fn integrate(&mut self, view: &KeptDepth<'_>) {
        let seen = surface::measured(self, view);
        let ways = ways::Ways::of(view, self.edge);
        let (low, size, edge) = (self.low, self.size, self.edge);
        self.cells.par_iter_mut().enumerate().for_each(|(i, cell)| {
            let centre = centre_of(low, size, edge, i);
            ways.follow(cell, &centre);
        });
        for (i, seen) in seen {
            let cell = &mut self.cells[i as usize];
            cell.state = State::Surface;
            cell.views += 1;
            cell.cosine = cell.cosine.max(seen.cosine);
            (0..3).for_each(|k| cell.normal[k] += seen.normal[k]);
        }
    }

    /// How uncertain the labels of the points of each cell are: what their best class lacks of all evidence, or their
    /// standard uncertainty. Cells without a labelled point have none: absence is no uncertainty, it may be background.
    fn note_labels(&mut self, cloud: &SemanticCloud) {
        let mut sums = vec![(0.0_f32, 0_u32); self.cells.len()];
        let left_out = PointFlags::OUTLIER | PointFlags::BACKGROUND;
        for i in (0..cloud.len()).filter(|&i| !cloud.flags[i].has(left_out) && cloud.confidence[i] > 0.0) {
            let Some(cell) = self.index(&Point3::from(cloud.positions[i].map(f64::from))) else { continue };
            sums[cell].0 += (1.0 - cloud.confidence[i]).max(cloud.sigma[i]);
            sums[cell].1 += 1;
        }
        for (cell, (sum, count)) in self.cells.iter_mut().zip(sums) {
            cell.uncertainty = if count > 0 { sum / count as f32 } else { 0.0 };
        }
    }

    /// Area of a cell's side, square metres.
    pub fn cell_area(&self) -> f64 {
        self.edge * self.edge
    }

    /// The cell of a point (table frame); `None` outside of the volume.
    pub(crate) fn index(&self, p: &Point3<f64>) -> Option<usize> {
        let mut index = 0;
        for k in (0..3).rev() {
            let at = (p[k] - self.low[k]) / self.edge;
            if !(at >= 0.0 && at < self.size[k] as f64) {
                return None;
            }
            index = index * self.size[k] + at as usize;
        }
        Some(index)
    }

    /// Cells of surface, and unknown cells beside free ones.
    pub(crate) fn patches(&self) -> Vec<Patch> {
        (0..self.cells.len()).into_par_iter().filter_map(|i| self.patch(i)).collect()
    }

    fn patch(&self, i: usize) -> Option<Patch> {
        let cell = &self.cells[i];
        let (state, likelihood) = self.state(i);
        if state == State::Free {
            return None;
        }
        let at = [i % self.size[0], i / self.size[0] % self.size[1], i / self.size[0] / self.size[1]];
        // Towards what is free, by all neighbours.
        let (mut outward, mut beside_free) = (Vector3::zeros(), false);
        for z in -1..=1_i32 {
            for y in -1..=1_i32 {
                for x in -1..=1_i32 {
                    let step = [x, y, z];
                    let distance = step.iter().map(|s| s.abs()).sum::<i32>();
                    if distance > 0 && self.is_free_beside(at, step) {
                        beside_free |= distance == 1;
                        outward += Vector3::new(x as f32, y as f32, z as f32) / (distance as f32).sqrt();
                    }
                }
            }
        }
        let known = Vector3::from(cell.normal);
        let normal = if state == State::Surface { known } else { outward };
        if state == State::Unknown && !beside_free {
            return None;
        }
        Some(Patch {
            centre: centre_of(self.low, self.size, self.edge, i).cast::<f32>().into(),
            normal: normal.try_normalize(1e-6).unwrap_or_default().into(),
            cell: i as u32,
            likelihood,
            cosine: cell.cosine,
            uncertainty: cell.uncertainty,
            views: if state == State::Surface { f32::from(cell.views.max(1)) } else { 0.0 },
        })
    }

    /// What a cell counts as, and how likely it is surface.
    fn state(&self, i: usize) -> (State, f32) {
        let cell = &self.cells[i];
        match cell.state {
            State::Surface => (State::Surface, 1.0),
            State::Unknown if cell.odds > AS_GOOD_AS_FREE => (State::Unknown, cell.odds / (1.0 + cell.odds)),
            State::Unknown | State::Free => (State::Free, 0.0),
        }
    }

    /// Whether the cell `step` from the one `at` is free. So is what lies beside and above the volume, where cameras go; what
    /// lies below is what the part stands on.
    fn is_free_beside(&self, at: [usize; 3], step: [i32; 3]) -> bool {
        let mut index = 0;
        for k in (0..3).rev() {
            let next = at[k] as i32 + step[k];
            if !(0..self.size[k] as i32).contains(&next) {
                return !(k == 2 && next < 0);
            }
            index = index * self.size[k] + next as usize;
        }
        self.state(index).0 == State::Free
    }
}

fn centre_of(low: Point3<f64>, size: [usize; 3], edge: f64, i: usize) -> Point3<f64> {
    let at = [i % size[0], i / size[0] % size[1], i / size[0] / size[1]];
    low + Vector3::from(at.map(|c| (c as f64 + 0.5) * edge))
}
