//! An inspection from a file, played in the place of an agent: it is shown as it stood after any of its views.
//!
//! Of each chunk only the revision that counts there is passed on. Going back, and past a map that the agent made anew, the page is
//! told of a new epoch of the same inspection: it shows what it has until the other model is there, and then exchanges them at once.

use prost::Message;
use prost::bytes::Bytes;
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    ChunkGone, ChunkUpdate, Clear, FileMessage, Inspection, Progress, ServerMessage, Welcome, decode_server,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// A place at which an inspection can be shown: after so many views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Views that are done, rejected ones too.
    pub views: u32,
    /// Time since the inspection began.
    pub time: Duration,
    /// Messages that have been sent by then.
    end: usize,
}

/// The stops of an inspection, in their order; the last is its end.
pub fn stops(messages: &[FileMessage]) -> Vec<Stop> {
    let mut stops: Vec<Stop> = Vec::new();
    for (index, message) in messages.iter().enumerate() {
        let stop = Stop { views: message.views, time: Duration::from_micros(message.microseconds), end: index + 1 };
        match stops.last_mut() {
            Some(last) if last.views == stop.views => *last = stop,
            _ => stops.push(stop),
        }
    }
    stops
}

/// A message of the file, as far as it has to be told apart.
enum Kept {
    Begin(Inspection),
    Chunk(ChunkUpdate),
    Gone {
        id: [i32; 3],
        message: ChunkGone,
    },
    Progress(Progress),
    /// It is passed on as it is.
    Other(Bytes),
}

/// Plays the messages of a file.
pub struct Player {
    messages: Vec<Kept>,
    stops: Vec<Stop>,
    /// Messages that what is shown takes into account; `None` before the first stop.
    shown: Option<usize>,
    /// Messages of which those that only say something have been passed on.
    told: usize,
    /// Epoch of the model that is shown, as the page knows it.
    epoch: u32,
}

impl Player {
    /// Plays `messages`. What of them is not understood is left aside; it is said by how many they are.
    pub fn new(messages: Vec<FileMessage>) -> (Self, usize) {
        let stops = stops(&messages);
        let mut wrong = 0;
        let kept = |message: FileMessage| {
            let kept = keep(message.message);
            wrong += usize::from(kept.is_none());
            // An empty message is passed on as nothing.
            kept.unwrap_or_else(|| Kept::Other(Bytes::new()))
        };
        let messages = messages.into_iter().map(kept).collect();
        (Self { messages, stops, shown: None, told: 0, epoch: 1 }, wrong)
    }

    /// The messages that bring the page from what it shows to a stop; nothing where there is no such stop.
    pub fn show(&mut self, stop: usize) -> Vec<Vec<u8>> {
        let Some(end) = self.stops.get(stop).map(|stop| stop.end) else { return Vec::new() };
        let begin = self.begin(end);
        let mut sent = Vec::new();
        let from = match self.shown {
            Some(shown) if shown <= end && self.begin(shown) == begin => shown,
            before => {
                let inspection = begin.map_or_else(Inspection::default, |index| self.inspection(index));
                self.epoch += u32::from(before.is_some());
                let inspection = Some(Inspection { epoch: self.epoch, ..inspection });
                sent.push(match before {
                    None => pack(Body::Welcome(Welcome { inspection, ..Welcome::default() })),
                    Some(_) => pack(Body::Clear(Clear { inspection, successor: true })),
                });
                begin.unwrap_or(0)
            }
        };
        for message in self.messages.get(self.told..end).unwrap_or_default() {
            if let Kept::Other(message) = message
                && !message.is_empty()
            {
                sent.push(message.to_vec());
            }
        }
        let mut newest = BTreeMap::new();
        for (index, message) in self.messages.iter().enumerate().take(end).skip(from) {
            if let Kept::Chunk(ChunkUpdate { id: Some(id), .. }) = message {
                newest.insert(id.to_array(), index);
            } else if let Kept::Gone { id, .. } = message {
                newest.insert(*id, index);
            }
        }
        let epoch = self.epoch;
        for message in newest.values().filter_map(|index| self.messages.get(*index)) {
            match message {
                Kept::Chunk(update) => sent.push(pack(Body::Chunk(ChunkUpdate { epoch, ..update.clone() }))),
                Kept::Gone { message, .. } => {
                    sent.push(pack(Body::Gone(ChunkGone { epoch, ..*message })));
                }
                _ => {}
            }
        }
        let progress = self.messages.iter().take(end).rev().find_map(|message| match message {
            Kept::Progress(progress) => Some(progress.clone()),
            _ => None,
        });
        let progress = Progress { complete_epoch: epoch, ..progress.unwrap_or_default() };
        sent.push(pack(Body::Progress(progress)));
        (self.shown, self.told) = (Some(end), self.told.max(end));
        sent
    }

    /// The message with which the model begins that is shown after so many messages.
    fn begin(&self, end: usize) -> Option<usize> {
        self.messages.iter().take(end).rposition(|message| matches!(message, Kept::Begin(_)))
    }

    /// What the message at `index` says is inspected. The voxel size is known later than that: with the first chunk.
    fn inspection(&self, index: usize) -> Inspection {
        match self.messages.get(index) {
            Some(Kept::Begin(inspection)) => inspection.clone(),
            _ => Inspection::default(),
        }
    }
}

/// A message as it is kept; `None` if it is not understood.
fn keep(message: Bytes) -> Option<Kept> {
    Some(match decode_server(&message).ok()?.body? {
        Body::Welcome(Welcome { inspection, .. }) | Body::Clear(Clear { inspection, .. }) => Kept::Begin(inspection?),
        Body::Chunk(update) => Kept::Chunk(update),
        Body::Gone(message) => Kept::Gone { id: message.id?.to_array(), message },
        Body::Progress(progress) => Kept::Progress(progress),
        // A file refuses nobody, has all its views at hand, and nobody points in it.
        Body::Refused(_) | Body::Page(_) | Body::Pointer(_) => Kept::Other(Bytes::new()),
        Body::Stage(_) | Body::View(_) | Body::Review(_) => Kept::Other(message),
    })
}

fn pack(body: Body) -> Vec<u8> {
    ServerMessage { body: Some(body) }.encode_to_vec()
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use crate::link::LinkEvent;
    use crate::link::session::Session;
    use crate::scene::HeldModel;
    use crate::state::{AppState, Event};
    use semascan_model::{PointFlags, SemanticPoint};
    use semascan_protocol::chunk::{VoxelChunk, encode};
    use semascan_protocol::{ChunkId, Phase, ViewReport};

    const VOXEL: f32 = 0.001;

    /// A chunk with so many points.
    fn chunk(x: i32, points: u8, epoch: u32, revision: u32) -> Body {
        let point = |i: u8| {
            let at = |index: i32| (index as f32 + 0.5) * VOXEL;
            let point = SemanticPoint {
                position: [at(x * 32 + i32::from(i)), at(0), at(0)],
                normal: [0.0, 0.0, 1.0],
                label: 1,
                views: 1,
                flags: PointFlags::default(),
                ..SemanticPoint::UNKNOWN
            };
            ([i, 0, 0], point)
        };
        let chunk = VoxelChunk { id: [x, 0, 0], voxel: VOXEL, voxels: (0..points).map(point).collect() };
        Body::Chunk(encode(&chunk, epoch, revision).expect("a sound chunk").update)
    }

    fn inspection(epoch: u32) -> Inspection {
        Inspection { id: "a".into(), part: "motor".into(), epoch, ..Inspection::default() }
    }

    /// Two views, then a map that was made anew.
    fn messages() -> Vec<FileMessage> {
        let progress = |phase: Phase, views_done| {
            Body::Progress(Progress { phase: phase.into(), views_done, points: 1, ..Progress::default() })
        };
        let view = |index| Body::View(ViewReport { index, accepted: true, ..ViewReport::default() });
        let gone = ChunkGone { epoch: 1, id: Some(ChunkId::from_array([1, 0, 0])), revision: 2 };
        let bodies = [
            (0, Body::Welcome(Welcome { inspection: Some(Inspection::default()), ..Welcome::default() })),
            (0, Body::Clear(Clear { inspection: Some(inspection(1)), successor: false })),
            (0, progress(Phase::Running, 0)),
            (1, view(0)),
            (1, progress(Phase::Running, 1)),
            (1, chunk(0, 2, 1, 1)),
            (1, chunk(1, 3, 1, 1)),
            (2, chunk(0, 5, 1, 2)),
            (2, Body::Gone(gone)),
            (2, view(1)),
            (2, progress(Phase::Running, 2)),
            (3, Body::Clear(Clear { inspection: Some(inspection(2)), successor: true })),
            (3, chunk(0, 7, 2, 1)),
            (3, view(2)),
            (3, progress(Phase::Finished, 3)),
        ];
        let message = |(index, (views, body)): (usize, (u32, Body))| FileMessage {
            microseconds: index as u64 * 1_000_000,
            views,
            message: pack(body).into(),
        };
        bodies.into_iter().enumerate().map(message).collect()
    }

    /// A page that follows a player.
    struct Page {
        player: Player,
        session: Session,
        model: HeldModel,
        state: AppState,
        most_changes: usize,
    }

    impl Page {
        fn new() -> Self {
            let (player, wrong) = Player::new(messages());
            assert_eq!(wrong, 0);
            let mut state = AppState::default();
            state.reduce(&Event::Opened("motor.semascan".into()));
            Self { player, session: Session::within(u64::MAX), model: HeldModel::new(), state, most_changes: 0 }
        }

        /// Points, views that are done and views that are listed after a stop.
        fn show(&mut self, stop: usize) -> (usize, u32, usize) {
            let sent = self.player.show(stop);
            self.most_changes = sent.len();
            for message in sent {
                // That a chunk emptied says nothing to a page that does not have it.
                let Some(event) = self.session.receive(&message) else { continue };
                assert!(!matches!(event, LinkEvent::Malformed { .. }), "{event:?}");
                let had = self.model.point_count();
                self.model.apply(&event);
                assert!(had == 0 || self.model.point_count() > 0 || stop == 0, "never empty in between");
                if !event.is_bulk() {
                    self.state.reduce(&Event::from(event));
                }
            }
            (self.model.point_count(), self.state.progress.views_done, self.state.views.iter().len())
        }
    }

    #[test]
    fn an_inspection_has_a_stop_after_each_view() {
        let stops = stops(&messages());
        let said: Vec<(u32, u64)> = stops.iter().map(|stop| (stop.views, stop.time.as_secs())).collect();
        assert_eq!(said, [(0, 2), (1, 6), (2, 10), (3, 14)]);
    }

    #[test]
    fn every_stop_is_shown_from_every_other() {
        let expected = [(0, 0), (5, 1), (5, 2), (7, 3)];
        for first in 0..4 {
            for second in 0..4 {
                let mut page = Page::new();
                for stop in [first, second, first] {
                    let (points, done, views) = page.show(stop);
                    assert_eq!((points, done), expected[stop], "{first}, {second}");
                    assert!(views >= stop, "{views} views after {stop}");
                }
                assert_eq!((page.state.connection.key(), page.state.inspection.part.as_str()), ("file", "motor"));
            }
        }
    }

    #[test]
    fn what_is_shown_is_not_sent_again() {
        let mut page = Page::new();
        page.show(2);
        page.show(2);
        assert_eq!(page.most_changes, 1, "progress alone");
        assert!(page.player.show(9).is_empty());
    }

    #[test]
    fn what_is_not_understood_is_left_aside() {
        let mut broken = messages();
        broken[5].message = Bytes::from_static(b"\xff\xff");
        let (mut player, wrong) = Player::new(broken);
        assert_eq!(wrong, 1);
        assert!(!player.show(1).is_empty());
        assert!(Player::new(Vec::new()).0.show(0).is_empty());
    }
}
