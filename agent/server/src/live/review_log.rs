//! What people decided lately, for clients that follow: the latest changes, each with its place. What was decided before a
//! client came it reads through REST.

use super::state::pack;
use axum::body::Bytes;
use semascan_protocol::ReviewChange;
use semascan_protocol::server_message::Body;
use std::collections::VecDeque;

/// Changes that are kept for clients that are behind; one that is farther behind notices by their places in the log.
const KEPT: usize = 256;

#[derive(Debug, Default)]
pub(super) struct ReviewLog {
    latest: u64,
    changes: VecDeque<(u64, Bytes)>,
}

impl ReviewLog {
    pub(super) fn put(&mut self, change: ReviewChange) {
        self.latest += 1;
        self.changes.push_back((self.latest, pack(Body::Review(change))));
        while self.changes.len() > KEPT {
            self.changes.pop_front();
        }
    }

    /// Place of the latest change.
    pub(super) fn latest(&self) -> u64 {
        self.latest
    }

    /// The next change after `place` that is kept, and its place.
    pub(super) fn after(&self, place: u64) -> Option<(u64, Bytes)> {
        let first = self.changes.partition_point(|(own, _)| *own <= place);
        self.changes.get(first).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_come_in_order_and_memory_is_bounded() {
        let mut log = ReviewLog::default();
        assert_eq!(log.after(0), None);
        (0..300).for_each(|sequence| log.put(ReviewChange { sequence, ..ReviewChange::default() }));
        assert_eq!((log.latest(), log.changes.len()), (300, KEPT));
        let (mut place, mut seen) = (0, Vec::new());
        while let Some((next, _)) = log.after(place) {
            seen.push(next);
            place = next;
        }
        assert_eq!(seen, (45..=300).collect::<Vec<_>>());
    }
}
