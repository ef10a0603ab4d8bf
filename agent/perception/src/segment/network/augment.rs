//! Test-time augmentation ([Remanufacturing paper], Fig. 6): the picture is changed a little, the network is asked
//! again, and what it says is carried back to the picture's own pixels. Where a change of geometry has moved a pixel
//! out of the picture, nothing is known of it and it is masked.

use super::manifest::{Channel, Input};
use super::preprocess::bilinear;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
pub use semascan_model::record::Augmentation;

/// Largest turn of a warp, radians: 6 degrees.
const TURN: f32 = 0.105;
/// Largest relative change of size of a warp.
const ZOOM: f32 = 0.08;
/// Largest relative change of contrast.
const CONTRAST: f32 = 0.15;
/// Largest change of brightness, of 1.
const BRIGHTNESS: f32 = 0.06;
/// Largest standard deviation of added noise, of 1.
const NOISE: f32 = 0.02;

/// A change with its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Drawn {
    /// None.
    Identity,
    /// Left and right exchanged.
    Flip,
    /// The changed picture shows at x what the picture shows at `turn * (x - middle) + middle`.
    Warp {
        /// Rotation times scale: (cosine, sine) times the zoom.
        turn: (f32, f32),
    },
    /// `contrast * color + brightness + noise`, of 1.
    Light {
        /// Factor.
        contrast: f32,
        /// Addend.
        brightness: f32,
        /// Standard deviation.
        noise: f32,
        /// Of the noise.
        seed: u64,
    },
}

impl Drawn {
    /// Draws the numbers of `kind`; the same seed gives the same.
    pub(super) fn new(kind: Augmentation, seed: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut within = |limit: f32| limit * (2.0 * random.random::<f32>() - 1.0);
        match kind {
            Augmentation::Identity => Self::Identity,
            Augmentation::Flip => Self::Flip,
            Augmentation::Warp => {
                let (angle, zoom) = (within(TURN), 1.0 + within(ZOOM));
                Self::Warp { turn: (zoom * angle.cos(), zoom * angle.sin()) }
            }
            Augmentation::Light => Self::Light {
                contrast: 1.0 + within(CONTRAST),
                brightness: within(BRIGHTNESS),
                noise: within(NOISE).abs(),
                seed: random.next_u64(),
            },
        }
    }
}

impl Drawn {
    /// The changed input: `tensor` holds the channels of `input`, each of `size` (columns, rows).
    pub(super) fn apply(&self, tensor: &[f32], input: &Input, size: (usize, usize)) -> Vec<f32> {
        let plane = (size.0 * size.1).max(1);
        let channels = || input.channels.iter().zip(tensor.chunks_exact(plane));
        match *self {
            Self::Identity => tensor.to_vec(),
            Self::Flip => {
                let mut flipped = tensor.to_vec();
                flip(&mut flipped, size.0);
                flipped
            }
            Self::Warp { turn } => channels()
                .flat_map(|(channel, values)| {
                    // Depth is never interpolated.
                    let nearest = *channel == Channel::Depth;
                    warped(values, size, move |x, y| {
                        let (u, v) = rotated((x, y), turn, size);
                        if nearest { (u.round(), v.round()) } else { (u, v) }
                    })
                })
                .collect(),
            Self::Light { contrast, brightness, noise, seed } => {
                let mut random = Pcg64Mcg::seed_from_u64(seed);
                let mut changed = Vec::with_capacity(tensor.len());
                for (channel, values) in channels() {
                    let (Some(index), Some(scale)) = (color_index(*channel), &input.color) else {
                        changed.extend_from_slice(values);
                        continue;
                    };
                    let (mean, std) = (scale.mean[index], scale.std[index]);
                    changed.extend(values.iter().map(|value| {
                        let color = contrast * (value * std + mean) + brightness + noise * normal(random.next_u64());
                        (color.clamp(0.0, 1.0) - mean) / std
                    }));
                }
                changed
            }
        }
    }

    /// What was predicted on the changed input, at the pixels of the picture. `planes` are any number of planes of `size`.
    pub(super) fn undo(&self, mut planes: Vec<f32>, size: (usize, usize)) -> Vec<f32> {
        match self {
            Self::Identity | Self::Light { .. } => planes,
            Self::Flip => {
                flip(&mut planes, size.0);
                planes
            }
            Self::Warp { turn } => {
                let back = inverse(*turn);
                let plane = (size.0 * size.1).max(1);
                let undone =
                    planes.chunks_exact(plane).flat_map(|p| warped(p, size, |x, y| rotated((x, y), back, size)));
                undone.collect()
            }
        }
    }

    /// Which pixels of a picture of `size` the changed one shows; all if absent.
    pub(super) fn known(&self, size: (usize, usize)) -> Option<Vec<bool>> {
        let Self::Warp { turn } = self else { return None };
        let back = inverse(*turn);
        Some(
            (0..size.0 * size.1)
                .map(|i| {
                    let (u, v) = rotated(((i % size.0) as f32, (i / size.0) as f32), back, size);
                    u >= 0.0 && v >= 0.0 && u <= (size.0 - 1) as f32 && v <= (size.1 - 1) as f32
                })
                .collect(),
        )
    }
}

/// The turn that takes another back.
fn inverse((c, s): (f32, f32)) -> (f32, f32) {
    let square = c * c + s * s;
    (c / square, -s / square)
}

/// Turns each row of `width` values round.
fn flip(planes: &mut [f32], width: usize) {
    planes.chunks_exact_mut(width.max(1)).for_each(<[f32]>::reverse);
}

/// `turn` applied about the middle of a picture of `size`.
fn rotated((x, y): (f32, f32), (c, s): (f32, f32), size: (usize, usize)) -> (f32, f32) {
    let middle = ((size.0 as f32 - 1.0) / 2.0, (size.1 as f32 - 1.0) / 2.0);
    let (dx, dy) = (x - middle.0, y - middle.1);
    (c * dx - s * dy + middle.0, s * dx + c * dy + middle.1)
}

/// A plane that shows at (x, y) what `plane` shows at `from(x, y)`.
fn warped(plane: &[f32], size: (usize, usize), from: impl Fn(f32, f32) -> (f32, f32)) -> Vec<f32> {
    let (width, height) = size;
    (0..width * height)
        .map(|i| {
            let (u, v) = from((i % width) as f32, (i / width) as f32);
            bilinear(width, height, u, v, |x, y| plane[y * width + x])
        })
        .collect()
}

/// Place of a colour channel in red, green, blue.
fn color_index(channel: Channel) -> Option<usize> {
    match channel {
        Channel::Red => Some(0),
        Channel::Green => Some(1),
        Channel::Blue => Some(2),
        Channel::Depth => None,
    }
}

/// About normally distributed with variance 1: the sum of four uniform numbers.
fn normal(word: u64) -> f32 {
    let sum: u64 = (0..4).map(|i| word >> (16 * i) & 0xffff).sum();
    (sum as f32 / 65536.0 - 2.0) * 3.0_f32.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::network::manifest::{ColorScale, DepthScale};

    const SIZE: (usize, usize) = (80, 60);

    fn input() -> Input {
        Input {
            tensor: "image".into(),
            channels: vec![Channel::Red, Channel::Depth],
            multiple: 1,
            width: None,
            height: None,
            footprint: None,
            color: Some(ColorScale { mean: [0.4; 3], std: [0.2; 3] }),
            depth: Some(DepthScale { near: 0.2, far: 0.9, missing: 0.0 }),
        }
    }

    /// A smooth red plane, and a depth plane of two levels.
    fn tensor() -> Vec<f32> {
        let n = SIZE.0 * SIZE.1;
        let smooth = |i: usize| ((i % SIZE.0) as f32 / 17.0).sin() * ((i / SIZE.0) as f32 / 13.0).cos();
        let levels = |i: usize| if i % SIZE.0 < 40 { 0.25 } else { 0.75 };
        (0..n).map(smooth).chain((0..n).map(levels)).collect()
    }

    #[test]
    fn what_is_changed_and_undone_is_what_it_was() {
        let tensor = tensor();
        let n = SIZE.0 * SIZE.1;
        for (kind, tolerance) in [(Augmentation::Identity, 0.0), (Augmentation::Flip, 0.0), (Augmentation::Warp, 0.004)]
        {
            for seed in 0..5 {
                let drawn = Drawn::new(kind, seed);
                let changed = drawn.apply(&tensor, &input(), SIZE);
                let (back, valid) = (drawn.undo(changed.clone(), SIZE), drawn.known(SIZE));
                let known = |i: usize| valid.as_ref().is_none_or(|v| v[i % n]);
                let masked = (0..n).filter(|&i| !known(i)).count();
                assert!(masked < n / 4, "{kind:?} masks {masked}");
                // A zoom out masks the rim; the middle is always known.
                assert!(known(n / 2 + SIZE.0 / 2));
                for i in (0..n).filter(|&i| known(i)) {
                    let error = (back[i] - tensor[i]).abs();
                    // What the changed picture cut off at its rim and repeated does not come back.
                    let rim = i % SIZE.0 < 8 || i % SIZE.0 >= 72 || i / SIZE.0 < 8 || i / SIZE.0 >= 52;
                    assert!(rim || error <= tolerance, "{kind:?} seed {seed} pixel {i}: {error}");
                }
            }
        }
    }

    #[test]
    fn a_warp_moves_things_and_never_mixes_depths() {
        let drawn = Drawn::new(Augmentation::Warp, 3);
        let changed = drawn.apply(&tensor(), &input(), SIZE);
        let n = SIZE.0 * SIZE.1;
        assert!(changed[..n].iter().zip(&tensor()[..n]).any(|(a, b)| (a - b).abs() > 0.05));
        assert!(changed[n..].iter().all(|z| *z == 0.25 || *z == 0.75));
        assert_ne!(Drawn::new(Augmentation::Warp, 3), Drawn::new(Augmentation::Warp, 4));
        assert_eq!(Drawn::new(Augmentation::Warp, 3), drawn);
    }

    #[test]
    fn a_pixel_that_left_the_picture_is_masked() {
        // Twice as large: a quarter of the picture is seen, the rest is unknown.
        let drawn = Drawn::Warp { turn: (0.5, 0.0) };
        let valid = drawn.known(SIZE).expect("geometry");
        assert!(!valid[0] && valid[30 * SIZE.0 + 40]);
        let share = valid.iter().filter(|v| **v).count() as f32 / valid.len() as f32;
        assert!((share - 0.25).abs() < 0.02, "{share}");
    }

    #[test]
    fn light_changes_colors_within_their_range_and_leaves_depth() {
        let tensor = tensor();
        let n = SIZE.0 * SIZE.1;
        let drawn = Drawn::Light { contrast: 1.1, brightness: 0.05, noise: 0.02, seed: 5 };
        let changed = drawn.apply(&tensor, &input(), SIZE);
        assert_eq!(changed[n..], tensor[n..]);
        let color = |value: f32| value * 0.2 + 0.4;
        assert!(changed[..n].iter().all(|v| (0.0..=1.0).contains(&(color(*v)))));
        let noise: Vec<f32> = (0..n).map(|i| color(changed[i]) - 1.1 * color(tensor[i]) - 0.05).collect();
        let mean = noise.iter().sum::<f32>() / n as f32;
        let deviation = (noise.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / n as f32).sqrt();
        assert!(mean.abs() < 1e-3 && (deviation - 0.02).abs() < 1e-3, "{mean} {deviation}");
    }
}
