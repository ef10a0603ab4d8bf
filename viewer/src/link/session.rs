//! What a connection carries on: turns the agent's messages into [`LinkEvent`]s and remembers which chunk revisions have
//! been passed on, so that the next `Hello` asks only for the difference.
//!
//! Passing an event to the page cannot fail, so what this side remembers is what the page holds.

use super::LinkEvent;
use super::event::required;
use super::halving::{MOST_HALVINGS, halved, points_after};
use semascan_model::SemanticPoint;
use semascan_protocol::chunk::ChunkDecoder;
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    ChunkGone, ChunkId, ChunkUpdate, ClientMessage, HeldChunk, Hello, Inspection, MAX_HELD_CHUNKS, TAKES_POINTERS,
    TAKES_REVIEWS, ViewRequest, WireError, client_message, decode_server,
};
use std::collections::BTreeMap;

/// Share of the memory that halving the points has to spare: chunks of few points take as much as before.
const LEAST_SPARED: f64 = 0.2;

/// Memory that a browser needs for a chunk of so many points, bytes: its columns, on the graphics device whole blocks of 256
/// points of 32 bytes each, and what tables and transfers cost, which was measured: a chunk of one point takes 30 kB of
/// Chromium's memory where the processor draws.
fn chunk_bytes(points: usize) -> u64 {
    const ENTRY: u64 = 22_000;
    ENTRY + point_bytes(points)
}

/// The same without what tables and transfers cost.
fn point_bytes(points: usize) -> u64 {
    const BLOCK_POINTS: usize = 256;
    const BLOCK: u64 = BLOCK_POINTS as u64 * 32;
    points as u64 * size_of::<SemanticPoint>() as u64 + points.div_ceil(BLOCK_POINTS) as u64 * BLOCK
}

/// What is held, of which inspection.
#[derive(Debug)]
pub struct Session {
    inspection_id: String,
    epoch: u32,
    held: BTreeMap<[i32; 3], Held>,
    /// Memory for all that is held, and the most that it may be, bytes.
    bytes: u64,
    most_bytes: u64,
    /// What all that is held would need, were its points halved once more.
    bytes_halved: u64,
    /// How often the points of each chunk are halved, and what the page was told of it.
    halvings: u32,
    told_halvings: u32,
    /// Something of the present model was left out.
    left_out: bool,
    welcomed: bool,
    decoder: ChunkDecoder,
}

/// What is known of a chunk that is held.
#[derive(Clone, Copy, Debug)]
struct Held {
    revision: u32,
    /// Points of the chunk, whether they are held or not.
    points: usize,
}

impl Held {
    fn bytes(&self, halvings: u32) -> u64 {
        chunk_bytes(points_after(self.points, halvings))
    }
}

impl Session {
    /// Holds nothing yet, and never more than needs `most_bytes` of the page's memory.
    pub fn within(most_bytes: u64) -> Self {
        Self {
            inspection_id: String::new(),
            epoch: 0,
            held: BTreeMap::new(),
            bytes: 0,
            most_bytes,
            bytes_halved: 0,
            halvings: 0,
            told_halvings: 0,
            left_out: false,
            welcomed: false,
            decoder: ChunkDecoder::default(),
        }
    }

    /// The first message of a new connection.
    pub fn hello(&mut self) -> ClientMessage {
        self.welcomed = false;
        let mut hello = Hello {
            client: concat!("semascan-viewer ", env!("CARGO_PKG_VERSION")).to_owned(),
            capabilities: vec![TAKES_REVIEWS.to_owned(), TAKES_POINTERS.to_owned()],
            epoch: self.epoch,
            ..Hello::default()
        };
        if self.held.len() <= MAX_HELD_CHUNKS {
            hello.inspection_id.clone_from(&self.inspection_id);
            hello.held.extend(
                self.held
                    .iter()
                    .map(|(id, held)| HeldChunk { id: Some(ChunkId::from_array(*id)), revision: held.revision }),
            );
        }
        ClientMessage { body: Some(client_message::Body::Hello(hello)) }
    }

    /// Asks for reports of views before view `before`.
    pub fn earlier_views(before: u32) -> ClientMessage {
        ClientMessage { body: Some(client_message::Body::Views(ViewRequest { before, count: 0 })) }
    }

    /// Whether the agent has answered the present connection.
    pub fn is_welcomed(&self) -> bool {
        self.welcomed
    }

    /// Takes in one binary message; `None` if it is out of date and says nothing new.
    pub fn receive(&mut self, bytes: &[u8]) -> Option<LinkEvent> {
        let event = decode_server(bytes).and_then(|message| match message.body {
            Some(body) => self.take(body),
            None => Err(WireError::Empty),
        });
        event.unwrap_or_else(|error| Some(LinkEvent::Malformed { reason: error.to_string() }))
    }

    fn take(&mut self, body: Body) -> Result<Option<LinkEvent>, WireError> {
        let greeting = matches!(body, Body::Welcome(_) | Body::Refused(_));
        if !self.welcomed && !greeting {
            return Err(WireError::Field { field: "body", reason: "a message before the welcome".to_owned() });
        }
        let event = match body {
            Body::Chunk(update) => return self.chunk(&update),
            Body::Gone(gone) => return self.gone(&gone),
            control => LinkEvent::from_control(control)?,
        };
        match &event {
            LinkEvent::Connected { inspection, resumed, .. } => self.welcome(inspection, *resumed)?,
            LinkEvent::Cleared(inspection) => self.start_over(inspection),
            LinkEvent::Message(Body::Progress(progress)) => self.expect(progress.points),
            _ => {}
        }
        Ok(Some(event))
    }

    fn welcome(&mut self, inspection: &Inspection, resumed: bool) -> Result<(), WireError> {
        let same = inspection.id == self.inspection_id && inspection.epoch == self.epoch;
        if resumed && !same {
            let reason = "resumed, but another inspection or epoch than was held".to_owned();
            return Err(WireError::Field { field: "welcome.resumed", reason });
        }
        if !resumed {
            self.start_over(inspection);
        }
        self.welcomed = true;
        Ok(())
    }

    /// How often the points of each chunk are halved, if that has changed: the page has to hear it before the event that
    /// [`Self::receive`] gave last.
    pub fn take_halvings(&mut self) -> Option<u32> {
        (std::mem::replace(&mut self.told_halvings, self.halvings) != self.halvings).then_some(self.halvings)
    }

    /// A model of so many points will come: who knows that beforehand thins nothing later.
    fn expect(&mut self, points: u64) {
        let all = points.min(1 << 31) as usize;
        while self.halvings < MOST_HALVINGS && point_bytes(points_after(all, self.halvings)) > self.most_bytes {
            self.halve();
        }
    }

    fn halve(&mut self) {
        self.halvings += 1;
        self.bytes = self.bytes_halved;
        self.bytes_halved = self.held.values().map(|held| held.bytes(self.halvings + 1)).sum();
    }

    /// Makes room for another chunk by halving the points of all, where that helps.
    fn make_room(&mut self, chunk: &Held) {
        while self.bytes + chunk.bytes(self.halvings) > self.most_bytes && self.halvings < MOST_HALVINGS {
            let after = self.bytes_halved + chunk.bytes(self.halvings + 1);
            if after as f64 > (1.0 - LEAST_SPARED) * (self.bytes + chunk.bytes(self.halvings)) as f64 {
                break;
            }
            self.halve();
        }
    }

    fn start_over(&mut self, inspection: &Inspection) {
        if self.inspection_id != inspection.id {
            self.halvings = 0;
        }
        self.inspection_id.clone_from(&inspection.id);
        self.epoch = inspection.epoch;
        self.held.clear();
        (self.bytes, self.bytes_halved, self.left_out) = (0, 0, false);
    }

    fn chunk(&mut self, update: &ChunkUpdate) -> Result<Option<LinkEvent>, WireError> {
        if update.epoch != self.epoch {
            return Ok(None);
        }
        let mut decoded = self.decoder.decode(update)?;
        let id = decoded.id;
        if self.held.get(&id).is_some_and(|held| held.revision >= decoded.revision) {
            return Ok(None);
        }
        let before = self.held.remove(&id);
        self.forget(before);
        let held = Held { revision: decoded.revision, points: decoded.cloud.len() };
        self.make_room(&held);
        let bytes = held.bytes(self.halvings);
        if self.bytes + bytes > self.most_bytes {
            // Said once; after that, where something of it is in the picture.
            let said = std::mem::replace(&mut self.left_out, true);
            return Ok((before.is_some() || !said).then_some(LinkEvent::LeftOut { id }));
        }
        self.bytes += bytes;
        self.bytes_halved += held.bytes(self.halvings + 1);
        self.held.insert(id, held);
        if self.halvings > 0 {
            decoded.cloud = halved(&decoded.cloud, 0, self.halvings);
        }
        Ok(Some(LinkEvent::Chunk(decoded)))
    }

    /// A chunk is not held any more.
    fn forget(&mut self, before: Option<Held>) {
        self.bytes -= before.map_or(0, |held| held.bytes(self.halvings));
        self.bytes_halved -= before.map_or(0, |held| held.bytes(self.halvings + 1));
    }

    fn gone(&mut self, gone: &ChunkGone) -> Result<Option<LinkEvent>, WireError> {
        let id = required("gone.id", gone.id)?.to_array();
        if gone.epoch != self.epoch || self.held.get(&id).is_none_or(|held| held.revision > gone.revision) {
            return Ok(None);
        }
        let before = self.held.remove(&id);
        self.forget(before);
        Ok(Some(LinkEvent::ChunkGone { id }))
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use prost::Message;
    use semascan_model::PointFlags;
    use semascan_protocol::chunk::{VoxelChunk, encode};
    use semascan_protocol::{Clear, Progress, Refused, ServerMessage, Welcome};

    /// Memory that a page may need where nothing is known of its device.
    const USUAL: u64 = 1_200_000_000;

    fn bytes(body: Body) -> Vec<u8> {
        ServerMessage { body: Some(body) }.encode_to_vec()
    }

    fn inspection(id: &str, epoch: u32) -> Inspection {
        Inspection { id: id.to_owned(), epoch, ..Inspection::default() }
    }

    fn welcome(id: &str, epoch: u32, resumed: bool) -> Vec<u8> {
        let inspection = Some(inspection(id, epoch));
        bytes(Body::Welcome(Welcome { inspection, resumed, ..Welcome::default() }))
    }

    fn chunk(x: i32, epoch: u32, revision: u32) -> Vec<u8> {
        let voxel = 0.001;
        let at = |index: i32| (index as f32 + 0.5) * voxel;
        let point = SemanticPoint {
            position: [at(x * 32), at(0), at(0)],
            normal: [0.0, 0.0, 1.0],
            color: [1, 2, 3],
            label: 1,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 0.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags::default(),
        };
        let chunk = VoxelChunk { id: [x, 0, 0], voxel, voxels: vec![([0; 3], point)] };
        bytes(Body::Chunk(encode(&chunk, epoch, revision).expect("a sound chunk").update))
    }

    fn gone(x: i32, epoch: u32, revision: u32) -> Vec<u8> {
        let id = Some(ChunkId::from_array([x, 0, 0]));
        bytes(Body::Gone(ChunkGone { epoch, id, revision }))
    }

    fn held(session: &mut Session) -> (String, u32, Vec<([i32; 3], u32)>) {
        let Some(client_message::Body::Hello(hello)) = session.hello().body else { panic!("no hello") };
        let held = hello.held.iter().map(|h| (h.id.unwrap_or_default().to_array(), h.revision)).collect();
        (hello.inspection_id, hello.epoch, held)
    }

    #[test]
    fn the_next_hello_lists_what_was_passed_on() {
        let mut session = Session::within(USUAL);
        assert_eq!(held(&mut session), (String::new(), 0, vec![]));
        session.receive(&welcome("a", 1, false));
        assert!(matches!(session.receive(&chunk(0, 1, 3)), Some(LinkEvent::Chunk(_))));
        assert!(matches!(session.receive(&chunk(1, 1, 1)), Some(LinkEvent::Chunk(_))));
        assert!(matches!(session.receive(&gone(1, 1, 2)), Some(LinkEvent::ChunkGone { id: [1, 0, 0] })));
        assert_eq!(held(&mut session), ("a".to_owned(), 1, vec![([0; 3], 3)]));
        assert!(!session.is_welcomed(), "a hello opens a new connection");
        let event = session.receive(&welcome("a", 1, true));
        assert!(matches!(event, Some(LinkEvent::Connected { resumed: true, .. })));
        assert_eq!(held(&mut session).2, [([0; 3], 3)]);
    }

    #[test]
    fn out_of_date_chunks_say_nothing() {
        let mut session = Session::within(USUAL);
        session.receive(&welcome("a", 2, false));
        session.receive(&chunk(0, 2, 5));
        assert!(session.receive(&chunk(0, 2, 5)).is_none(), "held already");
        assert!(session.receive(&chunk(0, 2, 4)).is_none(), "older");
        assert!(session.receive(&chunk(7, 1, 9)).is_none(), "of an earlier epoch");
        assert!(session.receive(&gone(0, 2, 4)).is_none(), "emptied before it was filled again");
        assert!(session.receive(&gone(9, 2, 4)).is_none(), "never held");
        assert!(matches!(session.receive(&chunk(0, 2, 6)), Some(LinkEvent::Chunk(_))));
    }

    #[test]
    fn no_more_is_taken_than_there_is_memory_for_and_that_is_said_once() {
        let one = chunk_bytes(1);
        let mut session = Session::within(2 * one);
        session.receive(&welcome("a", 1, false));
        assert!(matches!(session.receive(&chunk(0, 1, 1)), Some(LinkEvent::Chunk(_))));
        assert!(matches!(session.receive(&chunk(1, 1, 1)), Some(LinkEvent::Chunk(_))));
        assert_eq!(session.receive(&chunk(2, 1, 1)), Some(LinkEvent::LeftOut { id: [2, 0, 0] }));
        assert_eq!(session.receive(&chunk(3, 1, 1)), None, "said already");
        assert!(matches!(session.receive(&chunk(1, 1, 2)), Some(LinkEvent::Chunk(_))), "no more than before");
        assert!(matches!(session.receive(&gone(0, 1, 2)), Some(LinkEvent::ChunkGone { .. })));
        assert!(matches!(session.receive(&chunk(2, 1, 2)), Some(LinkEvent::Chunk(_))), "there is room again");
        assert_eq!((session.bytes, session.held.len()), (2 * one, 2));
        session.receive(&welcome("a", 2, false));
        assert_eq!((session.bytes, session.left_out), (0, false));
        session.most_bytes = one - 1;
        assert!(matches!(session.receive(&chunk(1, 2, 1)), Some(LinkEvent::LeftOut { .. })));
    }

    #[test]
    fn chunks_of_single_points_count_for_what_they_need() {
        // 21 MB of such chunks once filled 6.5 GB.
        let most = USUAL / chunk_bytes(1);
        assert!(most < 41_000, "{most} chunks of one point");
        assert!(USUAL / chunk_bytes(1200) * 1200 > 10_000_000, "a model of ten million points is shown whole");
    }

    fn dense(x: i32, epoch: u32) -> Vec<u8> {
        let of = |i: u8| {
            let position =
                [x as f32 * 0.032 + (f32::from(i % 32) + 0.5) * 1e-3, (f32::from(i / 32) + 0.5) * 1e-3, 5e-4];
            (
                [i % 32, i / 32, 0],
                SemanticPoint { position, normal: [0.0, 0.0, 1.0], views: 1, ..SemanticPoint::UNKNOWN },
            )
        };
        let chunk = VoxelChunk { id: [x, 0, 0], voxel: 1e-3, voxels: (0..=255).map(of).collect() };
        bytes(Body::Chunk(encode(&chunk, epoch, 1).expect("a sound chunk").update))
    }

    fn points(event: Option<LinkEvent>) -> usize {
        let Some(LinkEvent::Chunk(chunk)) = event else { panic!("no chunk: {event:?}") };
        chunk.cloud.len()
    }

    #[test]
    fn a_model_that_is_too_large_is_held_thinner_and_whole() {
        let mut session = Session::within(4 * chunk_bytes(128));
        session.receive(&welcome("a", 1, false));
        for x in 0..3 {
            assert_eq!(points(session.receive(&dense(x, 1))), 256);
        }
        assert_eq!(session.take_halvings(), None);
        // Half of their points spare a sixth: entries are most of what these chunks take.
        assert_eq!(session.receive(&dense(3, 1)), Some(LinkEvent::LeftOut { id: [3, 0, 0] }));
        // A page that is told first.
        let points_of = |all: u64| bytes(Body::Progress(Progress { points: all, ..Progress::default() }));
        session.receive(&points_of(2000));
        assert_eq!((session.take_halvings(), session.take_halvings()), (Some(1), None));
        assert_eq!(session.bytes, 3 * chunk_bytes(128));
        assert_eq!(points(session.receive(&dense(3, 1))), 128);
        session.receive(&points_of(u64::MAX));
        assert_eq!(session.take_halvings(), Some(MOST_HALVINGS));
        session.receive(&welcome("a", 2, false));
        assert_eq!((session.take_halvings(), points(session.receive(&dense(0, 2)))), (None, 4));
        session.receive(&welcome("b", 1, false));
        assert_eq!((session.take_halvings(), points(session.receive(&dense(0, 1)))), (Some(0), 256));
    }

    #[test]
    fn room_is_made_by_halving_where_points_are_what_takes_it() {
        let mut session = Session::within(0);
        let held = Held { revision: 1, points: 4096 };
        session.held = (0..10).map(|x| ([x, 0, 0], held)).collect();
        session.most_bytes = 10 * held.bytes(0);
        (session.bytes, session.bytes_halved) = (session.most_bytes, 10 * held.bytes(1));
        session.make_room(&held);
        assert_eq!((session.halvings, session.bytes), (1, 10 * held.bytes(1)));
    }

    #[test]
    fn a_new_inspection_or_epoch_starts_over() {
        let mut session = Session::within(USUAL);
        session.receive(&welcome("a", 1, false));
        session.receive(&chunk(0, 1, 3));
        let clear = bytes(Body::Clear(Clear { inspection: Some(inspection("a", 2)), ..Clear::default() }));
        assert!(matches!(session.receive(&clear), Some(LinkEvent::Cleared(_))));
        assert_eq!(held(&mut session), ("a".to_owned(), 2, vec![]));
        session.receive(&welcome("a", 2, true));
        session.receive(&chunk(0, 2, 1));
        let _ = session.hello();
        session.receive(&welcome("b", 1, false));
        assert_eq!(held(&mut session), ("b".to_owned(), 1, vec![]));
    }

    #[test]
    fn what_breaks_the_protocol_is_named_and_survived() {
        let mut session = Session::within(USUAL);
        let reason = |event: Option<LinkEvent>| match event {
            Some(LinkEvent::Malformed { reason }) => reason,
            other => panic!("{other:?}"),
        };
        let early = bytes(Body::Progress(Progress::default()));
        assert!(reason(session.receive(&early)).contains("before the welcome"));
        let bare = bytes(Body::Welcome(Welcome::default()));
        assert!(reason(session.receive(&bare)).contains("welcome.inspection"));
        assert!(reason(session.receive(&welcome("a", 1, true))).contains("welcome.resumed"));
        assert!(!session.is_welcomed());
        session.receive(&welcome("a", 1, false));
        let empty = bytes(Body::Chunk(ChunkUpdate { epoch: 1, ..ChunkUpdate::default() }));
        reason(session.receive(&empty));
        assert!(matches!(session.receive(&early), Some(LinkEvent::Message(Body::Progress(_)))), "the link goes on");
    }

    #[test]
    fn a_refusal_may_come_at_any_time() {
        let refused = bytes(Body::Refused(Refused { reason: "full".to_owned() }));
        let mut session = Session::within(USUAL);
        assert!(matches!(session.receive(&refused), Some(LinkEvent::Refused { .. })));
        session.receive(&welcome("a", 1, false));
        assert!(matches!(session.receive(&refused), Some(LinkEvent::Refused { .. })));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_are_malformed_at_worst(noise in proptest::collection::vec(any::<u8>(), 0..300)) {
            let mut session = Session::within(USUAL);
            session.receive(&welcome("a", 1, false));
            let _ = session.receive(&noise);
            prop_assert!(matches!(session.receive(&chunk(0, 1, 1)), Some(LinkEvent::Chunk(_))));
        }
    }
}
