//! The captures of one inspection as a file.

use semascan_captures::{CaptureError, CaptureWriter};
use semascan_inspection::event::ProcessedView;
use semascan_inspection::ports::{Captures, PortError};
use semascan_inspection::source::SourceError;
use semascan_perception::view::View;

/// The port [`Captures`] on a capture file.
pub struct CaptureFile(CaptureWriter);

impl CaptureFile {
    /// The port on `writer`.
    pub fn new(writer: CaptureWriter) -> Self {
        Self(writer)
    }
}

impl Captures for CaptureFile {
    fn views(&self) -> u32 {
        self.0.views()
    }

    fn append(&mut self, view: &Result<View, SourceError>, settings: &[(String, String)]) -> Result<(), PortError> {
        self.0.append(view, settings).map_err(named)
    }

    fn append_segmentation(&mut self, index: u32, view: &ProcessedView) -> Result<(), PortError> {
        self.0.append_segmentation(index, view).map_err(named)
    }

    fn sync(&mut self) -> Result<(), PortError> {
        self.0.sync().map_err(named)
    }

    fn finish(&mut self) -> Result<(), PortError> {
        self.0.finish().map_err(named)
    }
}

pub(super) fn named(error: CaptureError) -> PortError {
    match error {
        CaptureError::Io { path, source } => PortError::of(path.display(), &source),
        CaptureError::Mcap { path, source } => PortError::of(path.display(), &source),
        CaptureError::Format { path, reason } => PortError::new(path.display(), reason),
    }
}
