//! Views kept for rebuilds: packed without loss, in memory up to a limit, on disk past it.

use super::error::FuseError;
use super::labelled_view::LabelledView;
use super::view_codec::{PackedView, pack};
use nalgebra::Isometry3;
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Seek, SeekFrom, Write};

/// A view and where its bytes went, if not to memory: offset and length in the spill file.
#[derive(Debug)]
struct Kept {
    view: PackedView,
    spilled: Option<(u64, usize)>,
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
    /// Holds up to `limit` packed bytes in memory; what comes after goes to an unnamed temporary file.
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

    /// The poses that the views were integrated with, or last rebuilt with, in order.
    pub fn poses(&self) -> Vec<Isometry3<f64>> {
        self.views.iter().map(|v| v.view.table_from_camera).collect()
    }

    /// Positions of the kept views in the capture order.
    pub fn indices(&self) -> Vec<u32> {
        self.views.iter().map(|v| v.view.index).collect()
    }

    /// Packed bytes in memory.
    pub fn bytes_in_memory(&self) -> usize {
        self.in_memory
    }

    /// Packed bytes on disk.
    pub fn bytes_on_disk(&self) -> usize {
        self.views.iter().filter_map(|v| v.spilled).map(|(_, len)| len).sum()
    }

    /// Packs a view, for [`Self::keep`].
    pub(super) fn pack(view: &LabelledView) -> Result<PackedView, FuseError> {
        pack(view).map_err(|source| FuseError::Keep { view: view.index, source })
    }

    /// Keeps a packed view.
    ///
    /// # Errors
    /// [`FuseError::Keep`] if the disk is full.
    pub(super) fn keep(&mut self, mut view: PackedView) -> Result<(), FuseError> {
        let bytes = std::mem::take(&mut view.bytes);
        let spilled = if self.in_memory + bytes.len() <= self.limit {
            self.in_memory += bytes.len();
            view.bytes = bytes;
            None
        } else {
            let index = view.index;
            Some(self.spill(&bytes).map_err(|source| FuseError::Keep { view: index, source })?)
        };
        self.views.push(Kept { view, spilled });
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
        self.unpack(kept).map_err(|source| FuseError::Keep { view: kept.view.index, source })
    }

    /// Notes the poses of a rebuild, one a view.
    pub(super) fn set_poses(&mut self, poses: &[Isometry3<f64>]) {
        for (kept, pose) in self.views.iter_mut().zip(poses) {
            kept.view.table_from_camera = *pose;
        }
    }

    fn unpack(&self, kept: &Kept) -> std::io::Result<LabelledView> {
        let Some((offset, len)) = kept.spilled else { return kept.view.unpack(&kept.view.bytes) };
        let mut file =
            self.spill.as_ref().ok_or_else(|| Error::new(ErrorKind::NotFound, "the file of kept views is gone"))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = vec![0; len];
        file.read_exact(&mut bytes)?;
        kept.view.unpack(&bytes)
    }
}
