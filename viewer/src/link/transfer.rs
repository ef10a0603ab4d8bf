//! How an event crosses from the worker to the page: as one block of bytes, which becomes one transferred `ArrayBuffer`.
//!
//! Layout, little endian: one byte of kind, three of padding, then the body. Control messages keep their Protocol
//! Buffers form. A chunk is a header and its columns one after the other in the order of [`SemanticCloud`]'s fields, so
//! that both sides copy memory and parse nothing. Both ends are the same build: the layout is no public contract, but
//! lengths are checked all the same.

use super::{DecodedChunk, LinkEvent};
use crate::columns;
use prost::Message;
use semascan_model::{PointFlags, SemanticCloud};
use semascan_protocol as wire;

/// Why a block could not be read.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum TransferError {
    /// It ends too early or holds more than it says.
    #[error("block of {0} bytes does not fit its content")]
    Length(usize),
    /// It begins with an unknown kind.
    #[error("unknown kind {0}")]
    Kind(u8),
    /// Its message is broken.
    #[error("broken message: {0}")]
    Message(String),
}

mod kind {
    pub(super) const CONNECTING: u8 = 1;
    pub(super) const CONNECTED: u8 = 2;
    pub(super) const DISCONNECTED: u8 = 3;
    pub(super) const REFUSED: u8 = 4;
    pub(super) const CLEARED: u8 = 5;
    pub(super) const PROGRESS: u8 = 6;
    pub(super) const STAGE: u8 = 7;
    pub(super) const VIEW: u8 = 8;
    pub(super) const CHUNK: u8 = 9;
    pub(super) const GONE: u8 = 10;
    pub(super) const MALFORMED: u8 = 11;
}

/// Bytes of a point over all columns.
const POINT_BYTES: usize = 12 + 12 + 3 + 2 + 4 + 2 + 4 + 4 + 4 + 2 + 2 + 2;

/// Bytes of a chunk before its columns.
const CHUNK_HEADER: usize = 4 + 12 + 4 + 4 + 4 + 8 + 4;

/// An event as bytes.
pub fn encode(event: &LinkEvent) -> Vec<u8> {
    let block = |kind: u8, body: &[u8]| {
        let mut bytes = vec![kind, 0, 0, 0];
        bytes.extend_from_slice(body);
        bytes
    };
    match event {
        LinkEvent::Connecting { attempt } => block(kind::CONNECTING, &attempt.to_le_bytes()),
        LinkEvent::Connected { inspection, resumed, agent } => {
            let welcome = wire::Welcome {
                agent: agent.clone(),
                capabilities: Vec::new(),
                inspection: Some(inspection.clone()),
                resumed: *resumed,
            };
            block(kind::CONNECTED, &welcome.encode_to_vec())
        }
        LinkEvent::Disconnected { reason, retry_ms } => {
            let mut body = retry_ms.to_le_bytes().to_vec();
            body.extend_from_slice(reason.as_bytes());
            block(kind::DISCONNECTED, &body)
        }
        LinkEvent::Refused { reason } => block(kind::REFUSED, reason.as_bytes()),
        LinkEvent::Cleared(inspection) => block(kind::CLEARED, &inspection.encode_to_vec()),
        LinkEvent::Progress(progress) => block(kind::PROGRESS, &progress.encode_to_vec()),
        LinkEvent::Stage(stage) => block(kind::STAGE, &stage.encode_to_vec()),
        LinkEvent::View(view) => block(kind::VIEW, &view.encode_to_vec()),
        LinkEvent::Chunk(chunk) => encode_chunk(chunk),
        LinkEvent::ChunkGone { id } => block(kind::GONE, bytemuck::cast_slice(id)),
        LinkEvent::Malformed { reason } => block(kind::MALFORMED, reason.as_bytes()),
    }
}

/// The event that `bytes` hold.
///
/// # Errors
/// [`TransferError`] if they are not what [`encode`] makes.
pub fn decode(bytes: &[u8]) -> Result<LinkEvent, TransferError> {
    let mut reader = Reader { rest: bytes, total: bytes.len() };
    let [kind, ..] = reader.array::<4>()?;
    Ok(match kind {
        kind::CONNECTING => LinkEvent::Connecting { attempt: u32::from_le_bytes(reader.array()?) },
        kind::CONNECTED => {
            let welcome: wire::Welcome = message(reader.rest)?;
            LinkEvent::Connected {
                inspection: welcome.inspection.unwrap_or_default(),
                resumed: welcome.resumed,
                agent: welcome.agent,
            }
        }
        kind::DISCONNECTED => {
            let retry_ms = u32::from_le_bytes(reader.array()?);
            LinkEvent::Disconnected { reason: text(reader.rest), retry_ms }
        }
        kind::REFUSED => LinkEvent::Refused { reason: text(reader.rest) },
        kind::CLEARED => LinkEvent::Cleared(message(reader.rest)?),
        kind::PROGRESS => LinkEvent::Progress(message(reader.rest)?),
        kind::STAGE => LinkEvent::Stage(message(reader.rest)?),
        kind::VIEW => LinkEvent::View(message(reader.rest)?),
        kind::CHUNK => LinkEvent::Chunk(decode_chunk(&mut reader)?),
        kind::GONE => LinkEvent::ChunkGone { id: reader.id()? },
        kind::MALFORMED => LinkEvent::Malformed { reason: text(reader.rest) },
        other => return Err(TransferError::Kind(other)),
    })
}

fn encode_chunk(chunk: &DecodedChunk) -> Vec<u8> {
    let cloud = &chunk.cloud;
    let mut bytes = Vec::with_capacity(CHUNK_HEADER + cloud.len() * POINT_BYTES);
    bytes.extend_from_slice(&[kind::CHUNK, 0, 0, 0]);
    bytes.extend_from_slice(bytemuck::cast_slice(&chunk.id));
    bytes.extend_from_slice(&chunk.revision.to_le_bytes());
    bytes.extend_from_slice(&chunk.epoch.to_le_bytes());
    bytes.extend_from_slice(&chunk.voxel.to_le_bytes());
    bytes.extend_from_slice(&chunk.hash.to_le_bytes());
    bytes.extend_from_slice(&(cloud.len() as u32).to_le_bytes());
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.positions));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.normals));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.colors));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.labels));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.confidence));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.defects));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.defect_confidence));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.sigma));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.defect_sigma));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.instances));
    bytes.extend_from_slice(bytemuck::cast_slice(&cloud.views));
    let flags: Vec<u16> = cloud.flags.iter().map(|f| f.0).collect();
    bytes.extend_from_slice(bytemuck::cast_slice(&flags));
    bytes
}

fn decode_chunk(reader: &mut Reader<'_>) -> Result<DecodedChunk, TransferError> {
    let id = reader.id()?;
    let revision = u32::from_le_bytes(reader.array()?);
    let epoch = u32::from_le_bytes(reader.array()?);
    let voxel = f32::from_le_bytes(reader.array()?);
    let hash = u64::from_le_bytes(reader.array()?);
    let n = u32::from_le_bytes(reader.array()?) as usize;
    if reader.rest.len() != n.saturating_mul(POINT_BYTES) {
        return Err(TransferError::Length(reader.total));
    }
    let cloud = SemanticCloud {
        positions: reader.column(n)?,
        normals: reader.column(n)?,
        colors: reader.column(n)?,
        labels: reader.column(n)?,
        confidence: reader.column(n)?,
        defects: reader.column(n)?,
        defect_confidence: reader.column(n)?,
        sigma: reader.column(n)?,
        defect_sigma: reader.column(n)?,
        instances: reader.column(n)?,
        views: reader.column(n)?,
        flags: reader.column::<u16>(n)?.into_iter().map(PointFlags).collect(),
    };
    Ok(DecodedChunk { id, revision, epoch, voxel, hash, cloud })
}

fn message<M: Message + Default>(bytes: &[u8]) -> Result<M, TransferError> {
    M::decode(bytes).map_err(|e| TransferError::Message(e.to_string()))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

struct Reader<'a> {
    rest: &'a [u8],
    total: usize,
}

impl Reader<'_> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], TransferError> {
        let (head, rest) = self.rest.split_first_chunk().ok_or(TransferError::Length(self.total))?;
        self.rest = rest;
        Ok(*head)
    }

    fn id(&mut self) -> Result<[i32; 3], TransferError> {
        Ok(bytemuck::cast(self.array::<12>()?))
    }

    fn column<T: bytemuck::Pod>(&mut self, n: usize) -> Result<Vec<T>, TransferError> {
        columns::take(&mut self.rest, n).ok_or(TransferError::Length(self.total))
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use semascan_model::SemanticPoint;

    fn chunk(n: usize) -> DecodedChunk {
        let point = |i: usize| SemanticPoint {
            position: [i as f32, -1.5, 0.25],
            normal: [0.0, 0.0, 1.0],
            color: [i as u8, 2, 3],
            label: i as u16,
            confidence: 0.5,
            defect: 1,
            defect_confidence: 0.25,
            sigma: 0.125,
            defect_sigma: 0.75,
            instance: 9,
            views: 4,
            flags: PointFlags(PointFlags::BACKGROUND),
        };
        DecodedChunk {
            id: [-1, 2, i32::MIN],
            revision: 7,
            epoch: 3,
            voxel: 0.001,
            hash: u64::MAX - 1,
            cloud: (0..n).map(point).collect(),
        }
    }

    fn round_trip(event: &LinkEvent) -> LinkEvent {
        decode(&encode(event)).expect("what was encoded decodes")
    }

    #[test]
    fn chunks_cross_unchanged() {
        for n in [0, 1, 5, 300] {
            let sent = chunk(n);
            let LinkEvent::Chunk(got) = round_trip(&LinkEvent::Chunk(sent.clone())) else { panic!("not a chunk") };
            assert_eq!(
                (got.id, got.revision, got.epoch, got.voxel, got.hash, got.cloud),
                (sent.id, sent.revision, sent.epoch, sent.voxel, sent.hash, sent.cloud)
            );
        }
    }

    #[test]
    fn every_control_event_crosses_unchanged() {
        let inspection =
            wire::Inspection { id: "a".into(), epoch: 2, part: "ß".into(), ..wire::Inspection::default() };
        let events = [
            LinkEvent::Connecting { attempt: 3 },
            LinkEvent::Connected { inspection: inspection.clone(), resumed: true, agent: "x 1".into() },
            LinkEvent::Disconnected { reason: "gone".into(), retry_ms: 250 },
            LinkEvent::Refused { reason: "no".into() },
            LinkEvent::Cleared(inspection),
            LinkEvent::Progress(wire::Progress { points: 5, model_hash: 9, ..wire::Progress::default() }),
            LinkEvent::Stage(wire::StageEvent { view: 1, duration_us: 2, ..wire::StageEvent::default() }),
            LinkEvent::View(wire::ViewReport { index: 4, thumbnail_jpeg: vec![1, 2], ..wire::ViewReport::default() }),
            LinkEvent::ChunkGone { id: [1, -2, 3] },
            LinkEvent::Malformed { reason: "field".into() },
        ];
        for event in events {
            assert_eq!(format!("{:?}", round_trip(&event)), format!("{event:?}"));
        }
    }

    #[test]
    fn cut_or_padded_chunks_are_refused() {
        let bytes = encode(&LinkEvent::Chunk(chunk(4)));
        for end in 0..bytes.len() {
            assert!(decode(&bytes[..end]).is_err(), "{end}");
        }
        let longer = [bytes.as_slice(), &[0]].concat();
        assert!(matches!(decode(&longer), Err(TransferError::Length(_))));
        assert_eq!(decode(&[99, 0, 0, 0]).err(), Some(TransferError::Kind(99)));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&bytes);
        }
    }
}
