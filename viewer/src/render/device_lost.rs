//! The loss of the graphics device: it is noticed once, remembered, and awaited by the page.
//!
//! WebGPU reports it through the device, WebGL2 through an event of the canvas, either from any place in the code: so the
//! record is shared and the waiting is a future.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};

#[derive(Debug, Default)]
struct State {
    reason: Option<String>,
    waker: Option<Waker>,
}

/// Whether, and why, a device was lost; clones share it.
#[derive(Clone, Debug, Default)]
pub struct DeviceLost(Arc<Mutex<State>>);

impl DeviceLost {
    /// Records that the device is lost; only the first reason is kept.
    pub fn report(&self, reason: String) {
        let mut state = self.state();
        if state.reason.is_none() {
            state.reason = Some(reason);
            if let Some(waker) = state.waker.take() {
                waker.wake();
            }
        }
    }

    /// Why the device was lost, if it was.
    pub fn reason(&self) -> Option<String> {
        self.state().reason.clone()
    }

    /// Waits for the loss; one waiter at a time.
    pub async fn wait(self) -> String {
        std::future::poll_fn(|context| {
            let mut state = self.state();
            match &state.reason {
                Some(reason) => Poll::Ready(reason.clone()),
                None => {
                    state.waker = Some(context.waker().clone());
                    Poll::Pending
                }
            }
        })
        .await
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // A poisoned lock still holds a sound state: every change is one assignment.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::pin::pin;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::{Context, Wake};

    #[derive(Default)]
    struct Count(AtomicUsize);

    impl Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn the_waiter_is_woken_by_the_first_reason_only() {
        let (lost, count) = (DeviceLost::default(), Arc::new(Count::default()));
        let waker = Waker::from(count.clone());
        let mut context = Context::from_waker(&waker);
        let mut wait = pin!(lost.clone().wait());
        assert!(wait.as_mut().poll(&mut context).is_pending());
        lost.report("first".into());
        lost.report("second".into());
        assert_eq!(count.0.load(Ordering::Relaxed), 1);
        assert_eq!(wait.as_mut().poll(&mut context), Poll::Ready("first".to_owned()));
        assert_eq!(lost.reason().as_deref(), Some("first"));
    }
}
