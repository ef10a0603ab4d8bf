//! What people decide about an inspection: reviews are taken in, kept in an append-only log, and what follows from them is
//! computed from that log alone.
//!
//! | file | what |
//! |---|---|
//! | `rules.rs` | which reviews can be taken in |
//! | `standing.rs` | which decisions stand, and which contradict each other |
//! | `state.rs` | findings and verdict with everything that people decided |
//! | `measured.rs` | figures of the findings that people draw |
//! | `measurements.rs` | measurements that people keep |
//! | `held.rs` | what is held of inspections between two requests |
//! | `mod.rs` | [`ReviewDesk`], which takes reviews in |

mod held;
mod measured;
mod measurements;
mod rules;
mod standing;
mod state;

pub use rules::FieldError;
pub use state::{drawn_name, reviewed_state, with_drawn};

use crate::chain;
use crate::criteria::CheckedCriteria;
use crate::ports::{Archive, BusMessage, FindingRow, PortError, ResultRow, ReviewLog, ReviewResult};
use held::{Held, Standing, changes_findings};
use jiff::Timestamp;
use semascan_model::InspectionId;
use semascan_model::finding::Finding;
use semascan_model::record::{InspectionRecord, Outcome, SoftwareRecord};
use semascan_model::review::{NetworkVersion, Review, ReviewEntry, ReviewedState, ReviewedVersions};
use state::Judged;
use std::sync::{Arc, Mutex, PoisonError};

/// Why a review is not taken in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReviewError {
    /// A field cannot be used.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// There is another review of this name.
    #[error("id: there is another review with this id, which says something else")]
    Other(Box<ReviewEntry>),
    /// The inspection runs.
    #[error("inspection {0} has not ended: its findings are not known yet")]
    Running(InspectionId),
    /// The model is not the one that the person saw.
    #[error("model: the inspection has another model by now ({now})")]
    Model {
        /// Its generation.
        now: String,
    },
    /// The log cannot be used.
    #[error(transparent)]
    Port(#[from] PortError),
}

/// A review that is in the log.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken {
    /// Its entry.
    pub entry: ReviewEntry,
    /// Whether it was in the log before: it was sent again.
    pub is_known: bool,
    /// What the inspection comes to.
    pub state: ReviewedState,
}

/// Takes reviews in, one after the other: the only one who appends to the log.
pub struct ReviewDesk {
    log: Arc<dyn ReviewLog>,
    /// The models that people draw on; without them what they draw is not measured.
    models: Option<Arc<dyn Archive>>,
    held: Held,
    taking: Mutex<()>,
}

impl ReviewDesk {
    /// The desk of `log`.
    pub fn new(log: Arc<dyn ReviewLog>) -> Self {
        Self { log, models: None, held: Held::default(), taking: Mutex::new(()) }
    }

    /// The same, where findings that people draw are measured on these models.
    pub fn with_models(self, models: Arc<dyn Archive>) -> Self {
        Self { models: Some(models), ..self }
    }

    /// The log.
    pub fn log(&self) -> &dyn ReviewLog {
        self.log.as_ref()
    }

    /// The inspection with this record as it stands after all reviews. `criteria` are those that it was judged by, where they
    /// are at hand.
    ///
    /// # Errors
    /// [`PortError`] if the log cannot be read.
    pub fn state(
        &self,
        record: &InspectionRecord,
        criteria: Option<&CheckedCriteria>,
    ) -> Result<ReviewedState, PortError> {
        let Standing { standings, judged } = self.held.standing(self.log.as_ref(), record, criteria)?;
        Ok(judged.state(&standings))
    }

    /// Takes `review` of the inspection with `record` in. One that was sent before is answered as it was then.
    ///
    /// # Errors
    /// [`ReviewError`] naming the field; nothing was taken in.
    pub fn take(
        &self,
        record: &InspectionRecord,
        criteria: Option<&CheckedCriteria>,
        review: Review,
        at: Timestamp,
    ) -> Result<Taken, ReviewError> {
        // Before others have to wait: it takes longer than all else.
        let drawn = self.measured(record, &review)?;
        let _one_at_a_time = self.taking.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(entry) = self.log.entry(review.id)? {
            if entry.review != review || entry.inspection != record.id {
                return Err(ReviewError::Other(Box::new(entry)));
            }
            let state = self.state(record, criteria)?;
            return Ok(Taken { entry, is_known: true, state });
        }
        if record.outcome == Outcome::Running {
            return Err(ReviewError::Running(record.id));
        }
        let versions = versions(record);
        if let (Some(seen), Some(now)) = (&review.model, &versions.model)
            && seen != now
        {
            return Err(ReviewError::Model { now: now.clone() });
        }
        let Standing { mut standings, mut judged } = self.held.standing(self.log.as_ref(), record, criteria)?;
        let last = self.log.last()?;
        // A finding that was found in error can be called one again.
        let measured = record.findings.iter().flat_map(|findings| &findings.list);
        let in_error = measured.filter(|finding| judged.amended.found_in_error.contains(&finding.id));
        let known: Vec<&Finding> = judged.amended.findings.iter().flatten().chain(in_error).collect();
        rules::check(&review, record, &known, &standings, last)?;
        let conflicts_with =
            standings.of_subject(&review.subject).map_or_else(Vec::new, |standing| standing.contradicted_by(&review));
        let entry =
            ReviewEntry { sequence: last + 1, inspection: record.id, at, versions, conflicts_with, review, drawn };
        Arc::make_mut(&mut standings).extend(&Arc::new(entry.clone()));
        let is_changed = changes_findings(&entry);
        if is_changed {
            judged = Arc::new(Judged::of(record, &standings, criteria));
        }
        let state = judged.state(&standings);
        let message = BusMessage {
            id: format!("review:{}", entry.review.id),
            subject: format!("inspection.{}.reviewed", record.id),
            // What is plain data always serialises.
            payload: chain::canonical(&entry).unwrap_or_default(),
        };
        let hash = self.log.append(&entry, &result(record, &state, is_changed), &message)?;
        self.held.appended(&entry, hash, Standing { standings, judged }, record, criteria);
        Ok(Taken { entry, is_known: false, state })
    }
}

/// What is listed of an inspection in this state, its findings where they are others than before.
fn result(record: &InspectionRecord, state: &ReviewedState, is_changed: bool) -> ReviewResult {
    let row = ResultRow {
        decision: state.decision,
        automatic: record.verdict.as_ref().map(|verdict| verdict.automatic),
        conflicts: state.conflicts,
        findings: state.findings.as_ref().map(|list| list.len() as u32),
    };
    ReviewResult { row, findings: is_changed.then(|| state.findings.iter().flatten().map(FindingRow::of).collect()) }
}

fn versions(record: &InspectionRecord) -> ReviewedVersions {
    let networks = record.networks.as_ref().map_or_else(Vec::new, |networks| {
        let models = networks.network.models.iter();
        models
            .map(|model| NetworkVersion {
                name: format!("{} {}", model.name, model.version),
                sha256: model.networks.iter().map(|file| file.sha256.clone()).collect(),
            })
            .collect()
    });
    ReviewedVersions {
        software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
        inspected_with: record.software.clone(),
        model: record.files.as_ref().map(|files| files.generation.clone()),
        networks,
        criteria: record.verdict.as_ref().map(|verdict| verdict.criteria.clone()),
    }
}

#[cfg(test)]
mod tests;
