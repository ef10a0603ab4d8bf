//! The scale that a network sees a picture at: that of its training.
//!
//! A network knows parts by pixels of a certain size on them, its footprint. A camera of more pixels shows a part larger
//! than any that it was trained on, at a cost that grows with the pixels. Such a picture is shrunk by a whole number, and
//! what networks say of it is carried back to the picture's own pixels.

use super::config::ViewDetail;
use super::manifest::Input;
use super::region::Window;
use crate::segment::class_field::ClassField;
use crate::segment::segmentation::Segmentation;
use crate::view::{DepthImage, View};
use image::RgbImage;
use rayon::prelude::*;
use std::sync::Arc;

/// Largest factor; beyond it a picture is taken as it is rather than made a thumbnail.
const LARGEST: f64 = 16.0;
/// Pixels of a window that its distance is estimated from.
const SAMPLES: usize = 4096;

/// By how much `view` is shrunk for a network that takes `input`: 1 where its pixels are not finer on what `window` shows
/// than those of the training, or where either is unknown.
pub(super) fn factor(view: &View, window: Window, input: &Input) -> u32 {
    let Some([finest, coarsest]) = input.footprint else { return 1 };
    let step = ((window.pixels() / SAMPLES) as f64).sqrt().max(1.0) as usize;
    let mut depths: Vec<f32> = (window.top..window.top + window.height)
        .step_by(step)
        .flat_map(|v| (window.left..window.left + window.width).step_by(step).map(move |u| (u, v)))
        .filter_map(|(u, v)| view.depth.at(u, v))
        .collect();
    let middle = depths.len() / 2;
    if depths.is_empty() {
        return 1;
    }
    let (_, depth, _) = depths.select_nth_unstable_by(middle, f32::total_cmp);
    let footprint = view.intrinsics.footprint(f64::from(*depth));
    if footprint >= finest {
        return 1;
    }
    ((finest * coarsest).sqrt() / footprint).round().clamp(1.0, LARGEST) as u32
}

/// `view` with pixels `factor` times as wide: colours averaged; of depths one that was measured, for between two surfaces
/// there is none. Without labels and truth.
pub(super) fn shrunk(view: &View, factor: u32) -> View {
    let intrinsics = view.intrinsics.scaled(1.0 / f64::from(factor));
    let (width, height) = (intrinsics.width, intrinsics.height);
    let (full_width, full_height) = (view.intrinsics.width, view.intrinsics.height);
    let pixels = |u: u32, v: u32| {
        let rows = v * factor..((v + 1) * factor).min(full_height);
        rows.flat_map(move |y| (u * factor..((u + 1) * factor).min(full_width)).map(move |x| (x, y)))
    };
    let rgb = RgbImage::from_par_fn(width, height, |u, v| {
        let (mut sum, mut count) = ([0_u32; 3], 0);
        for (x, y) in pixels(u, v) {
            let color = view.rgb.get_pixel(x, y).0;
            (0..3).for_each(|c| sum[c] += u32::from(color[c]));
            count += 1;
        }
        image::Rgb(sum.map(|s| ((s + count / 2) / count.max(1)) as u8))
    });
    let depth_at = |i: usize| {
        let (u, v) = (i as u32 % width, i as u32 / width);
        let mut measured: Vec<f32> = pixels(u, v).filter_map(|(x, y)| view.depth.at(x, y)).collect();
        measured.sort_unstable_by(f32::total_cmp);
        measured.get(measured.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
    };
    let metres = (0..width as usize * height as usize).into_par_iter().map(depth_at).collect();
    View {
        intrinsics,
        rgb: Arc::new(rgb),
        depth: Arc::new(DepthImage { width, height, metres }),
        labels: None,
        truth: None,
        pose: view.pose.clone(),
        ..*view
    }
}

/// What was said of a picture that was shrunk by `factor`, at the pixels of the picture (columns, rows): probabilities
/// and sigmas between the middles of the coarse pixels, objects those of the coarse pixel.
pub(super) fn enlarged(said: Segmentation, factor: u32, picture: (u32, u32)) -> Segmentation {
    let grid = Grid { factor: factor as usize, width: picture.0 as usize, height: picture.1 as usize };
    let detail = said.network.map(|detail| {
        Arc::new(ViewDetail {
            window: detail.window.map(|window| window.enlarged(factor, picture)),
            contribution: detail.contribution.as_ref().map(|share| grid.interpolated(share, 1)),
            ..(*detail).clone()
        })
    });
    Segmentation {
        components: grid.field(said.components),
        defects: grid.field(said.defects),
        instances: grid.repeated(&said.instances),
        network: detail,
    }
}

/// A picture and the whole number that it was shrunk by.
struct Grid {
    factor: usize,
    width: usize,
    height: usize,
}

/// Coarse pixels before and after a pixel of an axis, and the share of the second.
#[derive(Clone, Copy)]
struct Tap {
    before: usize,
    after: usize,
    share: f32,
}

impl Grid {
    fn field(&self, field: ClassField) -> ClassField {
        match field {
            ClassField::Hard(labels) => ClassField::Hard(self.repeated(&labels)),
            ClassField::Soft { classes, probabilities, sigma, model_sigma } => ClassField::Soft {
                classes,
                probabilities: self.interpolated(&probabilities, classes),
                sigma: self.interpolated(&sigma, 1),
                // What is not known cannot be interpolated.
                model_sigma: if model_sigma.is_empty() { model_sigma } else { self.repeated(&model_sigma) },
            },
        }
    }

    fn taps(&self, length: usize) -> Vec<Tap> {
        let last = length.div_ceil(self.factor).saturating_sub(1);
        let tap = |i: usize| {
            let place = ((i as f32 + 0.5) / self.factor as f32 - 0.5).clamp(0.0, last as f32);
            let before = place as usize;
            Tap { before, after: (before + 1).min(last), share: place - before as f32 }
        };
        (0..length).map(tap).collect()
    }

    /// Linear between coarse pixels of `channels` bytes each.
    fn interpolated(&self, coarse: &[u8], channels: usize) -> Vec<u8> {
        let columns = self.width.div_ceil(self.factor);
        let (along, down) = (self.taps(self.width), self.taps(self.height));
        let mut fine = vec![0; self.width * self.height * channels];
        let lines = fine.par_chunks_mut((self.width * channels).max(1)).zip(down);
        lines.for_each_init(Vec::new, |blended: &mut Vec<f32>, (line, y)| {
            // Between the two coarse rows first: what lies between two of their pixels then needs one step more.
            let row = |row: usize| &coarse[row * columns * channels..(row + 1) * columns * channels];
            let pairs = row(y.before).iter().zip(row(y.after)).map(|(a, b)| (f32::from(*a), f32::from(*b)));
            blended.clear();
            blended.extend(pairs.map(|(a, b)| a + (b - a) * y.share));
            for (pixel, x) in line.chunks_exact_mut(channels.max(1)).zip(&along) {
                let [before, after] = [x.before, x.after].map(|x| &blended[x * channels..(x + 1) * channels]);
                for ((value, a), b) in pixel.iter_mut().zip(before).zip(after) {
                    // Never below 0 nor above 255.
                    *value = (a + (b - a) * x.share + 0.5) as i32 as u8;
                }
            }
        });
        fine
    }

    fn repeated<T: Copy + Send + Sync + Default>(&self, coarse: &[T]) -> Vec<T> {
        let columns = self.width.div_ceil(self.factor);
        let mut fine = vec![T::default(); self.width * self.height];
        fine.par_chunks_mut(self.width.max(1)).enumerate().for_each(|(v, line)| {
            let row = &coarse[v / self.factor * columns..];
            line.chunks_mut(self.factor).zip(row).for_each(|(same, value)| same.fill(*value));
        });
        fine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Intrinsics, PoseEvidence};
    use image::Rgb;

    fn view(width: u32, height: u32) -> View {
        let metres = (0..width * height).map(|i| if i % 5 == 0 { 0.0 } else { 0.5 + (i % 3) as f32 * 0.001 }).collect();
        View {
            index: 3,
            stamp: None,
            intrinsics: Intrinsics { width, height, fx: 1500.0, fy: 1500.0, cx: 20.0, cy: 12.0 },
            rgb: Arc::new(RgbImage::from_fn(width, height, |u, v| Rgb([(u * 4) as u8, (v * 4) as u8, 9]))),
            depth: Arc::new(DepthImage { width, height, metres }),
            pose: PoseEvidence::None,
            labels: None,
            truth: None,
        }
    }

    fn input(footprint: Option<[f64; 2]>) -> Input {
        Input {
            tensor: "image".into(),
            channels: Vec::new(),
            multiple: 1,
            width: None,
            height: None,
            footprint,
            color: None,
            depth: None,
        }
    }

    #[test]
    fn pictures_of_finer_pixels_than_the_training_are_shrunk() {
        let view = view(41, 25);
        let window = Window::whole(41, 25);
        // 0.5 m away a pixel is a third of a millimetre.
        for (trained, wanted) in [
            (None, 1),
            (Some([0.3e-3, 0.5e-3]), 1),
            (Some([0.6e-3, 1.1e-3]), 2),
            (Some([0.8e-3, 1.25e-3]), 3),
            (Some([1.0, 1.0]), 16),
        ] {
            assert_eq!(factor(&view, window, &input(trained)), wanted, "{trained:?}");
        }
    }

    #[test]
    fn shrinking_averages_colours_and_keeps_measured_depths() {
        let view = view(41, 25);
        let coarse = shrunk(&view, 3);
        assert_eq!((coarse.intrinsics.width, coarse.intrinsics.height, coarse.index), (14, 9, 3));
        assert_eq!(coarse.rgb.get_pixel(2, 4).0, [28, 52, 9]);
        // The last column holds two of the picture's.
        assert_eq!(coarse.rgb.get_pixel(13, 0).0[0], 158);
        assert!(coarse.depth.metres.iter().all(|z| view.depth.metres.contains(z) && *z > 0.0));
    }

    #[test]
    fn what_is_said_comes_back_to_the_pictures_pixels() {
        let grid = Grid { factor: 2, width: 5, height: 3 };
        assert_eq!(grid.repeated(&[1_u16, 2, 3, 4, 5, 6]), [1, 1, 2, 2, 3, 1, 1, 2, 2, 3, 4, 4, 5, 5, 6]);
        let fine = grid.interpolated(&[0, 100, 200, 0, 100, 200], 1);
        assert_eq!(&fine[..5], [0, 25, 75, 125, 175]);
        // Columns of a constant field stay what they are, two channels side by side.
        let grid = Grid { factor: 3, width: 7, height: 4 };
        let fine = grid.interpolated(&[7, 250].repeat(6), 2);
        assert!(fine.chunks(2).all(|pixel| pixel == [7, 250]) && fine.len() == 56);
    }
}
