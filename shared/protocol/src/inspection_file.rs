//! An inspection as one file (`.semascan`): the messages of its stream with their times, and what the agent answers about it, so that
//! a viewer without an agent shows what it would show with one. `proto/inspection_file.proto` is the format.
//!
//! The content of messages and answers is checked by whoever reads those; here only that the file is whole.

use super::file_entry::Content;
use super::{FileAnswer, FileEnd, FileEntry, FileMessage, MAX_SERVER_MESSAGE};
use prost::Message;
use prost::bytes::{Buf, Bytes};

/// Ending of the file's name.
pub const FILE_ENDING: &str = "semascan";

/// What every version of the format begins with.
const FAMILY: &[u8] = b"semascan-file-";
/// What this version begins with.
const MAGIC: &[u8] = b"semascan-file-1\n";

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum FileError {
    /// It is something else.
    #[error("it is no inspection of Semascan's")]
    Other,
    /// A later version of the program wrote it.
    #[error("a newer version of Semascan wrote it")]
    Newer,
    /// It does not go on to its end.
    #[error("it is cut off after {0} entries")]
    Cut(u64),
    /// An entry is not what it must be.
    #[error("entry {entry}: {reason}")]
    Entry {
        /// Its number, counted from 0.
        entry: u64,
        /// What is wrong.
        reason: String,
    },
}

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InspectionFile {
    /// The messages of the stream.
    pub messages: Vec<FileMessage>,
    /// What the agent answers.
    pub answers: Vec<FileAnswer>,
}

impl InspectionFile {
    /// What a file begins with.
    pub fn beginning() -> Bytes {
        Bytes::from_static(MAGIC)
    }

    /// The bytes of one entry.
    pub fn entry(content: Content) -> Bytes {
        FileEntry { content: Some(content) }.encode_length_delimited_to_vec().into()
    }

    /// What a file of so many entries ends with.
    pub fn end(entries: u64) -> Bytes {
        Self::entry(Content::End(FileEnd { entries }))
    }

    /// Reads a whole file.
    ///
    /// # Errors
    /// [`FileError`] if it is something else, or broken.
    pub fn read(mut bytes: Bytes) -> Result<Self, FileError> {
        if !bytes.starts_with(MAGIC) {
            return Err(if bytes.starts_with(FAMILY) { FileError::Newer } else { FileError::Other });
        }
        bytes.advance(MAGIC.len());
        let mut file = Self::default();
        let mut count = 0;
        loop {
            let wrong = |reason: String| FileError::Entry { entry: count, reason };
            let length = prost::decode_length_delimiter(&mut bytes).map_err(|_| FileError::Cut(count))?;
            if length > bytes.len() {
                return Err(FileError::Cut(count));
            }
            let entry = FileEntry::decode(bytes.split_to(length)).map_err(|error| wrong(error.to_string()))?;
            match entry.content {
                Some(Content::Message(message)) if message.message.len() > MAX_SERVER_MESSAGE => {
                    return Err(wrong(format!("a message of {} bytes", message.message.len())));
                }
                Some(Content::Message(message)) => file.messages.push(message),
                Some(Content::Answer(answer)) => file.answers.push(answer),
                Some(Content::End(FileEnd { entries })) if entries == count && bytes.is_empty() => return Ok(file),
                Some(Content::End(FileEnd { entries })) => {
                    return Err(wrong(format!("the end of {entries} entries")));
                }
                // What a later version adds to this one can be done without.
                None => {}
            }
            count += 1;
        }
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;

    fn file() -> InspectionFile {
        let message = |views| FileMessage { microseconds: 5, views, message: Bytes::from(vec![7; 9]) };
        let answer =
            FileAnswer { path: "/api/v1/x".into(), media_type: "application/json".into(), body: Bytes::from("{}") };
        InspectionFile { messages: vec![message(0), message(1)], answers: vec![answer] }
    }

    fn written(file: &InspectionFile) -> Vec<u8> {
        let entries: Vec<Bytes> = file
            .messages
            .iter()
            .cloned()
            .map(Content::Message)
            .chain(file.answers.iter().cloned().map(Content::Answer))
            .map(InspectionFile::entry)
            .collect();
        let end = InspectionFile::end(entries.len() as u64);
        [InspectionFile::beginning()].into_iter().chain(entries).chain([end]).flatten().collect()
    }

    fn read(bytes: &[u8]) -> Result<InspectionFile, FileError> {
        InspectionFile::read(Bytes::copy_from_slice(bytes))
    }

    #[test]
    fn what_was_written_is_read() {
        assert_eq!(read(&written(&file())), Ok(file()));
        assert_eq!(read(&written(&InspectionFile::default())), Ok(InspectionFile::default()));
    }

    #[test]
    fn a_file_that_is_not_whole_is_noticed() {
        let whole = written(&file());
        for end in MAGIC.len()..whole.len() {
            assert!(matches!(read(&whole[..end]), Err(FileError::Cut(_))), "{end}");
        }
        assert!(matches!(read(&[whole.as_slice(), &[0]].concat()), Err(FileError::Entry { .. })), "something follows");
        // Without its second entry.
        let shorter = InspectionFile { messages: file().messages[..1].to_vec(), ..file() };
        let head = written(&shorter).len() - InspectionFile::end(2).len();
        let lost = [&written(&shorter)[..head], &InspectionFile::end(3)].concat();
        assert_eq!(read(&lost), Err(FileError::Entry { entry: 2, reason: "the end of 3 entries".into() }));
    }

    #[test]
    fn other_files_are_told_apart() {
        assert_eq!(read(b"ply\n"), Err(FileError::Other));
        assert_eq!(read(b""), Err(FileError::Other));
        assert_eq!(read(b"semascan-file-2\n"), Err(FileError::Newer));
    }

    #[cfg(not(target_arch = "wasm32"))]
    proptest::proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..200)) {
            let _ = read(&[MAGIC, &bytes].concat());
        }
    }
}
