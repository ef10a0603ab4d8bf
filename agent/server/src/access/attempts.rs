//! How often a login may fail: by address, so that nobody guesses through a list of names, and by user, so that nobody guesses
//! from many addresses. An attempt counts before its password is looked at, so that many at once are no way around. Attempts at an
//! identity provider, which name nobody, are counted by address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Attempts count for so long.
const WINDOW: Duration = Duration::from_secs(300);
/// Failed attempts from one address in that time.
const OF_ADDRESS: usize = 20;
/// Failed attempts for one user in that time.
const OF_USER: usize = 10;
/// Addresses and names that are remembered each.
const REMEMBERED: usize = 4096;

/// The attempts of late.
#[derive(Debug, Default)]
pub(super) struct Attempts(Mutex<Counts>);

#[derive(Debug, Default)]
struct Counts {
    by_address: HashMap<IpAddr, Vec<Instant>>,
    by_user: HashMap<String, Vec<Instant>>,
}

impl Attempts {
    fn lock(&self) -> MutexGuard<'_, Counts> {
        // A list that lacks an entry after a panic is still a list.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts an attempt from `address`, for `user` where one is named; if there were too many, the time after which one may be
    /// made again.
    pub(super) fn begin(&self, address: IpAddr, user: Option<&str>, now: Instant) -> Result<(), Duration> {
        let mut counts = self.lock();
        let Counts { by_address, by_user } = &mut *counts;
        let wait = [
            wait(by_address.get(&address), OF_ADDRESS, now),
            wait(user.and_then(|user| by_user.get(user)), OF_USER, now),
        ];
        if let Some(wait) = wait.into_iter().flatten().max() {
            return Err(wait);
        }
        note(by_address, address, now);
        if let Some(user) = user {
            note(by_user, user.to_owned(), now);
        }
        Ok(())
    }

    /// The attempt that began `then` was right: it counts no more, and neither do those for the user before it.
    pub(super) fn succeeded(&self, address: IpAddr, user: Option<&str>, then: Instant) {
        let mut counts = self.lock();
        if let Some(user) = user {
            counts.by_user.remove(user);
        }
        let Some(times) = counts.by_address.get_mut(&address) else { return };
        if let Some(place) = times.iter().position(|time| *time == then) {
            times.remove(place);
        }
    }
}

/// How long to wait until fewer than `most` of `times` count.
fn wait(times: Option<&Vec<Instant>>, most: usize, now: Instant) -> Option<Duration> {
    let times = times?;
    let counting = times.iter().filter(|time| now.duration_since(**time) < WINDOW).count();
    let oldest = times.get(times.len().checked_sub(most)?)?;
    (counting >= most).then(|| WINDOW.saturating_sub(now.duration_since(*oldest)))
}

fn note<K: Clone + Eq + std::hash::Hash>(counts: &mut HashMap<K, Vec<Instant>>, key: K, now: Instant) {
    if counts.len() >= REMEMBERED && !counts.contains_key(&key) {
        counts.retain(|_, times| times.last().is_some_and(|time| now.duration_since(*time) < WINDOW));
        // Where all of them count, the one that has been quiet for longest is forgotten.
        let quietest = counts.iter().min_by_key(|(_, times)| times.last().copied()).map(|(key, _)| key.clone());
        if let Some(quietest) = quietest.filter(|_| counts.len() >= REMEMBERED) {
            counts.remove(&quietest);
        }
    }
    let times = counts.entry(key).or_default();
    times.retain(|time| now.duration_since(*time) < WINDOW);
    times.push(now);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(number: u32) -> IpAddr {
        std::net::Ipv4Addr::from_bits(number).into()
    }

    #[test]
    fn too_many_attempts_for_a_user_wait_and_a_right_one_clears_them() {
        let (attempts, now) = (Attempts::default(), Instant::now());
        for n in 0..OF_USER as u32 {
            assert_eq!(attempts.begin(address(n), Some("anna"), now), Ok(()), "{n}");
        }
        let wait = attempts.begin(address(99), Some("anna"), now + WINDOW / 2).expect_err("too many");
        assert_eq!(wait, WINDOW / 2);
        assert_eq!(attempts.begin(address(99), Some("otto"), now), Ok(()), "others are not concerned");
        assert_eq!(attempts.begin(address(99), Some("anna"), now + WINDOW), Ok(()), "not for ever");
        let attempts = Attempts::default();
        for n in 0..OF_USER as u32 - 1 {
            attempts.begin(address(n), Some("anna"), now).expect("few");
        }
        attempts.begin(address(50), Some("anna"), now).expect("few");
        attempts.succeeded(address(50), Some("anna"), now);
        assert_eq!(attempts.begin(address(51), Some("anna"), now), Ok(()));
    }

    #[test]
    fn too_many_attempts_from_an_address_wait_and_right_ones_do_not_count() {
        let (attempts, now) = (Attempts::default(), Instant::now());
        for n in 0..200 {
            let user = format!("right {n}");
            attempts.begin(address(1), Some(&user), now).expect("right ones are not limited");
            attempts.succeeded(address(1), Some(&user), now);
        }
        for n in 0..OF_ADDRESS {
            attempts.begin(address(1), Some(&format!("wrong {n}")), now).expect("few");
        }
        assert!(attempts.begin(address(1), Some("anna"), now).is_err());
        assert!(attempts.begin(address(1), None, now).is_err(), "nor at an identity provider");
        assert!(attempts.begin(address(2), Some("anna"), now).is_ok());
        for _ in 0..OF_ADDRESS {
            attempts.begin(address(3), None, now).expect("few");
        }
        assert!(attempts.begin(address(3), None, now).is_err());
        attempts.succeeded(address(3), None, now);
        assert!(attempts.begin(address(3), None, now).is_ok());
    }

    #[test]
    fn however_many_there_are_memory_is_bounded() {
        let (attempts, now) = (Attempts::default(), Instant::now());
        for n in 0..3 * REMEMBERED as u32 {
            let _ = attempts.begin(address(n), Some(&format!("user {n}")), now + Duration::from_millis(n.into()));
        }
        let counts = attempts.lock();
        assert!(counts.by_address.len() <= REMEMBERED && counts.by_user.len() <= REMEMBERED);
        assert!(counts.by_user.contains_key(&format!("user {}", 3 * REMEMBERED - 1)));
    }
}
