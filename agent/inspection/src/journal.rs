//! The journal of an inspection that is kept: a view is acknowledged to subscribers when its capture and its row are on the
//! disk, and not before.

use crate::event::{EventKind, InspectionEvent};
use crate::ports::{BusMessage, Captures, Catalogue, Commit, EventRow, PortError, ViewRow};
use semascan_model::InspectionId;
use std::sync::{Arc, Mutex, PoisonError};

/// The captures of an inspection, shared by the source that fills them and the journal that makes them durable.
pub type SharedCaptures = Arc<Mutex<dyn Captures>>;

/// Learns of what keeps an inspection from being kept, and gets an empty text when that is over.
pub type Trouble = Box<dyn Fn(&str) + Send>;

/// What happens in an inspection on its way to the disk.
pub struct Journal {
    inspection: InspectionId,
    catalogue: Arc<dyn Catalogue>,
    captures: SharedCaptures,
    pending: Commit,
    next: u64,
}

impl Journal {
    /// The journal of an inspection that the catalogue has begun.
    ///
    /// # Errors
    /// [`PortError`] if the catalogue cannot be read.
    pub fn new(
        inspection: InspectionId,
        catalogue: Arc<dyn Catalogue>,
        captures: SharedCaptures,
    ) -> Result<Self, PortError> {
        let next = catalogue.next_event(inspection)?;
        Ok(Self { inspection, catalogue, captures, pending: Commit::default(), next })
    }

    /// The place of the first event: those of an inspection that is continued follow the earlier ones.
    pub(crate) fn next(&self) -> u64 {
        self.next
    }

    /// Takes an event in. Returns whether subscribers may only learn of it after a [`commit`](Self::commit).
    pub(crate) fn take(&mut self, event: &InspectionEvent) -> bool {
        // What is plain data always serialises.
        let kind = serde_json::to_string(&event.kind).unwrap_or_default();
        let name = match &event.kind {
            EventKind::Started { .. } => Some("started"),
            EventKind::Planned { .. } => Some("planned"),
            EventKind::PlanEnded { .. } => Some("plan_ended"),
            EventKind::ViewFinished { .. } => Some("view_finished"),
            EventKind::Refined { .. } => Some("refined"),
            EventKind::Measured { .. } => Some("measured"),
            EventKind::Found { .. } => Some("found"),
            EventKind::Ended { .. } => Some("ended"),
            EventKind::Stage { .. } | EventKind::ModelChanged { .. } | EventKind::Judged { .. } => None,
        };
        if let EventKind::ViewFinished { record, view } = &event.kind {
            if let Some(view) = view {
                let mut captures = self.captures.lock().unwrap_or_else(PoisonError::into_inner);
                if let Err(error) = captures.append_segmentation(record.index, view) {
                    tracing::error!("the labels of view {} are not kept: {error}", record.index);
                }
            }
            self.pending.view = Some(ViewRow {
                index: record.index,
                accepted: record.accepted,
                record: serde_json::to_string(record).unwrap_or_default(),
            });
        }
        if let Some(name) = name {
            self.pending.messages.push(BusMessage {
                id: format!("{}:{}", self.inspection, event.sequence),
                subject: format!("inspection.{}.{name}", self.inspection),
                payload: kind.clone(),
            });
        }
        self.pending.events.push(EventRow { sequence: event.sequence, time: event.time, kind });
        name.is_some()
    }

    /// Makes all that was taken in durable: the captures first, then the rows that speak of them. After a failure it may be
    /// tried again.
    ///
    /// # Errors
    /// [`PortError`] naming the file or the database.
    pub(crate) fn commit(&mut self) -> Result<(), PortError> {
        self.captures.lock().unwrap_or_else(PoisonError::into_inner).sync()?;
        self.catalogue.commit(self.inspection, &self.pending)?;
        self.pending = Commit::default();
        Ok(())
    }
}
