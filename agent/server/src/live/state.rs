//! What is published, in the order of its last change, and how far along it each client is.

use super::pointer_log::PointerLog;
use super::review_log::ReviewLog;
use super::stage_log::StageLog;
use super::view_log::ViewLog;
use axum::body::Bytes;
use prost::Message;
use semascan_protocol as wire;
use semascan_protocol::server_message::Body;
use semascan_protocol::{ChunkGone, ChunkId, Inspection, Progress, ServerMessage};
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::time::Instant;

#[derive(Clone, Debug)]
pub(super) struct LiveChunk {
    /// Place in the order of change.
    pub(super) change: u64,
    pub(super) revision: u32,
    pub(super) hash: u64,
    pub(super) points: u32,
    /// The whole message; a tombstone if the chunk emptied.
    pub(super) message: Bytes,
}

/// Bytes published since the inspection began: what a client that keeps up is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamTotals {
    /// Chunk messages.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Bytes of the newest revision of every chunk.
    pub snapshot_bytes: u64,
    /// Points in the newest revision of every chunk.
    pub points: u64,
}

#[derive(Debug)]
pub(super) struct State {
    /// Grows with every new inspection or epoch: clients then start over.
    pub(super) generation: u64,
    pub(super) inspection: Inspection,
    pub(super) progress: Progress,
    pub(super) changes: u64,
    pub(super) chunks: HashMap<[i32; 3], LiveChunk>,
    pub(super) by_change: BTreeMap<u64, [i32; 3]>,
    pub(super) stages: StageLog,
    pub(super) views: ViewLog,
    /// What people decided, whatever is shown.
    pub(super) reviews: ReviewLog,
    /// Where people point.
    pub(super) pointers: PointerLog,
    /// When the inspection last did something.
    pub(super) progressed: Instant,
    pub(super) totals: StreamTotals,
    /// The change with which the epoch's whole model was there; later ones are its revisions.
    pub(super) whole_at: Option<u64>,
}

/// Where one client stands.
#[derive(Debug)]
pub(crate) struct Cursor {
    pub(super) generation: u64,
    /// The inspection it follows.
    pub(super) inspection: String,
    pub(super) change: u64,
    /// The last change when it came: what was replaced before was not meant for it.
    pub(super) arrived: u64,
    /// Last stage event it was sent.
    pub(super) stage: u64,
    /// Last view report it was sent.
    pub(super) view: u64,
    /// Last change of a review it was sent.
    pub(super) review: u64,
    /// Whether it is sent those.
    pub(super) takes_reviews: bool,
    /// Last pointer it was sent, and whether it is sent those.
    pub(super) pointer: u64,
    pub(super) takes_pointers: bool,
    /// Reports that it is sent next, oldest first.
    pub(super) page: VecDeque<Bytes>,
    pub(super) progress: Option<Progress>,
    /// Revisions that a returning client already has; each is dropped once its chunk was passed.
    pub(super) held: HashMap<[i32; 3], u32>,
}

impl Cursor {
    /// Before the first message of what is published now.
    pub(super) fn at_the_beginning(state: &State) -> Self {
        Self {
            generation: state.generation,
            inspection: state.inspection.id.clone(),
            change: 0,
            arrived: state.changes,
            stage: 0,
            view: 0,
            review: 0,
            takes_reviews: false,
            // Pointers are of now: those of before it came are not for it.
            pointer: state.pointers.latest(),
            takes_pointers: false,
            page: VecDeque::new(),
            progress: None,
            held: HashMap::new(),
        }
    }

    /// Before the first chunk of a model that was made anew: what was said of the inspection's views still holds.
    pub(super) fn at_the_next_epoch(self, state: &State) -> Self {
        let Self { stage, view, review, takes_reviews, takes_pointers, page, .. } = self;
        Self { stage, view, review, takes_reviews, takes_pointers, page, ..Self::at_the_beginning(state) }
    }
}

/// A chunk ready to be published.
#[derive(Clone, Debug)]
pub(crate) struct Published {
    pub(crate) id: [i32; 3],
    /// `None`: the chunk emptied.
    pub(crate) encoded: Option<wire::chunk::Encoded>,
}

impl State {
    /// Puts new revisions in place of the old ones.
    pub(super) fn put(&mut self, chunks: Vec<Published>) {
        let epoch = self.inspection.epoch;
        for Published { id, encoded } in chunks {
            let old = self.chunks.remove(&id);
            let (revision, hash, points, message) = match encoded {
                Some(e) => (e.update.revision, e.hash, e.update.points, pack(Body::Chunk(e.update))),
                None => {
                    let Some(old) = &old else { continue };
                    let revision = old.revision + 1;
                    let gone = ChunkGone { epoch, id: Some(ChunkId::from_array(id)), revision };
                    (revision, 0, 0, pack(Body::Gone(gone)))
                }
            };
            if let Some(old) = old {
                self.by_change.remove(&old.change);
                self.totals.snapshot_bytes -= old.message.len() as u64;
                self.totals.points -= u64::from(old.points);
            }
            self.changes += 1;
            let change = self.changes;
            self.totals.messages += 1;
            self.totals.bytes += message.len() as u64;
            self.totals.snapshot_bytes += message.len() as u64;
            self.totals.points += u64::from(points);
            self.by_change.insert(change, id);
            self.chunks.insert(id, LiveChunk { change, revision, hash, points, message });
        }
    }

    /// Progress as the client at `cursor` may be sent it: whether the whole model was sent depends on how far it is.
    pub(super) fn progress_for(&self, cursor: &Cursor) -> Progress {
        let sent = |whole: u64| {
            self.by_change
                .range(cursor.change + 1..=whole.max(cursor.change + 1))
                .next()
                .is_none_or(|(c, _)| *c > whole)
        };
        let complete = self.whole_at.is_some_and(sent);
        Progress { complete_epoch: if complete { self.inspection.epoch } else { 0 }, ..self.progress.clone() }
    }
}

pub(crate) fn pack(body: Body) -> Bytes {
    ServerMessage { body: Some(body) }.encode_to_vec().into()
}
