//! The end of an inspection that is kept in a data folder.

use super::Failure;
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::journal::SharedCaptures;
use semascan_model::record::InspectionRecord;
use semascan_store::data::DataFolder;
use std::sync::{Arc, PoisonError};

/// What an inspection is kept in.
#[derive(Clone)]
pub(crate) struct Keeping {
    data: Arc<DataFolder>,
    captures: SharedCaptures,
}

impl Keeping {
    /// What is kept in `data`, its views in `captures`.
    pub(crate) fn new(data: Arc<DataFolder>, captures: SharedCaptures) -> Self {
        Self { data, captures }
    }

    /// Closes the inspection, whose record is in its folder and was judged by `criteria`.
    ///
    /// # Errors
    /// [`Failure::Work`] naming the file; it is then continued by the next start.
    pub(crate) fn close(&self, record: &InspectionRecord, criteria: Option<&CheckedCriteria>) -> Result<(), Failure> {
        criteria.map_or(Ok(()), |criteria| self.data.keep_criteria(criteria))?;
        self.captures.lock().unwrap_or_else(PoisonError::into_inner).finish()?;
        Ok(self.data.close(record)?)
    }
}
