//! What ends an inspection early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends an inspection early: the view in work is finished, and the model is that of the views until then.
#[derive(Clone, Debug, Default)]
pub struct StopSwitch(Arc<AtomicBool>);

impl StopSwitch {
    /// Ends the inspection early.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody ended it.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// What the stages look at.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.0
    }
}
