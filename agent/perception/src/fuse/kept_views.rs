//! Views kept for rebuilds: plain as long as there is room, then packed without loss in memory, then on disk.
//!
//! Packing a view takes a third of the time of fusing it, and most inspections have few views.

use super::error::FuseError;
use super::labelled_view::LabelledView;
use super::view_codec::{PackedView, pack};
use crate::organized::OrganizedCloud;
use crate::segment::{ClassField, Segmentation};
use crate::view::{DepthImage, Intrinsics};
use image::RgbImage;
use nalgebra::Isometry3;
use std::borrow::Cow;
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Seek, SeekFrom, Write};
use std::sync::Arc;

/// A view as it came, but for what is fitted to its depth.
#[derive(Clone, Debug)]
pub(super) struct PlainView {
    intrinsics: Intrinsics,
    metres: Vec<f32>,
    rgb: Arc<RgbImage>,
    segmentation: Segmentation,
}

/// What is kept of a view.
#[derive(Debug)]
pub(super) enum Content {
    Plain(Box<PlainView>),
    Packed(PackedView),
    /// Its bytes are in the spill file: offset and length.
    Spilled(PackedView, (u64, usize)),
}

/// A kept view.
#[derive(Debug)]
pub(super) struct Kept {
    index: u32,
    table_from_camera: Isometry3<f64>,
    content: Content,
}

/// What a kept view measured, without what is fitted to it.
#[derive(Clone, Debug)]
pub struct KeptDepth<'a> {
    /// Position in the capture order.
    pub index: u32,
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Depth in metres, row-major; 0 where nothing was measured.
    pub metres: Cow<'a, [f32]>,
    /// The pose that the view was integrated or last rebuilt with.
    pub table_from_camera: Isometry3<f64>,
}

/// A kept view's pictures, without what is fitted to them.
#[derive(Clone, Debug)]
pub struct KeptPicture<'a> {
    /// What it measured.
    pub depth: KeptDepth<'a>,
    /// Colour.
    pub rgb: Arc<RgbImage>,
    /// Whether the colour is whole; else pixels without depth are black.
    pub is_whole: bool,
}

/// Every integrated view, in order.
#[derive(Debug)]
pub struct KeptViews {
    views: Vec<Kept>,
    /// Bytes of plain views, and of packed ones in memory.
    plain: usize,
    packed: usize,
    limit: usize,
    spill: Option<File>,
}

impl KeptViews {
    /// Holds up to `limit` bytes in memory, up to half of them of views that are not packed; what comes after goes to an
    /// unnamed temporary file.
    pub fn new(limit: usize) -> Self {
        Self { views: Vec::new(), plain: 0, packed: 0, limit, spill: None }
    }

    /// Number of kept views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether no view is kept.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// The poses that the views were integrated with, or last rebuilt with, in order.
    pub fn poses(&self) -> Vec<Isometry3<f64>> {
        self.views.iter().map(|v| v.table_from_camera).collect()
    }

    /// Positions of the kept views in the capture order.
    pub fn indices(&self) -> Vec<u32> {
        self.views.iter().map(|v| v.index).collect()
    }

    /// Bytes of views in memory. Colours are counted though others may hold them as well.
    pub fn bytes_in_memory(&self) -> usize {
        self.plain + self.packed
    }

    /// Packed bytes on disk.
    pub fn bytes_on_disk(&self) -> usize {
        let spilled = |kept: &Kept| if let Content::Spilled(_, (_, length)) = kept.content { length } else { 0 };
        self.views.iter().map(spilled).sum()
    }

    /// Makes of a view what is kept of it, for [`Self::keep`].
    ///
    /// # Errors
    /// [`FuseError::Keep`] if it cannot be packed.
    pub(super) fn prepare(&self, view: &LabelledView) -> Result<Kept, FuseError> {
        let content = if self.plain + PlainView::bytes_of(view) <= self.limit / 2 {
            Content::Plain(Box::new(PlainView::of(view)))
        } else {
            Content::Packed(pack(view).map_err(|source| FuseError::Keep { view: view.index, source })?)
        };
        Ok(Kept { index: view.index, table_from_camera: view.table_from_camera, content })
    }

    /// Keeps a view.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if the disk is full.
    pub(super) fn keep(&mut self, mut view: Kept) -> Result<(), FuseError> {
        view.content = match view.content {
            Content::Plain(plain) => {
                self.plain += plain.bytes();
                Content::Plain(plain)
            }
            Content::Packed(mut packed) if self.plain + self.packed + packed.bytes.len() > self.limit => {
                let bytes = std::mem::take(&mut packed.bytes);
                let place = self.spill(&bytes).map_err(|source| FuseError::Keep { view: view.index, source })?;
                Content::Spilled(packed, place)
            }
            Content::Packed(packed) => {
                self.packed += packed.bytes.len();
                Content::Packed(packed)
            }
            spilled @ Content::Spilled(..) => spilled,
        };
        self.views.push(view);
        Ok(())
    }

    fn spill(&mut self, bytes: &[u8]) -> std::io::Result<(u64, usize)> {
        let file = match &mut self.spill {
            Some(file) => file,
            none => none.insert(tempfile::tempfile()?),
        };
        let offset = file.seek(SeekFrom::End(0))?;
        file.write_all(bytes)?;
        Ok((offset, bytes.len()))
    }

    /// View `i`: what it had where it has depth, with the pose it was integrated or last rebuilt with.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if it cannot be read back.
    pub fn restore(&self, i: usize) -> Result<LabelledView, FuseError> {
        let kept = self.views.get(i).ok_or(FuseError::PoseCount { poses: i + 1, views: self.views.len() })?;
        let (index, pose) = (kept.index, kept.table_from_camera);
        match &kept.content {
            Content::Plain(plain) => Ok(plain.view(index, pose)),
            Content::Packed(packed) => packed.unpack(&packed.bytes, index, pose),
            Content::Spilled(packed, place) => self.read(*place).and_then(|bytes| packed.unpack(&bytes, index, pose)),
        }
        .map_err(|source| FuseError::Keep { view: index, source })
    }

    /// The depth of view `i`: cheaper than [`Self::restore`], which fits normals again.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if it cannot be read back.
    pub fn depth(&self, i: usize) -> Result<KeptDepth<'_>, FuseError> {
        let kept = self.views.get(i).ok_or(FuseError::PoseCount { poses: i + 1, views: self.views.len() })?;
        let (index, table_from_camera) = (kept.index, kept.table_from_camera);
        let unpacked = match &kept.content {
            Content::Plain(plain) => {
                let metres = Cow::Borrowed(plain.metres.as_slice());
                return Ok(KeptDepth { index, intrinsics: plain.intrinsics, metres, table_from_camera });
            }
            Content::Packed(packed) => packed.unpack_depth(&packed.bytes),
            Content::Spilled(packed, place) => self.read(*place).and_then(|bytes| packed.unpack_depth(&bytes)),
        };
        let (intrinsics, metres) = unpacked.map_err(|source| FuseError::Keep { view: index, source })?;
        Ok(KeptDepth { index, intrinsics, metres: Cow::Owned(metres), table_from_camera })
    }

    /// The defects of the pixels of view `i` that have depth.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if they cannot be read back.
    pub fn defects(&self, i: usize) -> Result<Cow<'_, ClassField>, FuseError> {
        let kept = self.views.get(i).ok_or(FuseError::PoseCount { poses: i + 1, views: self.views.len() })?;
        let unpacked = match &kept.content {
            Content::Plain(plain) => return Ok(Cow::Borrowed(&plain.segmentation.defects)),
            Content::Packed(packed) => packed.unpack_defects(&packed.bytes),
            Content::Spilled(packed, place) => self.read(*place).and_then(|bytes| packed.unpack_defects(&bytes)),
        };
        unpacked.map(Cow::Owned).map_err(|source| FuseError::Keep { view: kept.index, source })
    }

    /// The pictures of view `i`: cheaper than [`Self::restore`], which fits normals again.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if it cannot be read back.
    pub fn picture(&self, i: usize) -> Result<KeptPicture<'_>, FuseError> {
        let kept = self.views.get(i).ok_or(FuseError::PoseCount { poses: i + 1, views: self.views.len() })?;
        let (index, table_from_camera) = (kept.index, kept.table_from_camera);
        let unpacked = match &kept.content {
            Content::Plain(plain) => {
                return Ok(KeptPicture { depth: self.depth(i)?, rgb: plain.rgb.clone(), is_whole: true });
            }
            Content::Packed(packed) => packed.unpack_picture(&packed.bytes),
            Content::Spilled(packed, place) => self.read(*place).and_then(|bytes| packed.unpack_picture(&bytes)),
        };
        let (intrinsics, metres, rgb) = unpacked.map_err(|source| FuseError::Keep { view: index, source })?;
        let depth = KeptDepth { index, intrinsics, metres: Cow::Owned(metres), table_from_camera };
        Ok(KeptPicture { depth, rgb: Arc::new(rgb), is_whole: false })
    }

    /// Notes the poses of a rebuild, one a view.
    pub(super) fn set_poses(&mut self, poses: &[Isometry3<f64>]) {
        for (kept, pose) in self.views.iter_mut().zip(poses) {
            kept.table_from_camera = *pose;
        }
    }

    fn read(&self, (offset, length): (u64, usize)) -> std::io::Result<Vec<u8>> {
        let mut file =
            self.spill.as_ref().ok_or_else(|| Error::new(ErrorKind::NotFound, "the file of kept views is gone"))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = vec![0; length];
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl PlainView {
    fn of(view: &LabelledView) -> Self {
        let segmentation = &view.segmentation;
        Self {
            intrinsics: view.cloud.intrinsics,
            metres: view.cloud.depth.clone(),
            rgb: view.rgb.clone(),
            segmentation: Segmentation {
                components: segmentation.components.clone(),
                defects: segmentation.defects.clone(),
                instances: segmentation.instances.clone(),
                network: None,
            },
        }
    }

    /// Bytes that keeping `view` takes.
    fn bytes_of(view: &LabelledView) -> usize {
        bytes(&view.cloud.depth, &view.rgb, &view.segmentation)
    }

    fn bytes(&self) -> usize {
        bytes(&self.metres, &self.rgb, &self.segmentation)
    }

    /// View `index` at the pose `table_from_camera`; what is fitted to its depth is fitted again.
    fn view(&self, index: u32, table_from_camera: Isometry3<f64>) -> LabelledView {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let depth = DepthImage { width, height, metres: self.metres.clone() };
        LabelledView {
            index,
            cloud: OrganizedCloud::new(self.intrinsics, &depth, None),
            rgb: self.rgb.clone(),
            segmentation: self.segmentation.clone(),
            table_from_camera,
        }
    }
}

fn bytes(metres: &[f32], rgb: &RgbImage, segmentation: &Segmentation) -> usize {
    let Segmentation { components, defects, instances, .. } = segmentation;
    size_of_val(metres) + rgb.as_raw().len() + components.bytes() + defects.bytes() + size_of_val(instances.as_slice())
}
