//! The messages of a file from the first to the last whole one, without the index at its end: of a recording that was cut off,
//! everything before the cut is there.

use mcap::McapResult;
use mcap::records::{Channel, ChunkHeader, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::io::Read;

/// Largest content of a chunk, bytes.
const LARGEST_CHUNK: u64 = 1 << 30;

/// A message and what its channel says of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Message<'a> {
    pub(crate) topic: &'a str,
    /// Full name of its type.
    pub(crate) schema: &'a str,
    /// How it is encoded: `protobuf`, `cdr`, `json`.
    pub(crate) encoding: &'a str,
    pub(crate) data: &'a [u8],
}

/// What of a file could not be read.
#[derive(Debug, Default)]
pub(crate) struct Missing {
    /// Whether it ends in the middle.
    pub(crate) is_cut: bool,
    /// Chunks that are damaged, or compressed in a way that is not read.
    pub(crate) chunks: u32,
}

/// Schemas and channels by their numbers, as far as they have been read.
#[derive(Default)]
struct Known {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

/// Shows every message to `see`; what of the file could not be read.
///
/// # Errors
/// That of the first record, if not even this can be read.
pub(crate) fn each(bytes: &[u8], mut see: impl FnMut(Message<'_>)) -> McapResult<Missing> {
    let (mut known, mut records, mut chunks) = (Known::default(), 0_u64, 0_u32);
    let options = LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(bytes.len());
    let end = each_record(bytes, options, &mut |record| {
        records += 1;
        match record {
            Record::Chunk { header, data } => match decompressed(&header, &data) {
                Some(content) => chunks += u32::from(each_in_chunk(&content, &mut known, &mut see).is_err()),
                None => chunks += 1,
            },
            other => known.take(other, &mut see),
        }
    });
    match end {
        Err(error) if records == 0 => Err(error),
        end => Ok(Missing { is_cut: end.is_err(), chunks }),
    }
}

fn each_in_chunk(content: &[u8], known: &mut Known, see: &mut impl FnMut(Message<'_>)) -> McapResult<()> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_record_length_limit(content.len());
    each_record(content, options, &mut |record| known.take(record, see))
}

/// Shows every record of `bytes` to `see`.
fn each_record(bytes: &[u8], options: LinearReaderOptions, see: &mut dyn FnMut(Record<'_>)) -> McapResult<()> {
    let mut reader = LinearReader::new_with_options(options);
    let mut rest = bytes;
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let given = wanted.min(rest.len());
                reader.insert(given)[..given].copy_from_slice(&rest[..given]);
                reader.notify_read(given);
                rest = &rest[given..];
            }
            LinearReadEvent::Record { data, opcode } => see(mcap::parse_record(opcode, data)?),
        }
    }
    Ok(())
}

impl Known {
    fn take(&mut self, record: Record<'_>, see: &mut impl FnMut(Message<'_>)) {
        match record {
            Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
            Record::Channel(channel) => drop(self.channels.insert(channel.id, channel)),
            Record::Message { header, data } => {
                let Some(channel) = self.channels.get(&header.channel_id) else { return };
                see(Message {
                    topic: &channel.topic,
                    schema: self.schemas.get(&channel.schema_id).map_or("", String::as_str),
                    encoding: &channel.message_encoding,
                    data: &data,
                });
            }
            _ => {}
        }
    }
}

/// The content of a chunk; `None` where it is damaged or compressed in another way.
fn decompressed(header: &ChunkHeader, data: &[u8]) -> Option<Vec<u8>> {
    let size = Some(header.uncompressed_size).filter(|size| *size <= LARGEST_CHUNK)?;
    let mut content = Vec::new();
    // Memory is taken as the content comes, never more than one byte beyond what is said.
    match header.compression.as_str() {
        "" | "none" => content.extend_from_slice(data),
        "lz4" => drop(lz4_flex::frame::FrameDecoder::new(data).take(size + 1).read_to_end(&mut content).ok()?),
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(data).ok()?;
            decoder.take(size + 1).read_to_end(&mut content).ok()?;
        }
        _ => return None,
    }
    let is_whole = content.len() as u64 == size;
    let is_right = header.uncompressed_crc == 0 || crc32fast::hash(&content) == header.uncompressed_crc;
    (is_whole && is_right).then_some(content)
}
