//! What is kept of inspections, as the API and replays use it.

use semascan_inspection::ports::{Archive, Catalogue, Remake, Reports, ReviewLog};
use semascan_inspection::review::ReviewDesk;
use std::sync::Arc;

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
        Self { catalogue, archive, desk: ReviewDesk::new(reviews), remake, reports }
    }
}

impl std::fmt::Debug for Past {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Past").finish_non_exhaustive()
    }
}
