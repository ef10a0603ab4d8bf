//! How an event crosses from the worker to the page: as one block of bytes, which becomes one transferred `ArrayBuffer`.
//!
//! Layout, little endian: one byte of kind, three of padding, then the body. A control message crosses as the bytes that
//! the agent sent. A chunk, which the worker has decoded, is a header and its columns one after the other (see
//! `columns`), so that both sides copy memory and parse nothing. Both ends are the same build: the layout is no public
//! contract, but lengths are checked all the same.

use super::{DecodedChunk, LinkEvent};
use crate::columns;
use semascan_protocol::{WireError, decode_server};

/// Why a block could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// It ends too early or holds more than it says.
    #[error("block of {0} bytes does not fit its content")]
    Length(usize),
    /// It begins with an unknown kind.
    #[error("unknown kind {0}")]
    Kind(u8),
    /// Its message is broken.
    #[error(transparent)]
    Message(#[from] WireError),
}

/// The first byte of a block.
mod kind {
    pub(super) const CONTROL: u8 = 1;
    pub(super) const CHUNK: u8 = 2;
    pub(super) const GONE: u8 = 3;
    pub(super) const CONNECTING: u8 = 4;
    pub(super) const DISCONNECTED: u8 = 5;
    pub(super) const REFUSED: u8 = 6;
    pub(super) const MALFORMED: u8 = 7;
    pub(super) const BROKEN: u8 = 8;
    pub(super) const LEFT_OUT: u8 = 9;
    pub(super) const HALVED: u8 = 10;
}

/// Bytes of a chunk before its columns.
const CHUNK_HEADER: usize = 4 + 12 + 4 + 4 + 4 + 8 + 4;

/// An event as bytes.
///
/// * `message`: what the agent sent, where the event is a control message: it crosses as it came. Not looked at for other
///   events.
pub fn encode(event: &LinkEvent, message: &[u8]) -> Vec<u8> {
    match event {
        LinkEvent::Connected { .. } | LinkEvent::Cleared(_) | LinkEvent::Message(_) => block(kind::CONTROL, &[message]),
        LinkEvent::Chunk(chunk) => encode_chunk(chunk),
        LinkEvent::ChunkGone { id } => block(kind::GONE, &[bytemuck::cast_slice(id)]),
        LinkEvent::Connecting { attempt } => block(kind::CONNECTING, &[&attempt.to_le_bytes()]),
        LinkEvent::Disconnected { reason, retry_ms } => {
            block(kind::DISCONNECTED, &[&retry_ms.to_le_bytes(), reason.as_bytes()])
        }
        LinkEvent::Refused { reason } => block(kind::REFUSED, &[reason.as_bytes()]),
        LinkEvent::Malformed { reason } => block(kind::MALFORMED, &[reason.as_bytes()]),
        LinkEvent::Broken { reason } => block(kind::BROKEN, &[reason.as_bytes()]),
        LinkEvent::Halved { halvings } => block(kind::HALVED, &[&halvings.to_le_bytes()]),
        LinkEvent::LeftOut { id } => block(kind::LEFT_OUT, &[bytemuck::cast_slice(id)]),
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
        kind::CONTROL => LinkEvent::from_control(decode_server(reader.rest)?.body.ok_or(WireError::Empty)?)?,
        kind::CHUNK => LinkEvent::Chunk(decode_chunk(&mut reader)?),
        kind::GONE => LinkEvent::ChunkGone { id: reader.id()? },
        kind::CONNECTING => LinkEvent::Connecting { attempt: u32::from_le_bytes(reader.array()?) },
        kind::DISCONNECTED => {
            let retry_ms = u32::from_le_bytes(reader.array()?);
            LinkEvent::Disconnected { reason: reader.text(), retry_ms }
        }
        kind::REFUSED => LinkEvent::Refused { reason: reader.text() },
        kind::MALFORMED => LinkEvent::Malformed { reason: reader.text() },
        kind::BROKEN => LinkEvent::Broken { reason: reader.text() },
        kind::HALVED => LinkEvent::Halved { halvings: u32::from_le_bytes(reader.array()?) },
        kind::LEFT_OUT => LinkEvent::LeftOut { id: reader.id()? },
        other => return Err(TransferError::Kind(other)),
    })
}

fn block(kind: u8, body: &[&[u8]]) -> Vec<u8> {
    let mut bytes = vec![kind, 0, 0, 0];
    body.iter().for_each(|part| bytes.extend_from_slice(part));
    bytes
}

fn encode_chunk(chunk: &DecodedChunk) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(CHUNK_HEADER + columns::cloud_bytes(&chunk.cloud));
    bytes.extend_from_slice(&[kind::CHUNK, 0, 0, 0]);
    bytes.extend_from_slice(bytemuck::cast_slice(&chunk.id));
    bytes.extend_from_slice(&chunk.revision.to_le_bytes());
    bytes.extend_from_slice(&chunk.epoch.to_le_bytes());
    bytes.extend_from_slice(&chunk.voxel.to_le_bytes());
    bytes.extend_from_slice(&chunk.hash.to_le_bytes());
    bytes.extend_from_slice(&(chunk.cloud.len() as u32).to_le_bytes());
    columns::put_cloud(&mut bytes, &chunk.cloud);
    bytes
}

fn decode_chunk(reader: &mut Reader<'_>) -> Result<DecodedChunk, TransferError> {
    let id = reader.id()?;
    let revision = u32::from_le_bytes(reader.array()?);
    let epoch = u32::from_le_bytes(reader.array()?);
    let voxel = f32::from_le_bytes(reader.array()?);
    let hash = u64::from_le_bytes(reader.array()?);
    let points = u32::from_le_bytes(reader.array()?) as usize;
    let cloud = columns::take_cloud(&mut reader.rest, points).filter(|_| reader.rest.is_empty());
    let cloud = cloud.ok_or(TransferError::Length(reader.total))?;
    Ok(DecodedChunk { id, revision, epoch, voxel, hash, cloud })
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

    /// The rest, as text.
    fn text(&self) -> String {
        String::from_utf8_lossy(self.rest).into_owned()
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use prost::Message;
    use semascan_model::{PointFlags, SemanticPoint};
    use semascan_protocol::server_message::Body;
    use semascan_protocol::{Clear, Inspection, Progress, ServerMessage, StageEvent, ViewReport, Welcome};

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

    #[test]
    fn chunks_cross_unchanged() {
        for n in [0, 1, 5, 300] {
            let sent = LinkEvent::Chunk(chunk(n));
            assert_eq!(decode(&encode(&sent, &[])).expect("what was encoded decodes"), sent);
        }
    }

    #[test]
    fn the_workers_own_events_cross_unchanged() {
        let events = [
            LinkEvent::Connecting { attempt: 3 },
            LinkEvent::Disconnected { reason: "gone".into(), retry_ms: 250 },
            LinkEvent::Refused { reason: "no".into() },
            LinkEvent::ChunkGone { id: [1, -2, 3] },
            LinkEvent::Malformed { reason: "field".into() },
            LinkEvent::Broken { reason: "stopped".into() },
            LinkEvent::LeftOut { id: [4, -5, 6] },
            LinkEvent::Halved { halvings: 3 },
        ];
        for event in events {
            assert_eq!(decode(&encode(&event, &[])).expect("what was encoded decodes"), event);
        }
    }

    #[test]
    fn control_messages_cross_as_they_came() {
        let inspection = Inspection { id: "a".into(), epoch: 2, part: "ß".into(), ..Inspection::default() };
        let messages = [
            Body::Welcome(Welcome {
                inspection: Some(inspection.clone()),
                resumed: true,
                agent: "x 1".into(),
                ..Welcome::default()
            }),
            Body::Clear(Clear { inspection: Some(inspection), ..Clear::default() }),
            Body::Progress(Progress { points: 5, model_hash: 9, ..Progress::default() }),
            Body::Stage(StageEvent { view: 1, duration_us: 2, ..StageEvent::default() }),
            Body::View(ViewReport { index: 4, thumbnail_jpeg: vec![1, 2], ..ViewReport::default() }),
        ];
        for body in messages {
            let bytes = ServerMessage { body: Some(body.clone()) }.encode_to_vec();
            let event = LinkEvent::from_control(body).expect("a complete message");
            assert_eq!(decode(&encode(&event, &bytes)).expect("what was encoded decodes"), event);
        }
        let incomplete = ServerMessage { body: Some(Body::Welcome(Welcome::default())) }.encode_to_vec();
        assert!(matches!(decode(&block(kind::CONTROL, &[&incomplete])), Err(TransferError::Message(_))));
    }

    #[test]
    fn cut_or_padded_chunks_are_refused() {
        let bytes = encode(&LinkEvent::Chunk(chunk(4)), &[]);
        for end in 0..bytes.len() {
            assert!(decode(&bytes[..end]).is_err(), "{end}");
        }
        let longer = [bytes.as_slice(), &[0]].concat();
        assert!(matches!(decode(&longer), Err(TransferError::Length(_))));
        assert!(matches!(decode(&[99, 0, 0, 0]), Err(TransferError::Kind(99))));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&bytes);
        }
    }
}
