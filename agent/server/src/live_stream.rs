//! From the events of an inspection to what clients shall see.
//!
//! Not every touched chunk is worth a message at once: an overlapping view moves most means by a fraction of a quantum.
//! A chunk is sent when enough of it is new since it was last sent; what was held back goes out with the end, so that
//! every client ends with the exact model. A map under a new epoch goes out as a whole.

use super::live::{LiveModel, Published};
use super::messages::{inspection, stage_event, stage_timing, view_report, wire_stage};
use rayon::prelude::*;
use semascan_inspection::bus::Events;
use semascan_inspection::event::{EventKind, InspectionEvent, SharedModel};
use semascan_model::Taxonomy;
use semascan_model::record::Outcome;
use semascan_perception::fuse::TouchedChunk;
use semascan_protocol::chunk::{ChunkEncoder, VoxelChunk};
use semascan_protocol::{self as wire, StageTiming, ViewReport};
use std::collections::BTreeMap;
use std::time::Instant;

/// Share of a chunk's points that must be new or relabelled before it is sent again.
const WORTH_SENDING: f64 = 0.4;

/// Changes of a chunk since it was last sent.
#[derive(Clone, Copy, Debug, Default)]
struct Backlog {
    changed: u32,
    sent_points: u32,
    dirty: bool,
}

/// A subscriber that publishes an inspection to a [`LiveModel`].
#[derive(Debug)]
pub struct LiveStream<'a> {
    live: &'a LiveModel,
    taxonomy: Taxonomy,
    backlog: BTreeMap<[i32; 3], Backlog>,
    /// The last view whose chunks were published, and how long that took.
    published: Option<(u32, StageTiming)>,
}

impl<'a> LiveStream<'a> {
    /// Will publish to `live`.
    pub fn new(live: &'a LiveModel) -> Self {
        let taxonomy = Taxonomy::from_names::<&str>(&[], &[]);
        Self { live, taxonomy, backlog: BTreeMap::new(), published: None }
    }

    /// Publishes every event until the inspection is over.
    pub fn follow(mut self, events: Events) {
        for event in events {
            self.handle(&event);
        }
        if self.live.progress().phase() == wire::Phase::Running {
            self.live.fail("the inspection broke off without an end");
        }
    }

    /// Publishes one event.
    pub fn handle(&mut self, event: &InspectionEvent) {
        self.live.progressed();
        self.live.metrics().happened(&event.kind);
        let attached = self.attach(event);
        apply(self.live, event, attached);
    }

    /// What clients are sent with an event beside what it says itself: the chunks of the model that are due, a view's report
    /// with its pictures.
    pub(super) fn attach(&mut self, event: &InspectionEvent) -> Attachment {
        match &event.kind {
            EventKind::Started { taxonomy, .. } => {
                self.taxonomy = taxonomy.clone();
                self.backlog.clear();
                Attachment::Nothing
            }
            EventKind::ModelChanged { view, touched, complete, model: Some(model), .. } => {
                let begun = Instant::now();
                let chunks = self.encode(model, touched, *complete);
                if let Some(view) = view {
                    let timing = stage_timing(wire::Stage::Publish, begun.elapsed().as_secs_f64());
                    self.published = Some((*view, timing));
                }
                chunks
            }
            EventKind::ViewFinished { record, view } => {
                let mut report = view_report(record, view.as_deref(), &self.taxonomy);
                report.timings.extend(self.published.take().filter(|(v, _)| *v == record.index).map(|(_, t)| t));
                Attachment::Report(Box::new(report))
            }
            _ => Attachment::Nothing,
        }
    }

    /// The chunks of `touched` that are due; all that were held back where the model is `complete`, and the whole model where
    /// it is under a new epoch.
    fn encode(&mut self, model: &SharedModel, touched: &[TouchedChunk], complete: bool) -> Attachment {
        // The chunks are copied out, so that the inspection does not wait for the coding.
        let (epoch, renewed, chunks) = {
            let map = model.read();
            let renewed = map.epoch() != self.live.epoch();
            let due = if renewed { map.chunk_ids() } else { self.due(touched, complete) };
            let chunks: Vec<_> = due.into_par_iter().map(|id| map.chunk(id)).collect();
            (map.epoch(), renewed, chunks)
        };
        let encode = |encoder: &mut ChunkEncoder, chunk: &VoxelChunk| {
            let id = chunk.id;
            if chunk.voxels.is_empty() {
                return Some(Published { id, encoded: None });
            }
            let revision = if renewed { 1 } else { self.live.next_revision(id) };
            match encoder.encode(chunk, epoch, revision) {
                Ok(encoded) => Some(Published { id, encoded: Some(encoded) }),
                Err(error) => {
                    tracing::error!(chunk = ?id, %error, "chunk not published");
                    None
                }
            }
        };
        let published: Vec<Published> =
            chunks.par_iter().map_init(ChunkEncoder::default, encode).flatten_iter().collect();
        if renewed {
            self.backlog.clear();
        }
        for p in &published {
            let sent_points = p.encoded.as_ref().map_or(0, |e| e.update.points);
            self.backlog.insert(p.id, Backlog { changed: 0, sent_points, dirty: false });
        }
        Attachment::Chunks { epoch, renewed, published }
    }

    /// Chunks that are due now that `touched` have changed; all that are dirty where the model is `complete`.
    fn due(&mut self, touched: &[TouchedChunk], complete: bool) -> Vec<[i32; 3]> {
        for t in touched {
            let entry = self.backlog.entry(t.id).or_default();
            entry.changed += t.made + t.relabelled;
            entry.dirty = true;
        }
        let is_due =
            |b: &Backlog| b.dirty && (complete || f64::from(b.changed) > WORTH_SENDING * f64::from(b.sent_points));
        self.backlog.iter().filter(|(_, b)| is_due(b)).map(|(id, _)| *id).collect()
    }
}

/// What goes out with an event beside what it says itself.
#[derive(Clone, Debug)]
pub(super) enum Attachment {
    Nothing,
    /// Chunks of the model.
    Chunks {
        /// Its epoch.
        epoch: u32,
        /// Whether they are the whole model of a new epoch.
        renewed: bool,
        published: Vec<Published>,
    },
    /// The report of a view.
    Report(Box<ViewReport>),
}

/// Publishes an event with what is attached to it to `live`.
pub(super) fn apply(live: &LiveModel, event: &InspectionEvent, attached: Attachment) {
    live.progressed();
    match (&event.kind, attached) {
        (EventKind::Started { .. }, _) => live.begin(inspection(event.inspection, &event.kind)),
        (EventKind::Stage { view, stage, status }, _) => {
            live.stage(stage_event(*view, wire_stage(*stage), status));
        }
        (EventKind::ModelChanged { voxel, complete, .. }, Attachment::Chunks { epoch, renewed, published }) => {
            live.set_voxel(*voxel);
            if renewed {
                live.renew(epoch, published);
            } else {
                live.publish(published);
            }
            if *complete {
                live.whole();
            }
        }
        (EventKind::ViewFinished { record, .. }, Attachment::Report(report)) => {
            live.view(*report);
            live.update_progress(|p| {
                p.views_done += 1;
                p.views_rejected += u32::from(!record.accepted);
            });
        }
        (EventKind::Measured { figures }, _) => {
            live.update_progress(|p| p.figures = Some(figures.as_ref().into()));
        }
        (EventKind::Ended { outcome: Outcome::Failed { reason } }, _) => live.fail(reason),
        (EventKind::Ended { outcome }, _) => {
            let hash = live.hash();
            live.update_progress(|p| {
                p.set_phase(wire::Phase::Finished);
                p.model_hash = hash;
                if *outcome == Outcome::Stopped {
                    p.message = format!("stopped after {} views", p.views_done);
                }
            });
        }
        (
            EventKind::ModelChanged { .. }
            | EventKind::ViewFinished { .. }
            | EventKind::Refined { .. }
            | EventKind::Planned { .. }
            | EventKind::PlanEnded { .. }
            | EventKind::Found { .. }
            | EventKind::Judged { .. },
            _,
        ) => {}
    }
}
