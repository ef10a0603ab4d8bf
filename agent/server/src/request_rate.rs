//! How many requests an address may make: a bucket that holds a burst and fills again at a steady rate (a token bucket).

use super::limits::Limits;
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Addresses that are remembered.
const REMEMBERED: usize = 4096;

/// The buckets of the addresses that asked of late.
#[derive(Debug)]
pub(super) struct RequestRate {
    /// Requests that fill a bucket.
    burst: f64,
    /// Requests a second that fill it again.
    rate: f64,
    buckets: Mutex<HashMap<IpAddr, Bucket>>,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    /// Requests that it held ...
    held: f64,
    /// ... at that time.
    at: Instant,
}

impl RequestRate {
    /// Nobody asked yet.
    pub(super) fn new(limits: &Limits) -> Self {
        Self { burst: limits.request_burst as f64, rate: limits.requests_per_s, buckets: Mutex::default() }
    }

    /// Counts a request from `address`; where there were too many, the time after which there may be one.
    pub(super) fn admit(&self, address: IpAddr, now: Instant) -> Result<(), Duration> {
        // A count that a panic cut off is still a count.
        let mut buckets = self.buckets.lock().unwrap_or_else(PoisonError::into_inner);
        let filled = |bucket: &Bucket| {
            let since = now.saturating_duration_since(bucket.at).as_secs_f64();
            (bucket.held + since * self.rate).min(self.burst)
        };
        if buckets.len() >= REMEMBERED && !buckets.contains_key(&address) {
            // Who has a full bucket is not told from who never asked.
            buckets.retain(|_, bucket| filled(bucket) < self.burst);
            let fullest =
                buckets.iter().max_by(|a, b| filled(a.1).total_cmp(&filled(b.1))).map(|(address, _)| *address);
            if let Some(fullest) = fullest.filter(|_| buckets.len() >= REMEMBERED) {
                buckets.remove(&fullest);
            }
        }
        let bucket = buckets.entry(address).or_insert(Bucket { held: self.burst, at: now });
        let held = filled(bucket);
        let admitted = held >= 1.0;
        *bucket = Bucket { held: if admitted { held - 1.0 } else { held }, at: now };
        if admitted { Ok(()) } else { Err(Duration::from_secs_f64((1.0 - held) / self.rate)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(number: u32) -> IpAddr {
        std::net::Ipv4Addr::from_bits(number).into()
    }

    #[test]
    fn a_burst_passes_and_then_the_rate() {
        let rate = RequestRate::new(&Limits { request_burst: 10, requests_per_s: 4.0, ..Limits::default() });
        let begun = Instant::now();
        let admitted = |seconds: f64, number: u32| {
            let now = begun + Duration::from_secs_f64(seconds);
            (0..100).filter(|_| rate.admit(address(number), now).is_ok()).count()
        };
        assert_eq!(admitted(0.0, 1), 10);
        assert_eq!(rate.admit(address(1), begun), Err(Duration::from_millis(250)));
        assert_eq!(admitted(0.0, 2), 10, "others are not concerned");
        assert_eq!(admitted(1.0, 1), 4);
        assert_eq!(admitted(100.0, 1), 10, "no more than a burst");
    }

    #[test]
    fn however_many_ask_memory_is_bounded_and_who_was_stopped_stays_so() {
        let rate = RequestRate::new(&Limits { request_burst: 2, requests_per_s: 0.01, ..Limits::default() });
        let now = Instant::now();
        while rate.admit(address(0), now).is_ok() {}
        for number in 1..3 * REMEMBERED as u32 {
            assert_eq!(rate.admit(address(number), now), Ok(()));
        }
        assert!(rate.buckets.lock().expect("whole").len() <= REMEMBERED);
        assert!(rate.admit(address(0), now).is_err());
    }
}
