//! The model as clients shall see it: every chunk's newest revision, encoded once for all, and the control messages.
//!
//! Chunks stand in the order of their last change. A client remembers how far along that order it is, one number; a
//! chunk that changes again moves to the end, so an unsent older revision is replaced by the newer one by itself.

use axum::body::Bytes;
use prost::Message;
use semascan_shared::wire::{
    self, ChunkGone, ChunkId, Clear, HeldChunk, Inspection, Progress, ServerMessage, chunk::model_hash,
    server_message::Body,
};
use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Stage events and view reports kept for clients that come later.
const CONTROL_LOG: usize = 20_000;

#[derive(Clone, Debug)]
struct LiveChunk {
    /// Place in the order of change.
    change: u64,
    revision: u32,
    hash: u64,
    points: u32,
    /// The whole message; a tombstone if the chunk emptied.
    message: Bytes,
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
struct State {
    /// Grows with every new inspection or epoch: clients then start over.
    generation: u64,
    inspection: Inspection,
    progress: Progress,
    changes: u64,
    chunks: HashMap<[i32; 3], LiveChunk>,
    by_change: BTreeMap<u64, [i32; 3]>,
    control: Vec<Bytes>,
    totals: StreamTotals,
}

/// Shared by the inspection and all clients.
#[derive(Debug)]
pub struct LiveModel {
    state: Mutex<State>,
    changed: watch::Sender<()>,
}

/// Where one client stands.
#[derive(Debug)]
pub(super) struct Cursor {
    generation: u64,
    change: u64,
    control: usize,
    progress: Option<Progress>,
    /// Revisions that a returning client already has; each is dropped once its chunk was passed.
    held: HashMap<[i32; 3], u32>,
}

/// A chunk ready to be published.
#[derive(Clone, Debug)]
pub(super) struct Published {
    pub(super) id: [i32; 3],
    /// `None`: the chunk emptied.
    pub(super) encoded: Option<wire::chunk::Encoded>,
}

impl LiveModel {
    /// No inspection yet.
    pub fn new() -> Self {
        let progress = Progress { phase: wire::Phase::Waiting.into(), ..Progress::default() };
        let state = State {
            generation: 0,
            inspection: Inspection::default(),
            progress,
            changes: 0,
            chunks: HashMap::new(),
            by_change: BTreeMap::new(),
            control: Vec::new(),
            totals: StreamTotals::default(),
        };
        Self { state: Mutex::new(state), changed: watch::Sender::new(()) }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code below panics between two related writes, so a poisoned state is still whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is told whenever there may be something new.
    pub(super) fn changes(&self) -> watch::Receiver<()> {
        self.changed.subscribe()
    }

    /// Begins a new inspection or epoch: every client clears.
    pub fn begin(&self, inspection: Inspection) {
        let mut state = self.lock();
        state.generation += 1;
        state.progress = Progress {
            phase: wire::Phase::Running.into(),
            views_expected: inspection.views_expected,
            ..Progress::default()
        };
        state.inspection = inspection;
        state.chunks.clear();
        state.by_change.clear();
        state.control.clear();
        state.totals = StreamTotals::default();
        drop(state);
        self.changed.send_replace(());
    }

    /// Tells what is being inspected after the first view has fixed the voxel size.
    pub(super) fn set_voxel(&self, voxel: f64) {
        self.lock().inspection.voxel = voxel;
    }

    /// Next revision of chunk `id`.
    pub(super) fn next_revision(&self, id: [i32; 3]) -> u32 {
        self.lock().chunks.get(&id).map_or(1, |c| c.revision + 1)
    }

    /// Puts new revisions in place of the old ones.
    pub(super) fn publish(&self, chunks: Vec<Published>) {
        let mut state = self.lock();
        let epoch = state.inspection.epoch;
        for Published { id, encoded } in chunks {
            let old = state.chunks.remove(&id);
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
                state.by_change.remove(&old.change);
                state.totals.snapshot_bytes -= old.message.len() as u64;
                state.totals.points -= u64::from(old.points);
            }
            state.changes += 1;
            let change = state.changes;
            state.totals.messages += 1;
            state.totals.bytes += message.len() as u64;
            state.totals.snapshot_bytes += message.len() as u64;
            state.totals.points += u64::from(points);
            state.by_change.insert(change, id);
            state.chunks.insert(id, LiveChunk { change, revision, hash, points, message });
        }
        drop(state);
        self.changed.send_replace(());
    }

    /// Adds to the control lane.
    pub(super) fn control(&self, body: Body) {
        let mut state = self.lock();
        if state.control.len() < CONTROL_LOG {
            state.control.push(pack(body));
        }
        drop(state);
        self.changed.send_replace(());
    }

    /// Changes the progress that clients see.
    pub(super) fn update_progress(&self, change: impl FnOnce(&mut Progress)) {
        let mut state = self.lock();
        let mut progress = state.progress.clone();
        change(&mut progress);
        progress.points = state.totals.points;
        progress.chunks = state.chunks.values().filter(|c| c.points > 0).count() as u32;
        state.progress = progress;
        drop(state);
        self.changed.send_replace(());
    }

    /// Hash of the model as published.
    pub fn hash(&self) -> u64 {
        let state = self.lock();
        model_hash(state.chunks.iter().filter(|(_, c)| c.points > 0).map(|(id, c)| (*id, c.hash)))
    }

    /// What has been published since the inspection began.
    pub fn totals(&self) -> StreamTotals {
        self.lock().totals
    }

    /// Where the inspection stands.
    pub fn progress(&self) -> Progress {
        self.lock().progress.clone()
    }

    /// A client arrives with what it holds: its cursor and the Welcome it is due.
    pub(super) fn welcome(&self, inspection_id: &str, epoch: u32, held: &[HeldChunk]) -> (Cursor, Bytes) {
        let state = self.lock();
        let resumed =
            !inspection_id.is_empty() && inspection_id == state.inspection.id && epoch == state.inspection.epoch;
        let held = if resumed {
            held.iter().filter_map(|h| Some((h.id?.to_array(), h.revision))).collect()
        } else {
            HashMap::new()
        };
        let welcome = wire::Welcome {
            agent: concat!("semascan ", env!("CARGO_PKG_VERSION")).into(),
            capabilities: Vec::new(),
            inspection: Some(state.inspection.clone()),
            resumed,
        };
        let cursor = Cursor { generation: state.generation, change: 0, control: 0, progress: None, held };
        (cursor, pack(Body::Welcome(welcome)))
    }

    /// The next message for a client, `None` if it has everything.
    pub(super) fn next(&self, cursor: &mut Cursor) -> Option<Bytes> {
        let state = self.lock();
        if cursor.generation != state.generation {
            *cursor =
                Cursor { generation: state.generation, change: 0, control: 0, progress: None, held: HashMap::new() };
            return Some(pack(Body::Clear(Clear { inspection: Some(state.inspection.clone()) })));
        }
        if let Some(message) = state.control.get(cursor.control) {
            cursor.control += 1;
            return Some(message.clone());
        }
        let running = state.progress.phase() == wire::Phase::Running;
        let unsent_progress = cursor.progress.as_ref() != Some(&state.progress);
        if unsent_progress && running {
            cursor.progress = Some(state.progress.clone());
            return Some(pack(Body::Progress(state.progress.clone())));
        }
        while let Some((&change, id)) = state.by_change.range(cursor.change + 1..).next() {
            cursor.change = change;
            let Some(chunk) = state.chunks.get(id) else { continue };
            if cursor.held.remove(id) != Some(chunk.revision) {
                return Some(chunk.message.clone());
            }
        }
        // The end is told after the last chunk.
        if unsent_progress {
            cursor.progress = Some(state.progress.clone());
            return Some(pack(Body::Progress(state.progress.clone())));
        }
        None
    }
}

impl Default for LiveModel {
    fn default() -> Self {
        Self::new()
    }
}

pub(super) fn pack(body: Body) -> Bytes {
    ServerMessage { body: Some(body) }.encode_to_vec().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_shared::model::{PointFlags, SemanticPoint};
    use semascan_shared::wire::chunk::{VoxelChunk, encode};

    fn published(id: [i32; 3], revision: u32) -> Published {
        let voxel = 0.001_f32;
        let position = id.map(|c| (c * 32) as f32 * voxel + 0.5 * voxel);
        let point = SemanticPoint {
            position,
            normal: [0.0, 0.0, 1.0],
            color: [revision as u8; 3],
            label: 1,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(0),
        };
        let chunk = VoxelChunk { id, voxel, voxels: vec![([0; 3], point)] };
        Published { id, encoded: Some(encode(&chunk, 1, revision).expect("encodes")) }
    }

    fn running() -> LiveModel {
        let live = LiveModel::new();
        live.begin(Inspection { id: "a".into(), epoch: 1, ..Inspection::default() });
        live
    }

    /// Everything a client would be sent now, as (chunk, revision), and the last phase it heard of.
    fn drain(live: &LiveModel, cursor: &mut Cursor) -> (Vec<([i32; 3], u32)>, Vec<wire::Phase>) {
        let (mut chunks, mut phases) = (Vec::new(), Vec::new());
        while let Some(bytes) = live.next(cursor) {
            match wire::decode_server(&bytes).expect("valid").body {
                Some(Body::Chunk(c)) => chunks.push((c.id.expect("id").to_array(), c.revision)),
                Some(Body::Gone(c)) => chunks.push((c.id.expect("id").to_array(), c.revision)),
                Some(Body::Progress(p)) => phases.push(p.phase()),
                _ => {}
            }
        }
        (chunks, phases)
    }

    #[test]
    fn a_slow_client_gets_the_newest_revision_only() {
        let live = running();
        let (mut cursor, _) = live.welcome("", 0, &[]);
        live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1)]);
        live.publish(vec![published([0; 3], 2)]);
        assert_eq!(drain(&live, &mut cursor).0, [([1, 0, 0], 1), ([0; 3], 2)]);
        assert_eq!(drain(&live, &mut cursor).0, []);
    }

    #[test]
    fn a_returning_client_gets_the_difference() {
        let live = running();
        live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1), published([2, 0, 0], 1)]);
        live.publish(vec![published([2, 0, 0], 2)]);
        let held = |x, revision| HeldChunk { id: Some(ChunkId { x, y: 0, z: 0 }), revision };
        let (mut cursor, _) = live.welcome("a", 1, &[held(0, 1), held(2, 1)]);
        assert_eq!(drain(&live, &mut cursor).0, [([1, 0, 0], 1), ([2, 0, 0], 2)]);
        let (mut stranger, _) = live.welcome("b", 1, &[held(0, 1)]);
        assert_eq!(drain(&live, &mut stranger).0.len(), 3);
    }

    #[test]
    fn an_emptied_chunk_leaves_a_tombstone_and_no_hash() {
        let live = running();
        let empty = live.hash();
        live.publish(vec![published([0; 3], 1)]);
        assert_ne!(live.hash(), empty);
        live.publish(vec![Published { id: [0; 3], encoded: None }]);
        let (mut cursor, _) = live.welcome("", 0, &[]);
        assert_eq!(drain(&live, &mut cursor).0, [([0; 3], 2)]);
        assert_eq!(live.hash(), empty);
    }

    #[test]
    fn the_end_is_told_after_the_last_chunk_and_a_new_inspection_clears() {
        let live = running();
        let (mut cursor, _) = live.welcome("", 0, &[]);
        live.publish(vec![published([0; 3], 1)]);
        live.update_progress(|p| p.phase = wire::Phase::Finished.into());
        let mut last_was_chunk = false;
        while let Some(bytes) = live.next(&mut cursor) {
            match wire::decode_server(&bytes).expect("valid").body {
                Some(Body::Progress(_)) => assert!(last_was_chunk),
                other => last_was_chunk = matches!(other, Some(Body::Chunk(_))),
            }
        }
        live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
        let first = live.next(&mut cursor).expect("clear");
        assert!(matches!(wire::decode_server(&first).expect("valid").body, Some(Body::Clear(_))));
    }
}
