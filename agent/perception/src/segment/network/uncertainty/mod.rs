//! How sure a prediction is ([Remanufacturing paper], section "Uncertainty estimation for segmentation results", after
//! GUM Supplement 1, [JCGM 101]).
//!
//! M = members x augmentations predictions of a pixel, p_mt,c. The prediction is their mean. The standard uncertainty
//! of class c is `u_c^2 = sum (p_mt,c - mean_c)^2 / (M - ddof)`; it splits exactly into a data part, the scatter of a
//! member over the augmentations, and a model part, the scatter of the members' means: sums of squares within and
//! between, both over the same `M - ddof`. With ddof = 0 these are `E_m[Var_t]` and `Var_m[E_t]`. The paper's sigma of
//! a pixel is taken to be `sqrt(sum_c u_c^2)`; other readings can be chosen. Probabilities are bounded, so the 95 %
//! interval is given by the quantiles of the M values, beside the expanded uncertainty `U = k u`.

use crate::segment::sigma_limits::COMPONENT_SIGMA_LIMIT;
use rayon::prelude::*;
pub use semascan_model::record::{Statistic, UncertaintyFigures};

/// How uncertainty is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertaintySettings {
    /// What sigma is.
    pub statistic: Statistic,
    /// Subtracted from the number of predictions: 1 for the variance of a sample, 0 for that of a population.
    pub ddof: u32,
    /// Coverage factor of the expanded uncertainty.
    pub coverage: f32,
    /// Pixels with a larger sigma are uncertain.
    pub threshold: f32,
}

impl Default for UncertaintySettings {
    fn default() -> Self {
        Self { statistic: Statistic::Norm, ddof: 1, coverage: 2.0, threshold: COMPONENT_SIGMA_LIMIT }
    }
}

/// What the members said of each augmentation, carried back to the pixels of one window.
#[derive(Clone, Debug, Default)]
pub struct Predictions {
    /// Classes.
    pub classes: usize,
    /// Pixels of the window.
    pub pixels: usize,
    /// Members of the ensemble.
    pub members: usize,
    /// Augmentations.
    pub augmentations: usize,
    /// Prediction `member * augmentations + augmentation`: class after class, `classes * pixels` values.
    pub planes: Vec<Vec<f32>>,
    /// For each augmentation which pixels it knows; all if absent.
    pub valid: Vec<Option<Vec<bool>>>,
}

/// The prediction and its uncertainty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean probabilities, class after class, `classes * pixels` values.
    pub mean: Vec<f32>,
    /// Standard uncertainty of each pixel.
    pub sigma: Vec<f32>,
    /// Its data part: `sigma^2 = data^2 + model^2`.
    pub data: Vec<f32>,
    /// Its model part: 0 where there is one member only, which has nobody to disagree with.
    pub model: Vec<f32>,
    /// Members of the ensemble.
    pub members: usize,
    /// The picture in numbers.
    pub figures: UncertaintyFigures,
}

/// Pixels that are worked on together, and summed together: the sums do not depend on the number of threads.
const TOGETHER: usize = 4096;

impl Predictions {
    /// Mean and uncertainty of every pixel. A pixel that fewer than `ddof + 1` predictions know has no scatter: sigma 0.
    pub fn estimate(&self, settings: &UncertaintySettings) -> Estimate {
        let starts: Vec<usize> = (0..self.pixels).step_by(TOGETHER).collect();
        let parts: Vec<Estimate> =
            starts.into_par_iter().map(|start| self.part(start, TOGETHER.min(self.pixels - start), settings)).collect();
        let mean = vec![0.0; self.classes * self.pixels];
        let mut whole = Estimate { mean, members: self.members, ..Estimate::default() };
        let mut start = 0;
        for part in parts {
            let length = part.sigma.len();
            for (c, values) in part.mean.chunks_exact(length.max(1)).enumerate() {
                whole.mean[c * self.pixels + start..][..length].copy_from_slice(values);
            }
            start += length;
            whole.sigma.extend(part.sigma);
            whole.data.extend(part.data);
            whole.model.extend(part.model);
            add(&mut whole.figures, &part.figures);
        }
        divide(&mut whole.figures);
        whole
    }

    /// Pixels `start .. start + length`; the figures are sums.
    fn part(&self, start: usize, length: usize, settings: &UncertaintySettings) -> Estimate {
        let (members, augmentations) = (self.members, self.augmentations);
        let knows = |t: usize, x: usize| self.valid[t].as_ref().is_none_or(|v| v[start + x]);
        // How many augmentations know each pixel; the same for every member.
        let known: Vec<f32> = (0..length).map(|x| (0..augmentations).filter(|&t| knows(t, x)).count() as f32).collect();
        let mut estimate = Estimate { mean: vec![0.0; self.classes * length], ..Estimate::default() };
        // Variances of each class, within the members and between them.
        let (mut within, mut between) = (vec![0.0_f32; self.classes * length], vec![0.0_f32; self.classes * length]);
        let weight: Vec<f32> = known.iter().map(|n| 1.0 / n.max(1.0)).collect();
        let freedom = |n: f32| n * members as f32 - settings.ddof as f32;
        let scale: Vec<f32> = known.iter().map(|&n| if freedom(n) > 0.0 { 1.0 / freedom(n) } else { 0.0 }).collect();
        let mut of_member = vec![0.0_f32; members * length];
        for c in 0..self.classes {
            let values = |m: usize, t: usize| &self.planes[m * augmentations + t][c * self.pixels + start..][..length];
            let class = c * length..(c + 1) * length;
            let mean = &mut estimate.mean[class.clone()];
            for (m, own) in of_member.chunks_exact_mut(length).enumerate() {
                own.fill(0.0);
                for t in 0..augmentations {
                    let known = own.iter_mut().zip(values(m, t));
                    self.known(t, start, known, |(sum, p)| *sum += p);
                }
                own.iter_mut().zip(&weight).for_each(|(sum, w)| *sum *= w);
                mean.iter_mut().zip(&*own).for_each(|(mean, own)| *mean += own / members as f32);
            }
            let (within, between) = (&mut within[class.clone()], &mut between[class]);
            for (m, own) in of_member.chunks_exact(length).enumerate() {
                for t in 0..augmentations {
                    let known = within.iter_mut().zip(own).zip(values(m, t));
                    self.known(t, start, known, |((sum, own), p)| *sum += (p - own) * (p - own));
                }
                let shift = between.iter_mut().zip(own).zip(&*mean).zip(&known);
                shift.for_each(|(((sum, own), mean), n)| *sum += n * (own - mean) * (own - mean));
            }
            for parts in [within, between] {
                parts.iter_mut().zip(&scale).for_each(|(sum, scale)| *sum *= scale);
            }
        }
        let mut sample = Vec::new();
        for x in 0..length {
            let class = |c: usize| estimate.mean[c * length + x];
            let variance = |c: usize| [within[c * length + x], between[c * length + x]];
            let predicted = (1..self.classes).fold(0, |best, c| if class(c) > class(best) { c } else { best });
            let [w, b] = match settings.statistic {
                Statistic::Norm => (0..self.classes).map(variance).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]),
                Statistic::Predicted => variance(predicted),
                Statistic::Largest => {
                    (0..self.classes).map(variance).fold([0.0; 2], |a, b| if b[0] + b[1] > a[0] + a[1] { b } else { a })
                }
            };
            let sigma = (w + b).sqrt();
            estimate.sigma.push(sigma);
            estimate.data.push(w.sqrt());
            estimate.model.push(b.sqrt());
            estimate.figures.pixels += 1;
            if predicted == 0 {
                continue;
            }
            sample.clear();
            let known = (0..augmentations).filter(|&t| knows(t, x));
            let of_members = known.flat_map(|t| (0..members).map(move |m| m * augmentations + t));
            sample.extend(of_members.map(|k| self.planes[k][predicted * self.pixels + start + x]));
            let [low, high] = quantiles(&mut sample, [0.025, 0.975]);
            let figures = &mut estimate.figures;
            figures.foreground += 1;
            figures.uncertain += u64::from(sigma > settings.threshold);
            let expanded = settings.coverage * variance(predicted).iter().sum::<f32>().sqrt();
            let said = [sigma, w.sqrt(), b.sqrt(), expanded, low, high];
            means(figures).into_iter().zip(said).for_each(|(sum, value)| *sum += f64::from(value));
        }
        estimate
    }

    /// Calls `take` for those of a part's pixels that augmentation `t` knows.
    fn known<I>(&self, t: usize, start: usize, pixels: impl Iterator<Item = I>, mut take: impl FnMut(I)) {
        match &self.valid[t] {
            None => pixels.for_each(take),
            Some(valid) => pixels.zip(&valid[start..]).filter(|(_, known)| **known).for_each(|(pixel, _)| take(pixel)),
        }
    }
}

/// The figures that are means over the foreground.
fn means(figures: &mut UncertaintyFigures) -> [&mut f64; 6] {
    let UncertaintyFigures { sigma, data, model, expanded, quantile_low, quantile_high, .. } = figures;
    [sigma, data, model, expanded, quantile_low, quantile_high]
}

/// Adds counts and sums.
fn add(sum: &mut UncertaintyFigures, other: &UncertaintyFigures) {
    sum.pixels += other.pixels;
    sum.foreground += other.foreground;
    sum.uncertain += other.uncertain;
    let mut other = *other;
    means(sum).into_iter().zip(means(&mut other)).for_each(|(sum, value)| *sum += *value);
}

/// Sums become means.
fn divide(figures: &mut UncertaintyFigures) {
    let n = figures.foreground.max(1) as f64;
    means(figures).into_iter().for_each(|sum| *sum /= n);
}

/// Quantiles of a sample, linear between its values; zeros of none.
fn quantiles<const N: usize>(sample: &mut [f32], shares: [f32; N]) -> [f32; N] {
    sample.sort_unstable_by(f32::total_cmp);
    let Some(last) = sample.len().checked_sub(1) else { return [0.0; N] };
    shares.map(|share| {
        let at = share * last as f32;
        let below = at.floor() as usize;
        let (a, b) = (sample[below.min(last)], sample[(below + 1).min(last)]);
        a + (b - a) * (at - below as f32)
    })
}

#[cfg(test)]
mod tests;
