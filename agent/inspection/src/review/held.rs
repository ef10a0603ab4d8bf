//! What is held of inspections between two requests, so that a review costs the same however long the log is.
//!
//! The log on the disk is the truth. For each request the entries behind those that are held are read, and the last one that is
//! held once more: where it does not have the hash of before, everything is read again.

use super::standing::Standings;
use super::state::Judged;
use crate::criteria::CheckedCriteria;
use crate::ports::{LoggedReview, PortError, ReviewLog};
use semascan_model::InspectionId;
use semascan_model::record::InspectionRecord;
use semascan_model::review::{ReviewAction, ReviewEntry};
use semascan_model::verdict::Verdict;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Inspections that are held; of more than these the one that was asked for longest ago is forgotten.
const MOST: usize = 16;

/// An inspection as it stands.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    pub(super) standings: Arc<Standings>,
    pub(super) judged: Arc<Judged>,
}

/// The inspections that were asked for last.
#[derive(Debug, Default)]
pub(super) struct Held(Mutex<Inspections>);

#[derive(Debug, Default)]
struct Inspections {
    by_id: HashMap<InspectionId, Inspection>,
    /// Counts requests.
    clock: u64,
}

#[derive(Debug, Default)]
struct Inspection {
    standings: Arc<Standings>,
    /// Hash of the last entry; empty where there is none.
    hash: String,
    /// What its findings come to, and of what that was computed.
    judged: Option<(Basis, Arc<Judged>)>,
    used: u64,
}

/// What findings are judged by, beside the log: where it is another one they are judged anew.
#[derive(Clone, Debug, PartialEq)]
struct Basis {
    generation: Option<String>,
    verdict: Option<Verdict>,
    measured: Option<usize>,
    criteria: Option<String>,
}

impl Basis {
    fn of(record: &InspectionRecord, criteria: Option<&CheckedCriteria>) -> Self {
        Self {
            generation: record.files.as_ref().map(|files| files.generation.clone()),
            verdict: record.verdict.clone(),
            measured: record.findings.as_ref().map(|findings| findings.list.len()),
            criteria: criteria.map(|criteria| criteria.record.sha256.clone()),
        }
    }
}

impl Held {
    /// The inspection with this record after all entries of `log`.
    pub(super) fn standing(
        &self,
        log: &dyn ReviewLog,
        record: &InspectionRecord,
        criteria: Option<&CheckedCriteria>,
    ) -> Result<Standing, PortError> {
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let inspection = held.inspection(record.id);
        if let Err(error) = inspection.catch_up(log, record.id) {
            held.by_id.remove(&record.id);
            return Err(error);
        }
        let basis = Basis::of(record, criteria);
        let judged = match &inspection.judged {
            Some((known, judged)) if *known == basis => Arc::clone(judged),
            _ => {
                let judged = Arc::new(Judged::of(record, &inspection.standings, criteria));
                inspection.judged = Some((basis, Arc::clone(&judged)));
                judged
            }
        };
        Ok(Standing { standings: Arc::clone(&inspection.standings), judged })
    }

    /// Notes that `entry` with this hash was appended to the log, after which its inspection is `after`, with this record.
    pub(super) fn appended(
        &self,
        entry: &ReviewEntry,
        hash: String,
        after: Standing,
        record: &InspectionRecord,
        criteria: Option<&CheckedCriteria>,
    ) {
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let inspection = held.inspection(entry.inspection);
        // Somebody who asked meanwhile has read it from the disk.
        if inspection.standings.last < entry.sequence {
            let judged = Some((Basis::of(record, criteria), after.judged));
            *inspection = Inspection { standings: after.standings, hash, judged, used: inspection.used };
        }
    }
}

impl Inspections {
    /// What is held of an inspection; nothing yet where it is new.
    fn inspection(&mut self, id: InspectionId) -> &mut Inspection {
        self.clock += 1;
        if self.by_id.len() >= MOST
            && !self.by_id.contains_key(&id)
            && let Some(oldest) = self.by_id.iter().min_by_key(|(_, one)| one.used).map(|(id, _)| *id)
        {
            self.by_id.remove(&oldest);
        }
        let inspection = self.by_id.entry(id).or_default();
        inspection.used = self.clock;
        inspection
    }
}

impl Inspection {
    /// Takes in the entries that the log has behind those that are held.
    fn catch_up(&mut self, log: &dyn ReviewLog, id: InspectionId) -> Result<(), PortError> {
        let mut entries = log.entries(id, self.standings.last, u32::MAX)?;
        let is_new = self.standings.last == 0;
        let follows =
            entries.first().is_some_and(|first| first.entry.sequence == self.standings.last && first.hash == self.hash);
        if follows {
            entries.remove(0);
        } else if !is_new {
            tracing::warn!("the log of reviews of inspection {id} is another one than before: it is read again");
            *self = Self { used: self.used, ..Self::default() };
            entries = log.entries(id, 0, u32::MAX)?;
        }
        if entries.is_empty() {
            return Ok(());
        }
        if entries.iter().any(|logged| changes_findings(&logged.entry)) {
            self.judged = None;
        }
        let standings = Arc::make_mut(&mut self.standings);
        for LoggedReview { entry, hash } in entries {
            standings.extend(&Arc::new(entry));
            self.hash = hash;
        }
        Ok(())
    }
}

/// Whether findings are others after `entry` than before.
pub(super) fn changes_findings(entry: &ReviewEntry) -> bool {
    matches!(entry.review.action, ReviewAction::NewFinding { .. } | ReviewAction::Reclassify { .. })
}
