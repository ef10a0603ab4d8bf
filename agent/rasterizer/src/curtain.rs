//! Which blocks of triangles lie behind what is drawn already: the coarse level of a hierarchical z-buffer [Greene 1993].

use crate::eye::Eye;
use crate::scene::Block;

/// Samples along an edge of a square.
const SQUARE: usize = 16;

/// What is drawn already, coarsely: how far each square of samples reaches at most.
pub(crate) struct Curtain {
    /// Squares in a row.
    columns: usize,
    /// Columns and rows of samples.
    size: (usize, usize),
    /// 1 / depth of the farthest sample of each square.
    farthest: Vec<f32>,
}

impl Curtain {
    pub(crate) fn of(inverse_depths: &[f32], (width, height): (usize, usize)) -> Self {
        let columns = width.div_ceil(SQUARE);
        let mut farthest = vec![f32::INFINITY; columns * height.div_ceil(SQUARE)];
        for (y, row) in inverse_depths.chunks_exact(width.max(1)).enumerate() {
            let squares = &mut farthest[y / SQUARE * columns..][..columns];
            for (square, samples) in squares.iter_mut().zip(row.chunks(SQUARE)) {
                *square = samples.iter().fold(*square, |least, sample| least.min(*sample));
            }
        }
        Self { columns, size: (width, height), farthest }
    }

    /// Whether the block lies behind what is drawn, wherever the picture would show it.
    pub(crate) fn hides(&self, eye: &Eye, block: &Block) -> bool {
        let centre = eye.place(&block.centre);
        let (near, far) = (centre.z - block.radius, centre.z + block.radius);
        if near <= 0.0 {
            return false;
        }
        let squares = |axis: usize, size: usize| {
            let (low, high) = (centre[axis] - block.radius, centre[axis] + block.radius);
            let first = eye.focal[axis] * low / if low < 0.0 { near } else { far } + eye.centre[axis];
            let last = eye.focal[axis] * high / if high > 0.0 { near } else { far } + eye.centre[axis];
            let end = size.saturating_sub(1) as f64;
            first.clamp(0.0, end) as usize / SQUARE..=last.ceil().clamp(0.0, end) as usize / SQUARE
        };
        let nearest = (1.0 / near) as f32;
        squares(1, self.size.1)
            .all(|row| squares(0, self.size.0).all(|column| self.farthest[row * self.columns + column] > nearest))
    }
}
