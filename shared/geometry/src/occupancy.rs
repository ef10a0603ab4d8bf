//! Which directions a place on the surface can be seen from: a coarse grid of where surface is, and rays through it. It chooses
//! directions and views; what is seen in a picture is then known exactly from its depths.

/// Cells along the longest edge of the part at most.
const MOST_CELLS: f64 = 192.0;
/// Steps along a ray in cells.
const STEP: f64 = 0.6;
/// Cells that a ray begins away from the surface, along its normal and along the ray: so far the surface itself reaches.
const BEGIN: f64 = 1.8;

/// Cells that hold surface.
#[derive(Clone, Debug)]
pub struct Occupancy {
    low: [f64; 3],
    cell: f64,
    size: [usize; 3],
    cells: Vec<bool>,
}

impl Occupancy {
    /// The grid of a surface with these vertices (metres), which lie about `spacing` metres apart. `None` without vertices.
    pub fn of(points: &[[f32; 3]], spacing: f64) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            low = [0, 1, 2].map(|k| low[k].min(f64::from(p[k])));
            high = [0, 1, 2].map(|k| high[k].max(f64::from(p[k])));
        }
        let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        if !longest.is_finite() || points.is_empty() {
            return None;
        }
        let cell = (2.0 * spacing).max(longest / MOST_CELLS).max(1e-6);
        let size = [0, 1, 2].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut grid = Self { low, cell, size, cells: vec![false; size.iter().product()] };
        for p in points {
            if let Some(at) = grid.index([0, 1, 2].map(|k| (f64::from(p[k]) - low[k]) / cell)) {
                grid.cells[at] = true;
            }
        }
        Some(grid)
    }

    /// Whether a ray from a point of the surface with the unit normal `normal` meets surface on its way in the direction of the
    /// unit vector `toward`, within `reach` metres.
    pub fn is_hidden(&self, point: [f64; 3], normal: [f64; 3], toward: [f64; 3], reach: f64) -> bool {
        let begin = [0, 1, 2].map(|k| (point[k] - self.low[k]) / self.cell + BEGIN * (normal[k] + toward[k]));
        let most = reach / self.cell - BEGIN;
        let mut way = 0.0;
        while way < most {
            match self.index([0, 1, 2].map(|k| begin[k] + way * toward[k])) {
                Some(index) if self.cells[index] => return true,
                Some(_) => way += STEP,
                None => return false,
            }
        }
        false
    }

    /// The place of a point that is given in cells; `None` outside of the grid.
    fn index(&self, at: [f64; 3]) -> Option<usize> {
        let mut index = 0;
        for k in (0..3).rev() {
            if !(at[k] >= 0.0 && at[k] < self.size[k] as f64) {
                return None;
            }
            index = index * self.size[k] + at[k] as usize;
        }
        Some(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roof_hides_from_above_and_not_from_the_side() {
        let mut points = Vec::new();
        for i in 0..50 {
            for j in 0..50 {
                let p = [i as f32 * 2e-3, j as f32 * 2e-3];
                points.push([p[0], p[1], 0.0]);
                if i > 20 {
                    points.push([p[0], p[1], 0.05]);
                }
            }
        }
        let grid = Occupancy::of(&points, 2e-3).expect("points");
        let (up, far) = ([0.0, 0.0, 1.0], f64::INFINITY);
        assert!(grid.is_hidden([0.06, 0.05, 0.0], up, up, far));
        assert!(!grid.is_hidden([0.06, 0.05, 0.0], up, up, 0.04), "the roof lies beyond");
        assert!(!grid.is_hidden([0.02, 0.05, 0.0], up, up, far) && !grid.is_hidden([0.06, 0.05, 0.05], up, up, far));
        let side = [-0.8, 0.0, 0.6];
        assert!(!grid.is_hidden([0.06, 0.05, 0.0], up, side, far));
        assert!(Occupancy::of(&[], 2e-3).is_none());
    }
}
