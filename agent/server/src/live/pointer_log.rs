//! Where people point now, for clients that follow: the latest place of each, for some seconds.

use super::state::pack;
use axum::body::Bytes;
use semascan_protocol::Pointer;
use semascan_protocol::server_message::Body;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// People whose pointers are passed on at once.
const KEPT: usize = 64;
/// How long a pointer waits for a client that is behind.
const FRESH: Duration = Duration::from_secs(5);

#[derive(Debug)]
struct Told {
    place: u64,
    at: Instant,
    viewer: String,
    message: Bytes,
}

#[derive(Debug, Default)]
pub(super) struct PointerLog {
    latest: u64,
    told: VecDeque<Told>,
}

impl PointerLog {
    /// Puts a pointer in place of the one before of the same viewer.
    pub(super) fn put(&mut self, pointer: &Pointer, at: Instant) {
        self.latest += 1;
        self.told.retain(|told| told.viewer != pointer.viewer && at.duration_since(told.at) < FRESH);
        let (viewer, message) = (pointer.viewer.clone(), pack(Body::Pointer(pointer.clone())));
        self.told.push_back(Told { place: self.latest, at, viewer, message });
        while self.told.len() > KEPT {
            self.told.pop_front();
        }
    }

    /// Place of the latest pointer.
    pub(super) fn latest(&self) -> u64 {
        self.latest
    }

    /// The next pointer after `place` that still holds at `now`, and its place.
    pub(super) fn after(&self, place: u64, now: Instant) -> Option<(u64, Bytes)> {
        let is_due = |told: &&Told| told.place > place && now.duration_since(told.at) < FRESH;
        self.told.iter().find(is_due).map(|told| (told.place, told.message.clone()))
    }
}

/// A client that takes pointers, while it follows.
#[derive(Debug)]
pub(crate) struct Attendance<'a>(&'a AtomicU32);

impl<'a> Attendance<'a> {
    pub(super) fn of(attending: &'a AtomicU32) -> Self {
        attending.fetch_add(1, Ordering::Relaxed);
        Self(attending)
    }
}

impl Drop for Attendance<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pointer(viewer: usize) -> Pointer {
        Pointer { viewer: viewer.to_string(), ..Pointer::default() }
    }

    #[test]
    fn of_each_viewer_the_latest_is_passed_on_while_it_is_fresh() {
        let (mut log, now) = (PointerLog::default(), Instant::now());
        for viewer in [1, 2, 1, 1] {
            log.put(&pointer(viewer), now);
        }
        let places = |log: &PointerLog, at: Instant| {
            let (mut place, mut seen) = (0, Vec::new());
            while let Some((next, _)) = log.after(place, at) {
                seen.push(next);
                place = next;
            }
            seen
        };
        assert_eq!((places(&log, now), log.latest()), (vec![2, 4], 4));
        assert!(places(&log, now + FRESH).is_empty(), "it is forgotten");
        log.put(&pointer(3), now + FRESH);
        assert_eq!(log.told.len(), 1);
    }

    #[test]
    fn memory_is_bounded_however_many_point() {
        let (mut log, now) = (PointerLog::default(), Instant::now());
        (0..1000).for_each(|viewer| log.put(&pointer(viewer), now));
        assert_eq!(log.told.len(), KEPT);
    }
}
