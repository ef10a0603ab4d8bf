//! A labelled view in as few bytes as can be had quickly, without loss in the pixels that have depth.
//!
//! What has no depth is fused nowhere and is not kept. Depth is kept as captured: as a whole number of steps where the
//! sensor's numbers show one, else as its bits; differences to the pixel before, split into byte planes so that the
//! noisy low bytes do not spoil the quiet high ones. Colours are kept as differences too, class probabilities class by
//! class. zstd at its fastest level packs each part, and the parts are packed side by side.

use super::labelled_view::LabelledView;
use crate::organized::OrganizedCloud;
use crate::segment::{ClassField, Segmentation, UNKNOWN_PART};
use crate::view::{DepthImage, Intrinsics};
use image::RgbImage;
use nalgebra::Isometry3;
use rayon::prelude::*;
use std::io::{Error, ErrorKind};

/// Level 1 packs about half a gigabyte a second.
const LEVEL: i32 = 1;

/// Steps that depth is recorded in, metres.
const STEPS: [f32; 9] = [1e-3, 5e-4, 2.5e-4, 1.25e-4, 1e-4, 5e-5, 2.5e-5, 2e-5, 1e-5];

/// How a class field is laid out.
#[derive(Clone, Copy, Debug)]
enum FieldKind {
    Hard,
    Soft { classes: usize, has_model_sigma: bool },
}

/// One compressed part and its length before.
type Part = (Vec<u8>, usize);

/// A packed view. Its parts are: which pixels have depth, depth, colour, instances, components, defects.
#[derive(Debug)]
pub(super) struct PackedView {
    intrinsics: Intrinsics,
    step: Option<f32>,
    fields: [FieldKind; 2],
    /// Packed and plain length of each part.
    lengths: [(usize, usize); 6],
    /// The parts, one after the other.
    pub(super) bytes: Vec<u8>,
}

/// Packs a view.
pub(super) fn pack(view: &LabelledView) -> std::io::Result<PackedView> {
    let depth = &view.cloud.depth;
    let measured: Vec<u32> = (0..depth.len() as u32).filter(|&i| depth[i as usize] > 0.0).collect();
    let step = STEPS
        .into_iter()
        .find(|&q| measured.iter().all(|&i| depth[i as usize] == steps(depth[i as usize], q) as f32 * q));
    let segmentation = &view.segmentation;
    let parts: Vec<Part> = (0..6)
        .into_par_iter()
        .map(|part| {
            let plain = match part {
                0 => bitmap(depth),
                1 => depth_planes(depth, &measured, step),
                2 => color_planes(view.rgb.as_raw(), &measured),
                3 => u16_planes(measured.iter().map(|&i| segmentation.instances.get(i as usize).copied().unwrap_or(0))),
                4 => field_planes(&segmentation.components, &measured),
                _ => field_planes(&segmentation.defects, &measured),
            };
            Ok((zstd::bulk::compress(&plain, LEVEL)?, plain.len()))
        })
        .collect::<std::io::Result<_>>()?;
    let mut lengths = [(0, 0); 6];
    for (length, (packed, plain)) in lengths.iter_mut().zip(&parts) {
        *length = (packed.len(), *plain);
    }
    Ok(PackedView {
        intrinsics: view.cloud.intrinsics,
        step,
        fields: [FieldKind::of(&segmentation.components), FieldKind::of(&segmentation.defects)],
        lengths,
        bytes: parts.into_iter().flat_map(|(packed, _)| packed).collect(),
    })
}

impl PackedView {
    /// View `index` from its bytes (its own, or those read back from disk), at the pose `table_from_camera`. Pixels without
    /// depth come back black and without labels; normals are fitted again.
    pub(super) fn unpack(
        &self,
        bytes: &[u8],
        index: u32,
        table_from_camera: Isometry3<f64>,
    ) -> std::io::Result<LabelledView> {
        let plain: Vec<Vec<u8>> =
            (0..6).into_par_iter().map(|part| self.plain_part(bytes, part)).collect::<std::io::Result<_>>()?;
        let Intrinsics { width, height, .. } = self.intrinsics;
        let pixels = width as usize * height as usize;
        let measured = measured_pixels(&plain[0], pixels);
        let metres = read_depth(&plain[1], &measured, pixels, self.step)?;
        let rgb = RgbImage::from_raw(width, height, read_color(&plain[2], &measured, pixels)?).ok_or_else(truncated)?;
        let (cloud, rest) = rayon::join(
            || OrganizedCloud::new(self.intrinsics, &DepthImage { width, height, metres }, None),
            || -> std::io::Result<Segmentation> {
                Ok(Segmentation {
                    instances: read_u16(&plain[3], &measured, pixels)?,
                    components: self.fields[0].read(&plain[4], &measured, pixels)?,
                    defects: self.fields[1].read(&plain[5], &measured, pixels)?,
                    network: None,
                })
            },
        );
        Ok(LabelledView { index, cloud, rgb: std::sync::Arc::new(rgb), segmentation: rest?, table_from_camera })
    }

    /// Camera and depth of the view from its bytes.
    pub(super) fn unpack_depth(&self, bytes: &[u8]) -> std::io::Result<(Intrinsics, Vec<f32>)> {
        let pixels = self.intrinsics.width as usize * self.intrinsics.height as usize;
        let measured = measured_pixels(&self.plain_part(bytes, 0)?, pixels);
        Ok((self.intrinsics, read_depth(&self.plain_part(bytes, 1)?, &measured, pixels, self.step)?))
    }

    /// The defects of the view from its bytes.
    pub(super) fn unpack_defects(&self, bytes: &[u8]) -> std::io::Result<ClassField> {
        let pixels = self.intrinsics.width as usize * self.intrinsics.height as usize;
        let measured = measured_pixels(&self.plain_part(bytes, 0)?, pixels);
        self.fields[1].read(&self.plain_part(bytes, 5)?, &measured, pixels)
    }

    /// Camera, depth and colour of the view from its bytes: pixels without depth are black.
    pub(super) fn unpack_picture(&self, bytes: &[u8]) -> std::io::Result<(Intrinsics, Vec<f32>, RgbImage)> {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let pixels = width as usize * height as usize;
        let measured = measured_pixels(&self.plain_part(bytes, 0)?, pixels);
        let metres = read_depth(&self.plain_part(bytes, 1)?, &measured, pixels, self.step)?;
        let colors = read_color(&self.plain_part(bytes, 2)?, &measured, pixels)?;
        let rgb = RgbImage::from_raw(width, height, colors).ok_or_else(truncated)?;
        Ok((self.intrinsics, metres, rgb))
    }

    /// One of the parts.
    fn plain_part(&self, bytes: &[u8], part: usize) -> std::io::Result<Vec<u8>> {
        let start: usize = self.lengths[..part].iter().map(|(packed, _)| packed).sum();
        let (packed, plain) = self.lengths[part];
        zstd::bulk::decompress(bytes.get(start..start + packed).ok_or_else(truncated)?, plain)
    }
}

/// The pixels that a bitmap says have depth.
fn measured_pixels(bitmap: &[u8], pixels: usize) -> Vec<u32> {
    let is_set = |i: &u32| bitmap.get(*i as usize / 8).is_some_and(|b| b >> (i % 8) & 1 == 1);
    (0..pixels as u32).filter(is_set).collect()
}

fn truncated() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "kept view is shorter than its picture")
}

fn steps(z: f32, step: f32) -> u32 {
    // Rounds half up, which is one instruction; whether the steps give the depth back is checked bit by bit.
    (z / step + 0.5) as u32
}

/// One bit a pixel: whether it has depth.
fn bitmap(depth: &[f32]) -> Vec<u8> {
    depth.chunks(8).map(|eight| eight.iter().enumerate().fold(0, |b, (i, &z)| b | u8::from(z > 0.0) << i)).collect()
}

fn depth_planes(depth: &[f32], measured: &[u32], step: Option<f32>) -> Vec<u8> {
    let n = measured.len();
    let mut planes = vec![0; 4 * n];
    let mut before = 0_u32;
    for (i, &pixel) in measured.iter().enumerate() {
        let z = depth[pixel as usize];
        let value = step.map_or(z.to_bits(), |q| steps(z, q));
        let difference = value.wrapping_sub(before) as i32;
        // Small numbers of either sign have zeros in their high bytes.
        let folded = (difference << 1 ^ difference >> 31) as u32;
        for (plane, byte) in folded.to_le_bytes().into_iter().enumerate() {
            planes[plane * n + i] = byte;
        }
        before = value;
    }
    planes
}

fn read_depth(planes: &[u8], measured: &[u32], pixels: usize, step: Option<f32>) -> std::io::Result<Vec<f32>> {
    let n = measured.len();
    if planes.len() != 4 * n {
        return Err(truncated());
    }
    let mut depth = vec![0.0; pixels];
    let mut before = 0_u32;
    for (i, &pixel) in measured.iter().enumerate() {
        let folded = u32::from_le_bytes(std::array::from_fn(|plane| planes[plane * n + i]));
        before = before.wrapping_add(folded >> 1 ^ 0_u32.wrapping_sub(folded & 1));
        depth[pixel as usize] = step.map_or(f32::from_bits(before), |q| before as f32 * q);
    }
    Ok(depth)
}

fn color_planes(rgb: &[u8], measured: &[u32]) -> Vec<u8> {
    let n = measured.len();
    let mut planes = vec![0; 3 * n];
    let mut before = [0_u8; 3];
    for (i, &pixel) in measured.iter().enumerate() {
        let at = pixel as usize * 3;
        let now: [u8; 3] = std::array::from_fn(|c| rgb.get(at + c).copied().unwrap_or(0));
        for c in 0..3 {
            planes[c * n + i] = now[c].wrapping_sub(before[c]);
        }
        before = now;
    }
    planes
}

fn read_color(planes: &[u8], measured: &[u32], pixels: usize) -> std::io::Result<Vec<u8>> {
    let n = measured.len();
    if planes.len() != 3 * n {
        return Err(truncated());
    }
    let mut rgb = vec![0; pixels * 3];
    let mut before = [0_u8; 3];
    for (i, &pixel) in measured.iter().enumerate() {
        for c in 0..3 {
            before[c] = before[c].wrapping_add(planes[c * n + i]);
            rgb[pixel as usize * 3 + c] = before[c];
        }
    }
    Ok(rgb)
}

fn u16_planes(values: impl ExactSizeIterator<Item = u16>) -> Vec<u8> {
    let n = values.len();
    let mut planes = vec![0; 2 * n];
    for (i, value) in values.enumerate() {
        [planes[i], planes[n + i]] = value.to_le_bytes();
    }
    planes
}

fn read_u16(planes: &[u8], measured: &[u32], pixels: usize) -> std::io::Result<Vec<u16>> {
    let n = measured.len();
    if planes.len() != 2 * n {
        return Err(truncated());
    }
    let mut values = vec![0; pixels];
    for (i, &pixel) in measured.iter().enumerate() {
        values[pixel as usize] = u16::from_le_bytes([planes[i], planes[n + i]]);
    }
    Ok(values)
}

fn field_planes(field: &ClassField, measured: &[u32]) -> Vec<u8> {
    match field {
        ClassField::Hard(labels) => u16_planes(measured.iter().map(|&i| labels.get(i as usize).copied().unwrap_or(0))),
        ClassField::Soft { classes, probabilities, sigma, model_sigma } => {
            let n = measured.len();
            let mut planes = vec![0; (classes + 1 + usize::from(!model_sigma.is_empty())) * n];
            for (i, &pixel) in measured.iter().enumerate() {
                let pixel = pixel as usize;
                for class in 0..*classes {
                    planes[class * n + i] = probabilities.get(pixel * classes + class).copied().unwrap_or(0);
                }
                // A pixel past the end of the field is as uncertain as can be.
                planes[classes * n + i] = sigma.get(pixel).copied().unwrap_or(u8::MAX);
                if !model_sigma.is_empty() {
                    planes[(classes + 1) * n + i] = model_sigma.get(pixel).copied().unwrap_or(UNKNOWN_PART);
                }
            }
            planes
        }
    }
}

impl FieldKind {
    fn of(field: &ClassField) -> Self {
        match field {
            ClassField::Hard(_) => Self::Hard,
            ClassField::Soft { classes, model_sigma, .. } => {
                Self::Soft { classes: *classes, has_model_sigma: !model_sigma.is_empty() }
            }
        }
    }

    fn read(self, planes: &[u8], measured: &[u32], pixels: usize) -> std::io::Result<ClassField> {
        let Self::Soft { classes, has_model_sigma } = self else {
            return Ok(ClassField::Hard(read_u16(planes, measured, pixels)?));
        };
        let n = measured.len();
        if planes.len() != (classes + 1 + usize::from(has_model_sigma)) * n {
            return Err(truncated());
        }
        let (mut probabilities, mut sigma) = (vec![0; pixels * classes], vec![0; pixels]);
        let mut model_sigma = if has_model_sigma { vec![UNKNOWN_PART; pixels] } else { Vec::new() };
        for (i, &pixel) in measured.iter().enumerate() {
            let pixel = pixel as usize;
            for class in 0..classes {
                probabilities[pixel * classes + class] = planes[class * n + i];
            }
            sigma[pixel] = planes[classes * n + i];
            if has_model_sigma {
                model_sigma[pixel] = planes[(classes + 1) * n + i];
            }
        }
        Ok(ClassField::Soft { classes, probabilities, sigma, model_sigma })
    }
}

#[cfg(test)]
mod tests;
