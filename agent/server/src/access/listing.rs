//! Which logins are listed each in the log of accounts: so many an hour, that a flood of them does not fill the disk. The rest
//! is counted, and the log says where counting began and to what it came.

use semascan_model::account_log::{AccountAction, Unlisted};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Entries of one kind that are listed in a window of time ...
const LISTED: u32 = 100;
/// ... of that length.
const WINDOW: Duration = Duration::from_secs(3600);

/// What was listed of late. Refused logins are one kind, and those of each user who is known another, so that it is no larger
/// than the list of users.
#[derive(Debug, Default)]
pub(super) struct Listing(Mutex<BTreeMap<Unlisted, Window>>);

#[derive(Clone, Copy, Debug)]
struct Window {
    began: Instant,
    listed: u32,
    unlisted: u64,
}

/// How something stands in the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Admission {
    /// Whether it is an entry of its own.
    pub(super) is_listed: bool,
    /// What the agent itself has to say before it: what was counted before, or that counting begins.
    pub(super) remarks: Vec<AccountAction>,
}

impl Listing {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Unlisted, Window>> {
        // Counts that lack one after a panic are still counts.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes something of kind `what` in.
    pub(super) fn admit(&self, what: &Unlisted, now: Instant) -> Admission {
        let mut windows = self.lock();
        let mut remarks = Vec::new();
        let fresh = Window { began: now, listed: 0, unlisted: 0 };
        let window = windows.entry(what.clone()).or_insert(fresh);
        if now.duration_since(window.began) >= WINDOW {
            remarks.extend(counted(what, window.unlisted));
            *window = fresh;
        }
        let is_listed = window.listed < LISTED;
        if is_listed {
            window.listed += 1;
        } else {
            if window.unlisted == 0 {
                remarks.push(AccountAction::NotListed { what: what.clone(), count: None });
            }
            window.unlisted += 1;
        }
        Admission { is_listed, remarks }
    }

    /// What was counted in the windows that are over.
    pub(super) fn over(&self, now: Instant) -> Vec<AccountAction> {
        self.forget(|window| now.duration_since(window.began) >= WINDOW)
    }

    /// What was counted until now.
    pub(super) fn all(&self) -> Vec<AccountAction> {
        self.forget(|_| true)
    }

    fn forget(&self, is_over: impl Fn(&Window) -> bool) -> Vec<AccountAction> {
        let mut remarks = Vec::new();
        self.lock().retain(|what, window| {
            let over = is_over(window);
            if over {
                remarks.extend(counted(what, window.unlisted));
            }
            !over
        });
        remarks
    }
}

fn counted(what: &Unlisted, count: u64) -> Option<AccountAction> {
    (count > 0).then(|| AccountAction::NotListed { what: what.clone(), count: Some(count) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_listed_to_a_number_and_then_counted() {
        let (listing, now) = (Listing::default(), Instant::now());
        let of = |count| vec![AccountAction::NotListed { what: Unlisted::Refused, count }];
        let listed = (0..LISTED)
            .all(|_| listing.admit(&Unlisted::Refused, now) == Admission { is_listed: true, remarks: Vec::new() });
        assert!(listed);
        let first = listing.admit(&Unlisted::Refused, now);
        assert_eq!(first, Admission { is_listed: false, remarks: of(None) });
        for _ in 0..999 {
            let more = listing.admit(&Unlisted::Refused, now);
            assert_eq!(more, Admission { is_listed: false, remarks: Vec::new() });
        }
        // A user who logs in meanwhile is listed.
        let anna = Unlisted::Logins { user: "anna".into() };
        assert!(listing.admit(&anna, now).is_listed);
        assert_eq!(listing.over(now + WINDOW / 2), []);
        let later = listing.admit(&Unlisted::Refused, now + WINDOW);
        assert_eq!(later, Admission { is_listed: true, remarks: of(Some(1000)) });
        // Without another one the count is told by itself, once.
        (0..=LISTED).for_each(|_| drop(listing.admit(&Unlisted::Refused, now + WINDOW)));
        assert_eq!(listing.over(now + 2 * WINDOW), of(Some(2)));
        assert_eq!((listing.over(now + 3 * WINDOW), listing.all()), (vec![], vec![]));
        assert!(listing.lock().is_empty(), "nothing is kept of what is over");
    }
}
