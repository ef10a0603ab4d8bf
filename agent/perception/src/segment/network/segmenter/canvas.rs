//! A class field in the making: what networks say of a window, and what is known elsewhere.

use crate::segment::class_field::{ClassField, UNKNOWN_PART};
use crate::segment::network::glance::Glance;
use crate::segment::network::region::Window;
use crate::segment::network::uncertainty::{Estimate, UncertaintyFigures};
use rayon::prelude::*;

/// A class field in the making: none with certainty, until networks have looked.
pub(super) struct Canvas {
    columns: usize,
    classes: usize,
    probabilities: Vec<u8>,
    sigma: Vec<u8>,
    model_sigma: Vec<u8>,
}

/// A row of the picture.
struct Row<'a> {
    probabilities: &'a mut [u8],
    sigma: &'a mut [u8],
    model_sigma: &'a mut [u8],
}

impl Canvas {
    /// None with certainty.
    pub(super) fn new(picture: (u32, u32), classes: usize) -> Self {
        let pixels = picture.0 as usize * picture.1 as usize;
        let mut probabilities = vec![0; pixels * classes];
        probabilities.iter_mut().step_by(classes.max(1)).for_each(|none| *none = u8::MAX);
        Self {
            columns: picture.0 as usize,
            classes,
            probabilities,
            sigma: vec![0; pixels],
            model_sigma: vec![0; pixels],
        }
    }

    /// Where nobody looked: no evidence for anything, not even for soundness.
    pub(super) fn unknown(picture: (u32, u32), classes: usize) -> Self {
        let pixels = picture.0 as usize * picture.1 as usize;
        let (probabilities, sigma) = (vec![0; pixels * classes], vec![u8::MAX; pixels]);
        let model_sigma = vec![UNKNOWN_PART; pixels];
        Self { columns: picture.0 as usize, classes, probabilities, sigma, model_sigma }
    }

    /// Puts an estimate into its window; class `c` of the estimate is class `numbers[c]` of the field.
    pub(super) fn paint(&mut self, window: Window, estimate: &Estimate, numbers: &[u16]) {
        let (pixels, width) = (window.pixels(), window.width as usize);
        let (left, classes) = (window.left as usize, self.classes);
        // One network alone does not say how far others would disagree.
        let has_parts = estimate.members > 1;
        let rows = self.rows().skip(window.top as usize).take(window.height as usize);
        rows.enumerate().for_each(|(row, Row { probabilities, sigma, model_sigma })| {
            let fields = probabilities[left * classes..].chunks_exact_mut(classes.max(1));
            let uncertainties = sigma[left..left + width].iter_mut().zip(&mut model_sigma[left..left + width]);
            for (column, (field, (sigma, model_sigma))) in fields.zip(uncertainties).enumerate() {
                let i = row * width + column;
                *sigma = byte(estimate.sigma[i]);
                *model_sigma = if has_parts { byte(estimate.model[i]).min(UNKNOWN_PART - 1) } else { UNKNOWN_PART };
                field.fill(0);
                for (c, &number) in numbers.iter().enumerate() {
                    field[usize::from(number)] = byte(estimate.mean[c * pixels + i]);
                }
            }
        });
    }

    /// Puts what a glance saw of the picture, which was shrunk by `factor`, everywhere. What it takes for a part is believed
    /// only where the ensemble looks, too: a table and its shadows look like something to a single network. Elsewhere that
    /// is no evidence of anything.
    pub(super) fn sketch(&mut self, glance: &Glance, factor: u32, numbers: &[u16]) {
        let classes = self.classes.max(1);
        self.rows().enumerate().for_each(|(row, Row { probabilities, sigma, model_sigma })| {
            // One network looked: how far others would have disagreed is not known.
            model_sigma.fill(UNKNOWN_PART);
            let fields = probabilities.chunks_exact_mut(classes);
            for (column, (field, sigma)) in fields.zip(sigma).enumerate() {
                let (probabilities, deviation) = glance.at(column as u32, row as u32, factor);
                field.fill(0);
                for (&number, p) in numbers.iter().zip(probabilities) {
                    field[usize::from(number)] = byte(p);
                }
                let is_none = field.iter().all(|p| *p <= field[0]);
                *sigma = if is_none { byte(deviation) } else { u8::MAX };
                if !is_none {
                    field.fill(0);
                }
            }
        });
    }

    /// The rows of the picture.
    fn rows(&mut self) -> impl IndexedParallelIterator<Item = Row<'_>> {
        let columns = self.columns.max(1);
        let probabilities = self.probabilities.par_chunks_exact_mut(columns * self.classes.max(1));
        let sigma = self.sigma.par_chunks_exact_mut(columns);
        let rows = probabilities.zip(sigma).zip(self.model_sigma.par_chunks_exact_mut(columns));
        rows.map(|((probabilities, sigma), model_sigma)| Row { probabilities, sigma, model_sigma })
    }

    /// Makes every label of a window as uncertain as can be: what stands there is no evidence. The probabilities stay, so that
    /// people can see what was said.
    pub(super) fn doubt(&mut self, window: Window, figures: &mut UncertaintyFigures) {
        let (left, width) = (window.left as usize, window.width as usize);
        for row in window.top as usize..(window.top + window.height) as usize {
            self.sigma[row * self.columns + left..][..width].fill(u8::MAX);
            self.model_sigma[row * self.columns + left..][..width].fill(UNKNOWN_PART);
        }
        figures.sigma = 1.0;
        figures.uncertain = figures.foreground;
    }

    /// The field as it is.
    pub(super) fn field(self) -> ClassField {
        let Self { columns: _, classes, probabilities, sigma, model_sigma } = self;
        ClassField::Soft { classes, probabilities, sigma, model_sigma }
    }
}

/// A share in eight bits, 255 = 1.
pub(super) fn byte(share: f32) -> u8 {
    // Half a step more: the conversion cuts off.
    (share.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}
