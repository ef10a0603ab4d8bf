//! MCAP files of any writer (<https://mcap.dev/spec>): records from the first to the last, without the index at the end, so
//! that a file whose writer was killed is read to its last whole record.

use super::blocks::{Blocks, CHANGED, Compression};
use super::container::{Channel, Container, End, Found, LARGEST, Place, Visit, format_error};
use crate::messages::fields::Fields;
use crate::messages::{MessageError, Stamp};
use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;
use std::path::Path;

/// The first bytes of the file.
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Bytes in front of a record: its kind and its length.
const RECORD_HEADER: usize = 9;
/// Bytes of the length of a text.
const LENGTH: u64 = 4;
/// Bytes of a message record in front of the message: channel, sequence, two times.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;
/// A place in no chunk.
const NO_CHUNK: u64 = 0;

/// Kinds of records.
mod opcode {
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const METADATA: u8 = 0x0c;
    pub(super) const DATA_END: u8 = 0x0f;
}

/// What comes first in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FirstContent {
    /// The metadata that were asked for.
    Metadata,
    /// Messages.
    Messages,
    /// Neither, to the end of the file.
    Nothing,
}

/// An MCAP file.
#[derive(Debug)]
pub(crate) struct McapFile {
    blocks: Blocks,
}

/// What the records so far say of schemas and channels.
#[derive(Debug, Default)]
struct Known {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

/// A chunk that was decompressed, and what is wrong with it.
type Chunk = Result<Vec<u8>, String>;

impl McapFile {
    pub(crate) fn open(path: &Path) -> Result<Self, SourceError> {
        let mut blocks = Blocks::open(path)?;
        if blocks.piece(0, MAGIC.len() as u64)?.as_deref() != Some(MAGIC) {
            return Err(format_error(path, "is no MCAP file"));
        }
        Ok(Self { blocks })
    }

    /// What comes first in the file at `path`: metadata called `name`, as one program writes in front of its messages, or
    /// messages.
    pub(crate) fn first_content(path: &Path, name: &str) -> FirstContent {
        let Ok(mut file) = Self::open(path) else { return FirstContent::Nothing };
        let mut offset = MAGIC.len() as u64;
        while let Ok(Some((kind, length))) = file.record(offset) {
            let body = offset + RECORD_HEADER as u64;
            match kind {
                opcode::MESSAGE | opcode::CHUNK => return FirstContent::Messages,
                opcode::DATA_END => break,
                opcode::METADATA => match file.blocks.piece(body, length.min(LENGTH + name.len() as u64)) {
                    Ok(Some(start)) if Fields::packed(&start).text("name") == Ok(name) => {
                        return FirstContent::Metadata;
                    }
                    _ => {}
                },
                _ => {}
            }
            offset = body.saturating_add(length);
        }
        FirstContent::Nothing
    }

    /// Kind and length of the record at `offset`; `None` where the file ends within its header.
    fn record(&mut self, offset: u64) -> Result<Option<(u8, u64)>, SourceError> {
        let header = self.blocks.piece(offset, RECORD_HEADER as u64)?;
        Ok(header.as_deref().and_then(|header| {
            let mut fields = Fields::packed(header);
            fields.u8("kind").ok().zip(fields.u64("length").ok())
        }))
    }

    /// The content of the chunk whose record's body is at `offset`.
    fn chunk(&mut self, offset: u64, length: u64) -> Result<Option<Chunk>, SourceError> {
        let Some(body) = self.blocks.piece(offset, length)? else { return Ok(None) };
        Ok(Some(decompress(body)))
    }
}

/// The content of a chunk.
fn decompress(mut body: Vec<u8>) -> Chunk {
    let named = |error: MessageError| format!("a chunk is damaged: {error}");
    let mut fields = Fields::packed(&body);
    fields.u64("message_start_time").and_then(|_| fields.u64("message_end_time")).map_err(named)?;
    let size = fields.u64("uncompressed_size").map_err(named)?;
    let checksum = fields.u32("uncompressed_crc").map_err(named)?;
    let name = fields.text("compression").map_err(named)?.to_owned();
    let length = fields.u64("records").map_err(named)?;
    if length != fields.remaining() as u64 {
        return Err("a chunk does not have the length that it says".to_owned());
    }
    let at = fields.at();
    let compression =
        Compression::of_name(&name).ok_or_else(|| format!("chunks compressed with {name:?} are not read"))?;
    let content = compression.decompress(body.split_off(at), size)?;
    if checksum != 0 && checksum != crc32fast::hash(&content) {
        return Err("the checksum of a chunk is wrong: it is damaged".to_owned());
    }
    Ok(content)
}

impl Known {
    /// Takes one record in, and shows it if it is a message. `start` is where its body begins in the block.
    fn record(
        &mut self,
        kind: u8,
        body: &[u8],
        (block, start): (u64, usize),
        visit: &mut Visit<'_>,
    ) -> Result<(), MessageError> {
        let mut fields = Fields::packed(body);
        match kind {
            opcode::SCHEMA => {
                let id = fields.u16("id")?;
                self.schemas.insert(id, fields.text("name")?.to_owned());
            }
            opcode::CHANNEL => {
                let (id, schema) = (fields.u16("id")?, fields.u16("schema_id")?);
                let (topic, encoding) = (fields.text("topic")?, fields.text("message_encoding")?);
                let type_name = self.schemas.get(&schema).map_or("", String::as_str);
                self.channels.insert(id, Channel::new(topic, type_name, encoding));
            }
            opcode::MESSAGE => {
                let channel = fields.u16("channel_id")?;
                fields.u32("sequence")?;
                let logged = i64::try_from(fields.u64("log_time")?).unwrap_or(i64::MAX);
                fields.u64("publish_time")?;
                let message = body.get(MESSAGE_HEADER..).unwrap_or_default();
                if let Some(channel) = self.channels.get(&channel).filter(|channel| channel.decoded.is_some()) {
                    let place = Place { block, offset: start + MESSAGE_HEADER, length: message.len() };
                    visit(channel, Found { logged: Stamp { nanoseconds: logged }, place, message });
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes in every record of a chunk that is kept at `block`.
    fn records(&mut self, content: &[u8], block: u64, visit: &mut Visit<'_>) -> Result<(), MessageError> {
        let mut fields = Fields::packed(content);
        while fields.remaining() > 0 {
            let kind = fields.u8("kind")?;
            let length = usize::try_from(fields.u64("length")?).unwrap_or(usize::MAX);
            let start = fields.at();
            self.record(kind, fields.take(length, "record")?, (block, start), visit)?;
        }
        Ok(())
    }
}

impl Container for McapFile {
    fn path(&self) -> &Path {
        self.blocks.path()
    }

    fn scan(&mut self, visit: &mut Visit<'_>) -> Result<End, SourceError> {
        let mut known = Known::default();
        let mut offset = MAGIC.len() as u64;
        let cut = |reason: String| Ok(End::Cut(reason));
        loop {
            let Some((kind, length)) = self.record(offset)? else { return cut("it ends between two records".into()) };
            let body = offset + RECORD_HEADER as u64;
            let is_inside = body.checked_add(length).is_some_and(|end| end <= self.blocks.length());
            if !is_inside {
                return cut("it ends within a record".into());
            }
            let read = match kind {
                opcode::DATA_END => return Ok(End::Whole),
                opcode::CHUNK if length > LARGEST => return cut(format!("a chunk has {length} bytes")),
                opcode::CHUNK => match self.chunk(body, length)? {
                    None => return cut("it ends within a chunk".into()),
                    Some(Err(reason)) => return cut(reason),
                    Some(Ok(content)) => known.records(&content, offset, visit),
                },
                opcode::SCHEMA | opcode::CHANNEL | opcode::MESSAGE if length <= LARGEST => {
                    match self.blocks.piece(body, length)? {
                        None => return cut("it ends within a record".into()),
                        // In no chunk the place is that in the file.
                        Some(bytes) => {
                            let start = usize::try_from(body).unwrap_or(usize::MAX - MESSAGE_HEADER);
                            known.record(kind, &bytes, (NO_CHUNK, start), visit)
                        }
                    }
                }
                _ => Ok(()),
            };
            if let Err(error) = read {
                return cut(format!("a record is damaged: {error}"));
            }
            offset = body + length;
        }
    }

    fn read(&mut self, place: Place) -> Result<Vec<u8>, SourceError> {
        if place.block == NO_CHUNK {
            return self.blocks.known_piece(place.offset as u64, place.length as u64);
        }
        let record = self.record(place.block)?;
        let (_, length) = record.ok_or_else(|| format_error(self.blocks.path(), CHANGED))?;
        self.blocks.part(place.block, (place.offset, place.length), |blocks| {
            let body = blocks.known_piece(place.block + RECORD_HEADER as u64, length)?;
            decompress(body).map_err(|reason| format_error(blocks.path(), reason))
        })
    }
}
