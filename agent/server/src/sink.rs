//! Feeds the live model from a running inspection.
//!
//! Not every touched chunk is worth a message at once: an overlapping view moves most means by a fraction of a quantum.
//! A chunk is sent when enough of it is new since it was last sent; what was held back goes out with the end, so that
//! every client ends with the exact model. A map under a new epoch goes out as a whole.

use super::live::{LiveModel, Published};
use super::messages::{stage_event, view_report};
use rayon::prelude::*;
use semascan_inspection::pipeline::{InspectionSink, Stage, StageStatus, ViewOutcome};
use semascan_inspection::source::SourceInfo;
use semascan_model::Taxonomy;
use semascan_perception::fuse::{SemanticMap, TouchedChunk};
use semascan_perception::register::JointRefinement;
use semascan_protocol as wire;
use semascan_protocol::Inspection;
use semascan_protocol::chunk::ChunkEncoder;
use semascan_protocol::server_message::Body;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Share of a chunk's points that must be new or relabelled before it is sent again.
const WORTH_SENDING: f64 = 0.4;

/// Changes of a chunk since it was last sent.
#[derive(Clone, Copy, Debug, Default)]
struct Backlog {
    changed: u32,
    sent_points: u32,
    dirty: bool,
}

/// An [`InspectionSink`] that publishes to a [`LiveModel`].
#[derive(Debug)]
pub struct LiveSink {
    live: Arc<LiveModel>,
    taxonomy: Taxonomy,
    backlog: Mutex<BTreeMap<[i32; 3], Backlog>>,
}

impl LiveSink {
    /// Begins a new inspection of `info` on `live`; `id` must be unique to this run.
    pub fn begin(live: Arc<LiveModel>, info: &SourceInfo, id: &str) -> Self {
        let mut inspection = Inspection {
            id: id.into(),
            epoch: 1,
            part: info.part.clone(),
            source: info.uri.clone(),
            views_expected: info.view_count.unwrap_or(0),
            turntable: info.turntable.map(|t| wire::Turntable { radius: t.radius, height: t.height }),
            ..Inspection::default()
        };
        inspection.set_taxonomy(&info.taxonomy);
        live.begin(inspection);
        Self { live, taxonomy: info.taxonomy.clone(), backlog: Mutex::new(BTreeMap::new()) }
    }

    /// Tells clients that the inspection failed.
    pub fn fail(&self, message: &str) {
        self.live.update_progress(|p| {
            p.set_phase(wire::Phase::Failed);
            p.message = message.into();
        });
    }

    /// Chunks of `touched` that are due, their backlog cleared; all that is dirty if `last`.
    fn due(&self, touched: &[TouchedChunk], last: bool) -> Vec<[i32; 3]> {
        let mut backlog = self.backlog.lock().unwrap_or_else(PoisonError::into_inner);
        for t in touched {
            let entry = backlog.entry(t.id).or_default();
            entry.changed += t.made + t.relabelled;
            entry.dirty = true;
        }
        let is_due = |b: &Backlog| b.dirty && (last || f64::from(b.changed) > WORTH_SENDING * f64::from(b.sent_points));
        backlog.iter().filter(|(_, b)| is_due(b)).map(|(id, _)| *id).collect()
    }

    fn sent(&self, id: [i32; 3], points: u32) {
        let mut backlog = self.backlog.lock().unwrap_or_else(PoisonError::into_inner);
        backlog.insert(id, Backlog { changed: 0, sent_points: points, dirty: false });
    }
}

impl InspectionSink for LiveSink {
    fn stage(&self, view: u32, stage: Stage, status: &StageStatus) {
        self.live.control(Body::Stage(stage_event(view, stage, status)));
    }

    fn map_changed(&self, map: &SemanticMap, touched: &[TouchedChunk], last: bool) {
        self.live.set_voxel(map.config().voxel);
        let renewed = map.epoch() != self.live.epoch();
        let due = if renewed { map.chunk_ids() } else { self.due(touched, last) };
        let revision = |id: [i32; 3]| if renewed { 1 } else { self.live.next_revision(id) };
        let encode = |encoder: &mut ChunkEncoder, id: &[i32; 3]| {
            let chunk = map.chunk(*id);
            if chunk.voxels.is_empty() {
                return Some(Published { id: *id, encoded: None });
            }
            match encoder.encode(&chunk, map.epoch(), revision(*id)) {
                Ok(encoded) => Some(Published { id: *id, encoded: Some(encoded) }),
                Err(error) => {
                    tracing::error!(chunk = ?id, %error, "chunk not published");
                    None
                }
            }
        };
        let published: Vec<Published> = due.par_iter().map_init(ChunkEncoder::default, encode).flatten_iter().collect();
        if renewed {
            self.backlog.lock().unwrap_or_else(PoisonError::into_inner).clear();
        }
        for p in &published {
            self.sent(p.id, p.encoded.as_ref().map_or(0, |e| e.update.points));
        }
        if renewed {
            self.live.renew(map.epoch(), published);
        } else {
            self.live.publish(published);
        }
        if last {
            self.live.whole();
            let hash = self.live.hash();
            self.live.update_progress(|p| {
                p.set_phase(wire::Phase::Finished);
                p.model_hash = hash;
            });
        }
    }

    fn view_done(&self, outcome: &ViewOutcome) {
        self.live.control(Body::View(view_report(outcome, &self.taxonomy)));
        let rejected = u32::from(outcome.result.is_err());
        self.live.update_progress(|p| {
            p.views_done += 1;
            p.views_rejected += rejected;
        });
    }

    fn refined(&self, _views: &[u32], _refinement: &JointRefinement) {}
}
