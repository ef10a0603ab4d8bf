//! Files of records and compressed chunks, which MCAP files and ROS 1 bags both are: pieces of the file at an offset, chunks
//! that are decompressed once and kept while their messages are asked for.

use super::container::{LARGEST, format_error, io_error};
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Chunks that stay decompressed: those of a colour and of a depth picture, and of the two in front of them.
const KEPT: usize = 4;
/// What is said of a file whose pieces are not where they were.
pub(crate) const CHANGED: &str = "has changed while it was read";

/// A file of which pieces are read.
#[derive(Debug)]
pub(crate) struct Blocks {
    path: PathBuf,
    file: File,
    length: u64,
    kept: Vec<(u64, Vec<u8>)>,
}

/// How a chunk is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    Zstd,
    Lz4,
    Bz2,
}

impl Compression {
    /// By the name that the file gives it.
    pub(crate) fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "" | "none" => Self::None,
            "zstd" => Self::Zstd,
            "lz4" => Self::Lz4,
            "bz2" => Self::Bz2,
            _ => return None,
        })
    }

    /// The content of a chunk, which must have `size` bytes. Memory is taken as the content comes, never more than that.
    pub(crate) fn decompress(self, data: Vec<u8>, size: u64) -> Result<Vec<u8>, String> {
        if size > LARGEST {
            return Err(format!("a chunk of {size} bytes is larger than the {LARGEST} that are read"));
        }
        let content = match self {
            Self::None => data,
            Self::Zstd => {
                let decoder = zstd::stream::read::Decoder::new(data.as_slice()).map_err(|error| error.to_string())?;
                read_all(decoder, size)?
            }
            Self::Lz4 => read_all(lz4_flex::frame::FrameDecoder::new(data.as_slice()), size)?,
            Self::Bz2 => read_all(bzip2::read::BzDecoder::new(data.as_slice()), size)?,
        };
        if content.len() as u64 != size {
            return Err(format!("a chunk has {} bytes of {size}", content.len()));
        }
        Ok(content)
    }
}

/// All that a decoder gives, up to one byte more than `size`.
fn read_all(decoder: impl Read, size: u64) -> Result<Vec<u8>, String> {
    let mut content = Vec::new();
    decoder.take(size + 1).read_to_end(&mut content).map_err(|error| format!("a chunk is damaged: {error}"))?;
    Ok(content)
}

impl Blocks {
    pub(crate) fn open(path: &Path) -> Result<Self, SourceError> {
        let file = regular_file::open(path).map_err(io_error(path))?;
        let length = file.metadata().map_err(io_error(path))?.len();
        Ok(Self { path: path.to_owned(), file, length, kept: Vec::new() })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// A piece of the file that was there when it was looked through.
    pub(crate) fn known_piece(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, SourceError> {
        let piece = self.piece(offset, length)?;
        piece.ok_or_else(|| format_error(&self.path, CHANGED))
    }

    /// A piece of the file; `None` where it ends before that.
    pub(crate) fn piece(&mut self, offset: u64, length: u64) -> Result<Option<Vec<u8>>, SourceError> {
        let is_inside = offset.checked_add(length).is_some_and(|end| end <= self.length);
        if !is_inside {
            return Ok(None);
        }
        if length > LARGEST {
            let reason = format!("a record of {length} bytes is larger than the {LARGEST} that are read");
            return Err(format_error(&self.path, reason));
        }
        self.file.seek(SeekFrom::Start(offset)).map_err(io_error(&self.path))?;
        let mut piece = vec![0; length as usize];
        self.file.read_exact(&mut piece).map_err(io_error(&self.path))?;
        Ok(Some(piece))
    }

    /// A part of the chunk at `offset`, which `read` reads and decompresses where it is not kept.
    pub(crate) fn part(
        &mut self,
        offset: u64,
        (start, length): (usize, usize),
        read: impl FnOnce(&mut Self) -> Result<Vec<u8>, SourceError>,
    ) -> Result<Vec<u8>, SourceError> {
        if !self.kept.iter().any(|(kept, _)| *kept == offset) {
            let content = read(self)?;
            if self.kept.len() == KEPT {
                self.kept.remove(0);
            }
            self.kept.push((offset, content));
        }
        let content = self.kept.iter().find(|(kept, _)| *kept == offset).map(|(_, content)| content.as_slice());
        let part = content.and_then(|content| content.get(start..start.checked_add(length)?));
        part.map(<[u8]>::to_vec).ok_or_else(|| format_error(&self.path, CHANGED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn every_compression_gives_its_content_and_no_more() {
        let content = vec![7_u8; 100_000];
        let zstd = zstd::encode_all(content.as_slice(), 3).expect("compressed");
        let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
        lz4.write_all(&content).expect("compressed");
        let lz4 = lz4.finish().expect("compressed");
        let mut bz2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
        bz2.write_all(&content).expect("compressed");
        let bz2 = bz2.finish().expect("compressed");
        for (name, data) in [("", content.clone()), ("zstd", zstd), ("lz4", lz4), ("bz2", bz2)] {
            let compression = Compression::of_name(name).expect(name);
            assert_eq!(compression.decompress(data.clone(), 100_000).as_ref(), Ok(&content), "{name}");
            assert!(compression.decompress(data.clone(), 99_999).is_err(), "{name}: there is more");
            assert!(compression.decompress(data.clone(), u64::MAX).is_err(), "{name}: too much");
            assert!(compression.decompress(data[..data.len() / 2].to_vec(), 100_000).is_err(), "{name}: cut");
        }
        assert_eq!(Compression::of_name("xz"), None);
    }
}
