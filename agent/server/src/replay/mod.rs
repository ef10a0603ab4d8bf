//! Past inspections, streamed as they were live: at any speed and from any event.
//!
//! The first viewer of one waits until its tape is made, which takes as long as the inspection took to compute; the latest tapes
//! are kept, and every viewer has a player of its own. Of the same tapes the messages of a file are made.

mod messages;
mod player;
mod tape;

pub(super) use player::Pace;
use tape::Tape;

use super::live::LiveModel;
use super::past::Past;
use super::saved::publish_saved;
use semascan_inspection::ports::PortError;
use semascan_model::InspectionId;
use semascan_protocol::{FileMessage, Phase, Pointer, ReviewChange};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use tokio::sync::{Mutex as AsyncMutex, oneshot};

/// Tapes that are kept.
const TAPES: usize = 2;
/// Viewers of past inspections at once: each has a copy of the compressed model.
const VIEWERS: usize = 32;

/// Streams past inspections.
#[derive(Debug, Default)]
pub(super) struct Replays {
    /// The latest tapes, the last used one at the end. Whoever needs one that is not there makes it, one at a time: that takes
    /// the whole machine.
    tapes: AsyncMutex<Vec<(InspectionId, Arc<Tape>)>>,
    /// What viewers follow.
    followed: Mutex<Vec<Weak<LiveModel>>>,
}

impl Replays {
    /// Begins to stream a past inspection; `None` where too many are streamed already.
    pub(super) fn begin(self: &Arc<Self>, past: &Arc<Past>, id: InspectionId, pace: Pace) -> Option<Arc<LiveModel>> {
        let live = Arc::new(LiveModel::new());
        {
            let mut followed = self.followed.lock().unwrap_or_else(PoisonError::into_inner);
            followed.retain(|live| live.strong_count() > 0);
            if followed.len() >= VIEWERS {
                return None;
            }
            followed.push(Arc::downgrade(&live));
        }
        live.say("the inspection is made again from its captured views");
        tokio::spawn(Arc::clone(self).stream(Arc::clone(past), id, pace, Arc::downgrade(&live)));
        Some(live)
    }

    /// Tells everybody who follows a past inspection what somebody decided.
    pub(super) fn tell_review(&self, change: &ReviewChange) {
        let followed = self.followed.lock().unwrap_or_else(PoisonError::into_inner);
        followed.iter().filter_map(Weak::upgrade).for_each(|live| live.review(change.clone()));
    }

    /// Tells everybody who follows a past inspection where somebody points on it; how many they are.
    pub(super) fn tell_pointer(&self, inspection: &str, pointer: &Pointer) -> u32 {
        let followed = self.followed.lock().unwrap_or_else(PoisonError::into_inner);
        followed.iter().filter_map(Weak::upgrade).map(|live| live.point(inspection, pointer)).sum()
    }

    /// The messages of an inspection, as viewers that keep up with it are sent them; of one that cannot be made again those of its
    /// final model.
    ///
    /// # Errors
    /// [`PortError`] where there is nothing to be sent.
    pub(super) async fn messages(&self, past: &Arc<Past>, id: InspectionId) -> Result<Vec<FileMessage>, PortError> {
        let fault = |_| PortError::new(format!("inspection {id}"), "a fault of the program");
        match self.tape(past, id, || true).await {
            Ok(Some(tape)) => tokio::task::spawn_blocking(move || messages::of_tape(&tape)).await.map_err(fault),
            Ok(None) => Ok(Vec::new()),
            Err(error) => {
                let past = Arc::clone(past);
                let shown = tokio::task::spawn_blocking(move || {
                    let live = LiveModel::new();
                    show_final(&past, id, &live, &error);
                    let progress = live.progress();
                    match progress.phase() {
                        Phase::Failed => Err(PortError::new(format!("inspection {id}"), progress.message)),
                        _ => Ok(messages::of_model(&live)),
                    }
                });
                shown.await.map_err(fault)?
            }
        }
    }

    async fn stream(self: Arc<Self>, past: Arc<Past>, id: InspectionId, pace: Pace, live: Weak<LiveModel>) {
        match self.tape(&past, id, || live.strong_count() > 0).await {
            Ok(Some(tape)) => player::play(tape, live, pace).await,
            Ok(None) => {}
            Err(error) => {
                tracing::warn!("inspection {id} cannot be streamed as it was: {error}");
                let shown = tokio::task::spawn_blocking(move || {
                    if let Some(live) = live.upgrade() {
                        show_final(&past, id, &live, &error);
                    }
                });
                if let Err(error) = shown.await {
                    tracing::error!("inspection {id} cannot be shown: {error}");
                }
            }
        }
    }

    /// The tape of an inspection; `None` where it is not wanted any more when it is its turn.
    async fn tape(
        &self,
        past: &Arc<Past>,
        id: InspectionId,
        is_wanted: impl FnOnce() -> bool,
    ) -> Result<Option<Arc<Tape>>, PortError> {
        let mut tapes = self.tapes.lock().await;
        if !is_wanted() {
            return Ok(None);
        }
        if let Some(place) = tapes.iter().position(|(own, _)| *own == id) {
            let known = tapes.remove(place);
            let tape = Arc::clone(&known.1);
            tapes.push(known);
            return Ok(Some(tape));
        }
        // On a thread of its own: a server that ends does not wait for it.
        let (sender, made) = oneshot::channel();
        let past = Arc::clone(past);
        std::thread::spawn(move || {
            let row = past
                .catalogue
                .inspection(id)
                .and_then(|row| row.ok_or_else(|| PortError::new(format!("inspection {id}"), "there is none")));
            // Who waited may be gone.
            let _ = sender.send(row.and_then(|row| Tape::make(&past, &row)));
        });
        let ended =
            |_| PortError::new(format!("inspection {id}"), "it could not be made again: a fault of the program");
        let tape = Arc::new(made.await.map_err(ended)??);
        if tapes.len() >= TAPES {
            tapes.remove(0);
        }
        tapes.push((id, Arc::clone(&tape)));
        Ok(Some(tape))
    }
}

/// Shows the final model of an inspection that cannot be made again because of `error`.
fn show_final(past: &Past, id: InspectionId, live: &LiveModel, error: &PortError) {
    let shown = past.archive.record(id).and_then(|record| Ok(record.zip(past.archive.model(id)?)));
    let why = format!("only the final model can be shown: {}", error.reason);
    match shown {
        Ok(Some((record, (taxonomy, cloud)))) => match publish_saved(live, &record, &taxonomy, &cloud) {
            Ok(_) => live.say(&why),
            Err(error) => live.fail(&error.to_string()),
        },
        Ok(None) => live.fail(&format!("there is nothing to show: {}", error.reason)),
        Err(error) => live.fail(&format!("there is nothing to show: {}", error.reason)),
    }
}
