//! Views kept for rebuilds: compressed without loss, in memory up to a limit, on disk past it.

use super::{FuseError, LabelledView};
use crate::acquire::{DepthImage, Intrinsics};
use crate::register::OrganizedCloud;
use crate::segment::{ClassField, Segmentation};
use image::RgbImage;
use nalgebra::Isometry3;
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Seek, SeekFrom, Write};

/// Level 1 packs a 640x480 view in a few milliseconds.
const LEVEL: i32 = 1;

#[derive(Debug)]
enum Packed {
    Memory(Vec<u8>),
    Disk { offset: u64, len: usize },
}

/// How a class field is laid out, so that its bytes can be split again.
#[derive(Clone, Copy, Debug)]
enum FieldKind {
    Hard,
    Soft { classes: usize },
}

#[derive(Debug)]
struct Kept {
    index: u32,
    intrinsics: Intrinsics,
    table_from_camera: Isometry3<f64>,
    components: FieldKind,
    defects: FieldKind,
    raw_len: usize,
    packed: Packed,
}

/// Every integrated view, in order.
#[derive(Debug)]
pub struct KeptViews {
    views: Vec<Kept>,
    in_memory: usize,
    limit: usize,
    spill: Option<File>,
}

impl KeptViews {
    /// Holds up to `limit` compressed bytes in memory; what comes after goes to an unnamed temporary file.
    pub fn new(limit: usize) -> Self {
        Self { views: Vec::new(), in_memory: 0, limit, spill: None }
    }

    /// Number of kept views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether no view is kept.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// The poses that the views were integrated with, in order.
    pub fn poses(&self) -> Vec<Isometry3<f64>> {
        self.views.iter().map(|v| v.table_from_camera).collect()
    }

    /// Keeps a view.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if the disk is full.
    pub fn keep(&mut self, view: &LabelledView) -> Result<(), FuseError> {
        let failed = |source| FuseError::Keep { view: view.index, source };
        let mut raw = Vec::new();
        for depth in &view.cloud.depth {
            raw.extend_from_slice(&depth.to_le_bytes());
        }
        raw.extend_from_slice(view.rgb.as_raw());
        push_u16(&mut raw, &view.segmentation.instances);
        let components = push_field(&mut raw, &view.segmentation.components);
        let defects = push_field(&mut raw, &view.segmentation.defects);
        let bytes = zstd::bulk::compress(&raw, LEVEL).map_err(failed)?;
        let packed = if self.in_memory + bytes.len() <= self.limit {
            self.in_memory += bytes.len();
            Packed::Memory(bytes)
        } else {
            self.spill(&bytes).map_err(failed)?
        };
        self.views.push(Kept {
            index: view.index,
            intrinsics: view.cloud.intrinsics,
            table_from_camera: view.table_from_camera,
            components,
            defects,
            raw_len: raw.len(),
            packed,
        });
        Ok(())
    }

    fn spill(&mut self, bytes: &[u8]) -> std::io::Result<Packed> {
        let file = match &mut self.spill {
            Some(file) => file,
            none => none.insert(tempfile::tempfile()?),
        };
        let offset = file.seek(SeekFrom::End(0))?;
        file.write_all(bytes)?;
        Ok(Packed::Disk { offset, len: bytes.len() })
    }

    /// View `i` as it was integrated; normals are fitted again.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if it cannot be read back.
    pub fn restore(&self, i: usize) -> Result<LabelledView, FuseError> {
        let kept = self.views.get(i).ok_or(FuseError::PoseCount { poses: i + 1, views: self.views.len() })?;
        self.unpack(kept).map_err(|source| FuseError::Keep { view: kept.index, source })
    }

    fn unpack(&self, kept: &Kept) -> std::io::Result<LabelledView> {
        let raw = match &kept.packed {
            Packed::Memory(bytes) => zstd::bulk::decompress(bytes, kept.raw_len)?,
            Packed::Disk { offset, len } => {
                let mut file = self.spill.as_ref().ok_or_else(truncated)?;
                file.seek(SeekFrom::Start(*offset))?;
                let mut bytes = vec![0; *len];
                file.read_exact(&mut bytes)?;
                zstd::bulk::decompress(&bytes, kept.raw_len)?
            }
        };
        let Intrinsics { width, height, .. } = kept.intrinsics;
        let pixels = width as usize * height as usize;
        let mut rest = raw.as_slice();
        let depth = take(&mut rest, pixels * 4)?;
        let metres = depth.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let rgb = take(&mut rest, pixels * 3)?.to_vec();
        let rgb = RgbImage::from_raw(width, height, rgb).ok_or_else(truncated)?;
        let instances = read_u16(take(&mut rest, pixels * 2)?);
        let components = take_field(&mut rest, kept.components, pixels)?;
        let defects = take_field(&mut rest, kept.defects, pixels)?;
        Ok(LabelledView {
            index: kept.index,
            cloud: OrganizedCloud::new(kept.intrinsics, &DepthImage { width, height, metres }, None),
            rgb,
            segmentation: Segmentation { components, defects, instances },
            table_from_camera: kept.table_from_camera,
        })
    }
}

fn truncated() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "kept view is shorter than its picture")
}

fn take<'a>(rest: &mut &'a [u8], len: usize) -> std::io::Result<&'a [u8]> {
    let (head, tail) = rest.split_at_checked(len).ok_or_else(truncated)?;
    *rest = tail;
    Ok(head)
}

fn push_u16(raw: &mut Vec<u8>, values: &[u16]) {
    for v in values {
        raw.extend_from_slice(&v.to_le_bytes());
    }
}

fn read_u16(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
}

fn push_field(raw: &mut Vec<u8>, field: &ClassField) -> FieldKind {
    match field {
        ClassField::Hard(labels) => {
            push_u16(raw, labels);
            FieldKind::Hard
        }
        ClassField::Soft { classes, probabilities, sigma } => {
            raw.extend_from_slice(probabilities);
            raw.extend_from_slice(sigma);
            FieldKind::Soft { classes: *classes }
        }
    }
}

fn take_field(rest: &mut &[u8], kind: FieldKind, pixels: usize) -> std::io::Result<ClassField> {
    Ok(match kind {
        FieldKind::Hard => ClassField::Hard(read_u16(take(rest, pixels * 2)?)),
        FieldKind::Soft { classes } => ClassField::Soft {
            classes,
            probabilities: take(rest, pixels * classes)?.to_vec(),
            sigma: take(rest, pixels)?.to_vec(),
        },
    })
}
