//! The captured views of one inspection, kept as they came from the source.

use super::PortError;
use crate::event::ProcessedView;
use crate::source::SourceError;
use semascan_perception::view::View;

/// Keeps the views of one inspection.
pub trait Captures: Send {
    /// Views that are kept, those that the source could not give included.
    fn views(&self) -> u32;

    /// Takes the source's next view in, or why it could not give it, with the settings that it names by now. Durable after
    /// the next [`sync`](Self::sync).
    ///
    /// # Errors
    /// [`PortError`] naming the file; the view was not taken in.
    fn append(&mut self, view: &Result<View, SourceError>, settings: &[(String, String)]) -> Result<(), PortError>;

    /// Takes in what the inspection said of the pixels of its `index`-th view.
    ///
    /// # Errors
    /// As [`append`](Self::append).
    fn append_segmentation(&mut self, index: u32, view: &ProcessedView) -> Result<(), PortError>;

    /// Makes durable what was taken in. After a failure nothing is lost, and it may be tried again.
    ///
    /// # Errors
    /// [`PortError`] naming the file.
    fn sync(&mut self) -> Result<(), PortError>;

    /// Ends: nothing is taken in any more.
    ///
    /// # Errors
    /// As [`sync`](Self::sync).
    fn finish(&mut self) -> Result<(), PortError>;
}
