//! Losing the graphics device: it is noticed once, remembered, and awaited by the page.
//!
//! WebGPU tells through the device, WebGL2 through an event of the canvas. Both may tell it from wherever they like, so
//! the memory is shared and the waiting is a future.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};

#[derive(Debug, Default)]
struct State {
    reason: Option<String>,
    waker: Option<Waker>,
}

/// Whether, and why, a device was lost; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Loss(Arc<Mutex<State>>);

impl Loss {
    /// Tells that the device is lost; only the first reason is kept.
    pub fn tell(&self, reason: String) {
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
        let (loss, count) = (Loss::default(), Arc::new(Count::default()));
        let waker = Waker::from(count.clone());
        let mut context = Context::from_waker(&waker);
        let mut wait = pin!(loss.clone().wait());
        assert!(wait.as_mut().poll(&mut context).is_pending());
        loss.tell("first".into());
        loss.tell("second".into());
        assert_eq!(count.0.load(Ordering::Relaxed), 1);
        assert_eq!(wait.as_mut().poll(&mut context), Poll::Ready("first".to_owned()));
        assert_eq!(loss.reason().as_deref(), Some("first"));
    }
}
