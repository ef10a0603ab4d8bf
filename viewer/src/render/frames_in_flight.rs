//! Frames in flight: submitted, and not finished by the graphics processor yet.
//!
//! A browser takes commands faster than a slow graphics processor carries them out and does not say so: animation frames
//! keep their rate while the pictures come later and later. So the frames in flight are counted, and while there are
//! enough of them no other is drawn; the time between frames then is the time that one takes.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use wgpu::{Device, PollType, Queue};

/// One that is being drawn, and one that waits for it.
const MOST: usize = 2;

/// Counts the frames in flight.
#[derive(Debug, Default)]
pub(super) struct FramesInFlight(Arc<AtomicUsize>);

impl FramesInFlight {
    /// What was submitted to `queue` so far belongs to a frame of its own.
    pub(super) fn submit(&self, queue: &Queue) {
        self.0.fetch_add(1, Ordering::Relaxed);
        let count = self.0.clone();
        queue.on_submitted_work_done(move || {
            count.fetch_sub(1, Ordering::Relaxed);
        });
    }

    /// Whether as many frames as make sense are in flight.
    pub(super) fn is_full(&self, device: &Device) -> bool {
        // WebGL2 is asked; WebGPU reports by itself. A device that fails here is lost, which is reported elsewhere.
        let _ = device.poll(PollType::Poll);
        self.0.load(Ordering::Relaxed) >= MOST
    }
}
