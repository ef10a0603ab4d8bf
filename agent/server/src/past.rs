//! What is kept of inspections, as the API and replays use it.

use semascan_inspection::ports::{Archive, Catalogue, Remake, Reports, ReviewLog};
use semascan_inspection::review::ReviewDesk;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long it is believed what was found when it was tried to write.
const AGAIN: Duration = Duration::from_millis(500);

/// What is kept of inspections.
pub struct Past {
    /// Its rows.
    pub(super) catalogue: Arc<dyn Catalogue>,
    /// Its records, files and captured views.
    pub(super) archive: Arc<dyn Archive>,
    /// Where reviews are taken in.
    pub(super) desk: ReviewDesk,
    /// Makes inspections again from their captures.
    pub(super) remake: Arc<dyn Remake>,
    /// Makes reports with what people decided.
    pub(super) reports: Arc<dyn Reports>,
    /// When it was last tried whether more can be kept, and why not; nothing (an empty text) where it can.
    tried: Mutex<Option<(Instant, String)>>,
}

impl Past {
    /// What is kept, through its ports.
    pub fn new(
        catalogue: Arc<dyn Catalogue>,
        archive: Arc<dyn Archive>,
        reviews: Arc<dyn ReviewLog>,
        remake: Arc<dyn Remake>,
        reports: Arc<dyn Reports>,
    ) -> Self {
        let desk = ReviewDesk::new(reviews).with_models(Arc::clone(&archive));
        Self { catalogue, archive, desk, remake, reports, tried: Mutex::default() }
    }
}

impl Past {
    /// Why nothing more can be kept; an empty text where it can. Tried at most once in [`AGAIN`], however many ask.
    pub(super) fn obstacle(&self) -> String {
        let mut tried = self.tried.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((at, reason)) = tried.as_ref()
            && at.elapsed() < AGAIN
        {
            return reason.clone();
        }
        let reason = match self.archive.writable() {
            Ok(()) => String::new(),
            Err(error) => format!("nothing more can be kept: {error}"),
        };
        *tried = Some((Instant::now(), reason.clone()));
        reason
    }
}

impl std::fmt::Debug for Past {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Past").finish_non_exhaustive()
    }
}
