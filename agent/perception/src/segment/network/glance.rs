//! A first look at a whole picture, where neither volume nor pose says where the part is: one network is asked once, at
//! half the scale of its training. What it takes for anything but none, and a margin around it, is then looked at by the
//! whole ensemble.

use super::engine::{EngineError, Tensor};
use super::model::NetworkModel;
use super::preprocess::Frame;
use super::region::Window;
use super::scale::{factor, shrunk};
use crate::view::View;

/// Pixels of the training's scale along an edge of a pixel of the glance.
const COARSER: u32 = 2;
/// Least probability of a class other than none.
const LEAST: f32 = 0.1;
/// Least such probability somewhere in a region: a table and its shadows may look like something, but not as
/// surely as a part.
const SURE: f32 = 0.95;
/// Pixels of the training's scale around what is seen, besides the usual margin: a part's dark end is easily missed.
const MARGIN: u32 = 16;
/// Fewest pixels among a pixel's neighbours and itself, nine in all, that agree with it.
const AGREEING: usize = 5;

/// What the glance saw.
#[derive(Clone, Debug)]
pub(super) struct Glance {
    /// Where to look, in the picture's pixels.
    pub(super) window: Window,
    /// Columns and rows of the shrunk picture.
    size: (u32, u32),
    /// What the picture was shrunk by.
    factor: u32,
    classes: usize,
    /// Class after class.
    probabilities: Vec<f32>,
}

/// Looks at `view` with the first network of `model`; `None` if nothing is seen or the network's scale is unknown: all of
/// the picture has to be looked at then. `margin` is in pixels of the training's scale.
///
/// # Errors
/// [`EngineError`] if the network does not run.
pub(super) fn glance(model: &mut NetworkModel, view: &View, margin: u32) -> Result<Option<Glance>, EngineError> {
    let input = &model.manifest().input;
    let picture = (view.intrinsics.width, view.intrinsics.height);
    let whole = Window::whole(picture.0, picture.1);
    // A detector, and a network of fixed size, takes as long for a glance as for a look.
    if input.footprint.is_none() || input.width.is_some() || model.manifest().output.boxes.is_some() {
        return Ok(None);
    }
    let fine = factor(view, whole, input);
    let factor = fine * COARSER;
    let coarse = shrunk(view, factor);
    let size = (coarse.intrinsics.width, coarse.intrinsics.height);
    let frame = Frame::new(Window::whole(size.0, size.1), size, input);
    let shape = vec![1, input.channels.len(), frame.size.1, frame.size.0];
    let answer = model.ask_first(&Tensor { shape, data: frame.tensor(&coarse, input) })?;
    let probabilities = frame.restore(answer.probabilities.data);
    let classes = model.manifest().classes.len();
    let Some(seen) = extent(&probabilities, (size.0 as usize, size.1 as usize)) else { return Ok(None) };
    let window = seen.widened(1, size).enlarged(factor, picture).widened((MARGIN + margin) * fine, picture);
    Ok(Some(Glance { window, size, factor, classes, probabilities }))
}

impl Glance {
    /// Class probabilities, and the sigma of a draw from them, of the pixel that holds pixel (u, v) of the picture when that
    /// is shrunk by `factor`: of one answer no scatter is known.
    pub(super) fn at(&self, u: u32, v: u32, factor: u32) -> (impl Iterator<Item = f32> + '_, f32) {
        let coarse = |c: u32, end: u32| (c * factor / self.factor).min(end - 1);
        let at = (coarse(v, self.size.1) * self.size.0 + coarse(u, self.size.0)) as usize;
        let pixels = self.size.0 as usize * self.size.1 as usize;
        let probabilities = (0..self.classes).map(move |c| self.probabilities[c * pixels + at]);
        let variance: f32 = probabilities.clone().map(|p| p * (1.0 - p)).sum();
        (probabilities, variance.max(0.0).sqrt())
    }
}

/// The rectangle around the regions that may be something, where the network is sure of some pixel of each; the first plane
/// of `probabilities` is that of none. Single pixels are left out.
fn extent(probabilities: &[f32], (width, height): (usize, usize)) -> Option<Window> {
    let something = |i: usize| 1.0 - probabilities[i] > LEAST;
    let around = |i: usize| {
        let (u, v) = (i % width, i / width);
        (v.saturating_sub(1)..(v + 2).min(height))
            .flat_map(move |y| (u.saturating_sub(1)..(u + 2).min(width)).map(move |x| y * width + x))
    };
    let counts = |i: usize| something(i) && around(i).filter(|&n| something(n)).count() >= AGREEING;
    // From the pixels that are surely something to all that hang together with them.
    let mut open: Vec<usize> = (0..width * height).filter(|&i| 1.0 - probabilities[i] > SURE && counts(i)).collect();
    let mut seen = vec![false; width * height];
    open.iter().for_each(|&i| seen[i] = true);
    let (mut columns, mut rows) = ((usize::MAX, 0), (usize::MAX, 0));
    while let Some(i) = open.pop() {
        let (u, v) = (i % width, i / width);
        columns = (columns.0.min(u), columns.1.max(u));
        rows = (rows.0.min(v), rows.1.max(v));
        for next in around(i).filter(|&n| counts(n)) {
            if !seen[next] {
                seen[next] = true;
                open.push(next);
            }
        }
    }
    (columns.0 <= columns.1).then(|| Window {
        left: columns.0 as u32,
        top: rows.0 as u32,
        width: (columns.1 + 1 - columns.0) as u32,
        height: (rows.1 + 1 - rows.0) as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_pixels_and_doubtful_regions_do_not_widen_the_window() {
        let (width, height) = (12, 10);
        let mut none = vec![1.0; width * height];
        for v in 3..7 {
            for u in 4..9 {
                none[v * width + u] = 0.03;
            }
        }
        none[11] = 0.0;
        // A doubtful region counts only where it touches a sure one.
        for u in 0..3 {
            (0..10).for_each(|v| none[v * width + u] = 0.7);
        }
        // Corners of the rectangle have three neighbours only.
        let seen = extent(&none, (width, height)).expect("seen");
        assert_eq!(seen, Window { left: 4, top: 3, width: 5, height: 4 });
        none[3 * width + 3] = 0.8;
        none[4 * width + 3] = 0.8;
        none[5 * width + 3] = 0.8;
        assert_eq!(extent(&none, (width, height)).map(|seen| (seen.left, seen.width)), Some((0, 9)));
        assert_eq!(extent(&[1.0; 120], (width, height)), None);
    }
}
