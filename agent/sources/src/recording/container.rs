//! What the files have in common that recordings lie in: messages of channels one after the other, each of which can be found
//! again by its place.

use crate::messages::{Encoding, Kind, Stamp, of_channel};
use semascan_inspection::source::SourceError;
use std::path::Path;

/// Most bytes of a message, or of what a chunk of compressed messages holds.
pub(crate) const LARGEST: u64 = 1 << 30;

/// A file that is not what it should be, and why.
pub(crate) fn format_error(path: &Path, reason: impl Into<String>) -> SourceError {
    SourceError::Format { path: path.to_owned(), reason: reason.into() }
}

/// A file that the system cannot read.
pub(crate) fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> SourceError + '_ {
    move |source| SourceError::Io { path: path.to_owned(), source }
}

/// A stream of messages of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    /// Name of the type, as the file has it.
    pub(crate) type_name: String,
    /// Kind and encoding of messages that are decoded; `None` for others.
    pub(crate) decoded: Option<(Kind, Encoding)>,
}

impl Channel {
    pub(crate) fn new(topic: &str, type_name: &str, encoding: &str) -> Self {
        Self { topic: topic.to_owned(), type_name: type_name.to_owned(), decoded: of_channel(type_name, encoding) }
    }
}

/// Where a message lies in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Where the block begins that holds it: a chunk, a row of a table.
    pub(crate) block: u64,
    /// Where it begins in the block.
    pub(crate) offset: usize,
    /// Its bytes.
    pub(crate) length: usize,
}

/// A message that was come by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found<'a> {
    /// When it was recorded.
    pub(crate) logged: Stamp,
    pub(crate) place: Place,
    pub(crate) message: &'a [u8],
}

/// How a file ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// As its writer ended it.
    Whole,
    /// It was cut or is damaged; what stands in front of that was read.
    Cut(String),
}

/// What takes the messages of a file, one after the other.
pub(crate) type Visit<'a> = dyn FnMut(&Channel, Found<'_>) + 'a;

/// A file that a recording lies in.
pub(crate) trait Container: Send {
    /// The file.
    fn path(&self) -> &Path;

    /// Shows every message of a channel that is decoded, in the order of the file.
    ///
    /// # Errors
    /// [`SourceError`] where the file is not what it should be from its beginning on.
    fn scan(&mut self, visit: &mut Visit<'_>) -> Result<End, SourceError>;

    /// The message at a place that [`scan`](Self::scan) named.
    ///
    /// # Errors
    /// [`SourceError`] where the file has changed since, or cannot be read.
    fn read(&mut self, place: Place) -> Result<Vec<u8>, SourceError>;
}
