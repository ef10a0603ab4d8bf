//! How far a long computation is, and whether to go on.

use std::ops::ControlFlow;

/// Hears how far a computation is and may end it. Called from any thread.
pub trait Progress: Sync {
    /// `done` of `total` steps are done; `Break` ends the computation soon after.
    fn advance(&self, done: usize, total: usize) -> ControlFlow<()>;
}

/// Nobody listens, nothing is ended.
impl Progress for () {
    fn advance(&self, _done: usize, _total: usize) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<F: Fn(usize, usize) -> ControlFlow<()> + Sync> Progress for F {
    fn advance(&self, done: usize, total: usize) -> ControlFlow<()> {
        self(done, total)
    }
}
