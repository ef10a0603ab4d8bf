//! ROS 1 bags, version 2.0 (<http://wiki.ros.org/Bags/Format/2.0>): records from the first to the last, without the index, so
//! that a bag that was not closed (`.bag.active`) is read, too.

use super::blocks::{Blocks, CHANGED, Compression};
use super::container::{Channel, Container, End, Found, LARGEST, Place, Visit, format_error};
use crate::messages::fields::Fields;
use crate::messages::{MessageError, Stamp};
use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;
use std::path::Path;

/// The first bytes of the file.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Bytes of a length.
const LENGTH: u64 = 4;
/// A place in no chunk.
const NO_CHUNK: u64 = 0;

/// Kinds of records.
mod op {
    pub(super) const MESSAGE: u8 = 0x02;
    pub(super) const CHUNK: u8 = 0x05;
    pub(super) const CONNECTION: u8 = 0x07;
}

/// A ROS 1 bag.
#[derive(Debug)]
pub(crate) struct Ros1Bag {
    blocks: Blocks,
}

/// What the header of a record says: those of its fields that are used.
#[derive(Clone, Debug, Default)]
struct RecordHeader {
    op: u8,
    connection: u32,
    topic: String,
    stamp: Stamp,
    compression: String,
    /// Bytes of a chunk's content.
    size: u32,
}

/// A record of the file.
struct Record {
    header: Result<RecordHeader, MessageError>,
    /// Where its data begin.
    start: u64,
    /// Bytes of its data.
    length: u64,
}

impl Ros1Bag {
    pub(crate) fn open(path: &Path) -> Result<Self, SourceError> {
        let mut blocks = Blocks::open(path)?;
        if blocks.piece(0, MAGIC.len() as u64)?.as_deref() != Some(MAGIC) {
            return Err(format_error(path, "is no ROS bag of version 2.0"));
        }
        Ok(Self { blocks })
    }

    /// The record at `offset`; `None` where the file ends before it does.
    fn record(&mut self, offset: u64) -> Result<Option<Record>, SourceError> {
        let Some(length) = self.length(offset)? else { return Ok(None) };
        let Some(header) = self.blocks.piece(offset + LENGTH, length)? else { return Ok(None) };
        let Some(data) = self.length(offset + LENGTH + length)? else { return Ok(None) };
        let start = offset + LENGTH + length + LENGTH;
        let is_inside = start.checked_add(data).is_some_and(|end| end <= self.blocks.length());
        Ok(is_inside.then(|| Record { header: RecordHeader::parse(&header), start, length: data }))
    }

    fn length(&mut self, offset: u64) -> Result<Option<u64>, SourceError> {
        let bytes = self.blocks.piece(offset, LENGTH)?;
        Ok(bytes.and_then(|bytes| Fields::packed(&bytes).u32("length").ok()).map(u64::from))
    }
}

impl RecordHeader {
    /// `name=value` one after the other, each with its length in front.
    fn parse(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut header = Self::default();
        for_each_field(bytes, |name, value| {
            let mut number = Fields::packed(value);
            match name {
                b"op" => header.op = number.u8("op")?,
                b"conn" => header.connection = number.u32("conn")?,
                b"topic" => header.topic = String::from_utf8_lossy(value).into_owned(),
                b"time" => header.stamp = number.stamp("time")?,
                b"compression" => header.compression = String::from_utf8_lossy(value).into_owned(),
                b"size" => header.size = number.u32("size")?,
                _ => {}
            }
            Ok(())
        })?;
        Ok(header)
    }
}

/// Calls `take` for each field of a header; what has no `=` is left out.
fn for_each_field(
    bytes: &[u8],
    mut take: impl FnMut(&[u8], &[u8]) -> Result<(), MessageError>,
) -> Result<(), MessageError> {
    let mut fields = Fields::packed(bytes);
    while fields.remaining() > 0 {
        let field = fields.bytes("header")?;
        if let Some(equals) = field.iter().position(|byte| *byte == b'=') {
            let (name, value) = field.split_at(equals);
            take(name, value.get(1..).unwrap_or_default())?;
        }
    }
    Ok(())
}

/// Takes one record in that is no chunk, and shows it if it is a message.
fn take(
    channels: &mut BTreeMap<u32, Channel>,
    header: &RecordHeader,
    data: &[u8],
    (block, offset): (u64, usize),
    visit: &mut Visit<'_>,
) -> Result<(), MessageError> {
    match header.op {
        op::CONNECTION => {
            let mut type_name = String::new();
            for_each_field(data, |name, value| {
                if name == b"type" {
                    type_name = String::from_utf8_lossy(value).into_owned();
                }
                Ok(())
            })?;
            channels.insert(header.connection, Channel::new(&header.topic, &type_name, "ros1"));
        }
        op::MESSAGE => {
            if let Some(channel) = channels.get(&header.connection).filter(|channel| channel.decoded.is_some()) {
                let place = Place { block, offset, length: data.len() };
                visit(channel, Found { logged: header.stamp, place, message: data });
            }
        }
        _ => {}
    }
    Ok(())
}

/// Takes in every record of a chunk's content.
fn take_chunk(
    channels: &mut BTreeMap<u32, Channel>,
    content: &[u8],
    block: u64,
    visit: &mut Visit<'_>,
) -> Result<(), MessageError> {
    let mut fields = Fields::packed(content);
    while fields.remaining() > 0 {
        let header = RecordHeader::parse(fields.bytes("header")?)?;
        let data = fields.bytes("data")?;
        let offset = fields.at() - data.len();
        take(channels, &header, data, (block, offset), visit)?;
    }
    Ok(())
}

/// The content of a chunk.
fn decompress(header: &RecordHeader, data: Vec<u8>) -> Result<Vec<u8>, String> {
    let name = &header.compression;
    let compression =
        Compression::of_name(name).ok_or_else(|| format!("chunks compressed with {name:?} are not read"))?;
    compression.decompress(data, header.size.into())
}

impl Container for Ros1Bag {
    fn path(&self) -> &Path {
        self.blocks.path()
    }

    fn scan(&mut self, visit: &mut Visit<'_>) -> Result<End, SourceError> {
        let mut channels = BTreeMap::new();
        let mut offset = MAGIC.len() as u64;
        let cut = |reason: String| Ok(End::Cut(reason));
        while offset < self.blocks.length() {
            let Some(Record { header, start, length }) = self.record(offset)? else {
                return cut("it ends within a record".into());
            };
            let header = match header {
                Ok(header) => header,
                Err(error) => return cut(format!("a record is damaged: {error}")),
            };
            let is_read = matches!(header.op, op::CHUNK | op::CONNECTION | op::MESSAGE) && length <= LARGEST;
            if is_read {
                let Some(data) = self.blocks.piece(start, length)? else {
                    return cut("it ends within a record".into());
                };
                let taken = if header.op == op::CHUNK {
                    match decompress(&header, data) {
                        Ok(content) => take_chunk(&mut channels, &content, offset, visit),
                        Err(reason) => return cut(reason),
                    }
                } else {
                    let place = usize::try_from(start).unwrap_or(usize::MAX);
                    take(&mut channels, &header, &data, (NO_CHUNK, place), visit)
                };
                if let Err(error) = taken {
                    return cut(format!("a record is damaged: {error}"));
                }
            }
            offset = start + length;
        }
        Ok(End::Whole)
    }

    fn read(&mut self, place: Place) -> Result<Vec<u8>, SourceError> {
        if place.block == NO_CHUNK {
            return self.blocks.known_piece(place.offset as u64, place.length as u64);
        }
        let Some(Record { header: Ok(header), start, length }) = self.record(place.block)? else {
            return Err(format_error(self.blocks.path(), CHANGED));
        };
        self.blocks.part(place.block, (place.offset, place.length), |blocks| {
            let data = blocks.known_piece(start, length)?;
            decompress(&header, data).map_err(|reason| format_error(blocks.path(), reason))
        })
    }
}
