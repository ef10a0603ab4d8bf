//! The model as clients shall see it: every chunk's newest revision, encoded once for all, and the control messages.
//!
//! Chunks stand in the order of their last change. A client remembers how far along that order it is, one number; a
//! chunk that changes again moves to the end, so an unsent older revision is replaced by the newer one by itself.
//!
//! Of the views a client is sent the reports of the latest ones, and asks for pages of earlier ones.
//!
//! A rebuilt map comes as a whole ([`LiveModel::renew`]): the client is sent the announcement of a successor, then its chunks,
//! then that these were all, so that it can go on showing the old model until then.

mod capture_desk;
mod pointer_log;
mod review_log;
mod stage_log;
mod state;
mod view_log;

use crate::metrics::Metrics;
use axum::body::Bytes;
pub(crate) use capture_desk::CaptureAnswer;
use capture_desk::CaptureDesk;
use pointer_log::{Attendance, PointerLog};
use review_log::ReviewLog;
use semascan_inspection::source::CaptureTrigger;
use semascan_protocol as wire;
use semascan_protocol::chunk::model_hash;
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    Clear, Hello, Inspection, Pointer, Progress, ReviewChange, StageEvent, TAKES_POINTERS, TAKES_REVIEWS, ViewReport,
    ViewRequest,
};
use stage_log::StageLog;
pub use state::StreamTotals;
pub(super) use state::{Cursor, Published, pack};
use state::{LiveChunk, State};
use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;
use view_log::ViewLog;

/// Shared by the inspection and all clients.
#[derive(Debug)]
pub struct LiveModel {
    state: Mutex<State>,
    changed: watch::Sender<()>,
    /// Clients that follow and take pointers.
    attending: AtomicU32,
    metrics: Metrics,
    /// Why the agent is not ready; empty where it is.
    unready: Mutex<String>,
    captures: CaptureDesk,
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
            stages: StageLog::default(),
            views: ViewLog::default(),
            reviews: ReviewLog::default(),
            pointers: PointerLog::default(),
            progressed: Instant::now(),
            totals: StreamTotals::default(),
            whole_at: None,
        };
        Self {
            state: Mutex::new(state),
            changed: watch::Sender::new(()),
            attending: AtomicU32::new(0),
            metrics: Metrics::default(),
            unready: Mutex::default(),
            captures: CaptureDesk::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code below panics between two related writes, so a poisoned state is still whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is counted of the inspections that are published here.
    pub(super) fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// Says why the agent is not ready for work, as `/readyz` tells; an empty text where it is.
    pub fn set_unready(&self, reason: &str) {
        reason.clone_into(&mut self.unready.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Why the agent is not ready for work; an empty text where it is.
    pub(super) fn unready(&self) -> String {
        self.unready.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// An inspection runs; clients may ask for views of it with `trigger`, where its source can be asked.
    pub fn take_captures(&self, inspection: &str, trigger: Option<CaptureTrigger>) {
        self.captures.open(inspection.to_owned(), trigger);
    }

    /// It does not run any more.
    pub fn end_captures(&self) {
        self.captures.close();
    }

    /// Asks for a view of an inspection; `id` was made by who asks.
    pub(crate) fn ask_for_capture(&self, inspection: &str, id: &str) -> CaptureAnswer {
        self.captures.ask(inspection, id)
    }

    /// Changes whenever there may be something new.
    pub(super) fn changes(&self) -> watch::Receiver<()> {
        self.changed.subscribe()
    }

    /// Begins a new inspection: every client clears.
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
        state.stages = StageLog::default();
        state.views = ViewLog::default();
        state.progressed = Instant::now();
        state.totals = StreamTotals::default();
        state.whole_at = None;
        drop(state);
        self.changed.send_replace(());
    }

    /// The epoch that is being published.
    pub(super) fn epoch(&self) -> u32 {
        self.lock().inspection.epoch
    }

    /// Puts the whole model of a new epoch of the same inspection in place of the old one, at once: no client ever sees
    /// a part of it as if it were all, and none has to show less than it showed.
    pub(super) fn renew(&self, epoch: u32, chunks: Vec<Published>) {
        let mut state = self.lock();
        state.generation += 1;
        state.inspection.epoch = epoch;
        state.chunks.clear();
        state.by_change.clear();
        (state.totals.snapshot_bytes, state.totals.points) = (0, 0);
        state.put(chunks);
        state.whole_at = Some(state.changes);
        drop(state);
        self.changed.send_replace(());
    }

    /// What has been published is the epoch's whole model.
    pub(super) fn whole(&self) {
        let mut state = self.lock();
        state.whole_at = Some(state.changes);
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
        self.lock().put(chunks);
        self.changed.send_replace(());
    }

    /// Tells that a stage of a view began, ended or failed.
    pub(super) fn stage(&self, event: StageEvent) {
        self.lock().stages.put(event);
        self.changed.send_replace(());
    }

    /// Tells what became of a view.
    pub(super) fn view(&self, report: ViewReport) {
        let mut state = self.lock();
        state.stages.reported(report.index);
        state.views.put(report);
        drop(state);
        self.changed.send_replace(());
    }

    /// Tells what somebody decided; of whichever inspection, it is for everybody who takes reviews.
    pub(super) fn review(&self, change: ReviewChange) {
        self.lock().reviews.put(change);
        self.changed.send_replace(());
    }

    /// Tells where somebody points on the surface of `inspection`, if that is the one that is published; how many are told.
    pub(super) fn point(&self, inspection: &str, pointer: &Pointer) -> u32 {
        let mut state = self.lock();
        if state.inspection.id != inspection {
            return 0;
        }
        state.pointers.put(pointer, Instant::now());
        drop(state);
        self.changed.send_replace(());
        self.attending.load(Ordering::Relaxed)
    }

    /// Counts the client at `cursor`, while it follows, among those who are told where others point.
    pub(super) fn attend(&self, cursor: &Cursor) -> Option<Attendance<'_>> {
        cursor.takes_pointers.then(|| Attendance::of(&self.attending))
    }

    /// The inspection did something.
    pub(super) fn progressed(&self) {
        self.lock().progressed = Instant::now();
    }

    /// Where the inspection stands, which it is, and how long ago it did something.
    pub(super) fn standing(&self) -> (Progress, String, Duration) {
        let state = self.lock();
        (state.progress.clone(), state.inspection.id.clone(), state.progressed.elapsed())
    }

    /// What a client asked for with `request`: the page, and its reports.
    pub(super) fn page(&self, request: &ViewRequest) -> (Bytes, Vec<Bytes>) {
        let (page, reports) = self.lock().views.page(request);
        (pack(Body::Page(page)), reports)
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

    /// Tells clients that the inspection failed, and why.
    pub fn fail(&self, reason: &str) {
        self.update_progress(|p| {
            p.set_phase(wire::Phase::Failed);
            p.message = reason.into();
        });
    }

    /// Tells clients something of an inspection that is over.
    pub fn say(&self, message: &str) {
        self.update_progress(|p| p.message = message.into());
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

    /// A client arrives with what it holds and what it takes: its cursor and the Welcome it is due.
    pub(super) fn welcome(&self, hello: &Hello) -> (Cursor, Bytes) {
        let state = self.lock();
        let Hello { inspection_id, epoch, held, capabilities, .. } = hello;
        let resumed =
            !inspection_id.is_empty() && *inspection_id == state.inspection.id && *epoch == state.inspection.epoch;
        let held = if resumed {
            // Only what is still the newest: a list of anything else would be the client's to make as long as it likes.
            let newest = |id, revision| state.chunks.get(&id).is_some_and(|c: &LiveChunk| c.revision == revision);
            let held = held.iter().filter_map(|h| Some((h.id?.to_array(), h.revision)));
            held.filter(|(id, revision)| newest(*id, *revision)).collect()
        } else {
            HashMap::new()
        };
        let welcome = wire::Welcome {
            agent: concat!("semascan ", env!("CARGO_PKG_VERSION")).into(),
            capabilities: Vec::new(),
            inspection: Some(state.inspection.clone()),
            resumed,
        };
        let takes = |what: &str| capabilities.iter().any(|capability| capability == what);
        let (takes_reviews, takes_pointers) = (takes(TAKES_REVIEWS), takes(TAKES_POINTERS));
        let review = state.reviews.latest();
        let cursor = Cursor { held, takes_reviews, takes_pointers, review, ..Cursor::at_the_beginning(&state) };
        (cursor, pack(Body::Welcome(welcome)))
    }

    /// The next message for a client, `None` if it has everything.
    pub(super) fn next(&self, cursor: &mut Cursor) -> Option<Bytes> {
        let state = self.lock();
        if cursor.generation != state.generation {
            let successor = cursor.inspection == state.inspection.id;
            let old = std::mem::replace(cursor, Cursor::at_the_beginning(&state));
            (cursor.review, cursor.takes_reviews) = (old.review, old.takes_reviews);
            cursor.takes_pointers = old.takes_pointers;
            if successor {
                *cursor = old.at_the_next_epoch(&state);
            }
            return Some(pack(Body::Clear(Clear { inspection: Some(state.inspection.clone()), successor })));
        }
        if let Some(report) = cursor.page.pop_front() {
            return Some(report);
        }
        if let Some((place, event)) = state.stages.after(cursor.stage) {
            cursor.stage = place;
            return Some(event);
        }
        if cursor.takes_reviews
            && let Some((place, change)) = state.reviews.after(cursor.review)
        {
            cursor.review = place;
            return Some(change);
        }
        if cursor.takes_pointers
            && let Some((place, pointer)) = state.pointers.after(cursor.pointer, Instant::now())
        {
            cursor.pointer = place;
            return Some(pointer);
        }
        if state.views.is_far_behind(cursor.view) {
            let (page, reports) = state.views.page(&ViewRequest::default());
            cursor.view = state.views.latest();
            cursor.page = reports.into();
            return Some(pack(Body::Page(page)));
        }
        if let Some((place, report)) = state.views.after(cursor.view) {
            cursor.view = place;
            return Some(report);
        }
        let progress = state.progress_for(cursor);
        if progress.phase() == wire::Phase::Running && cursor.progress.as_ref() != Some(&progress) {
            cursor.progress = Some(progress.clone());
            return Some(pack(Body::Progress(progress)));
        }
        while let Some((&change, id)) = state.by_change.range(cursor.change + 1..).next() {
            // Places in the order that are gone are those of revisions that newer ones took the place of.
            let seen = cursor.change.max(cursor.arrived);
            self.metrics.superseded(change.saturating_sub(seen + 1));
            cursor.change = change;
            let Some(chunk) = state.chunks.get(id) else { continue };
            if cursor.held.remove(id) != Some(chunk.revision) {
                return Some(chunk.message.clone());
            }
        }
        // The end, and that a model is whole, are sent after the last chunk.
        let progress = state.progress_for(cursor);
        if cursor.progress.as_ref() != Some(&progress) {
            cursor.progress = Some(progress.clone());
            return Some(pack(Body::Progress(progress)));
        }
        None
    }
}

impl Default for LiveModel {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
