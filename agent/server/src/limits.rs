//! How much of the agent its clients may take: connections, time and bytes. Every limit is a setting; these are the defaults.
//!
//! They are chosen so that 200 viewers behind one address work, and that whatever connects cannot make the agent hold more
//! than a few hundred megabytes.

use semascan_protocol::MAX_CLIENT_MESSAGE;
use serde::Deserialize;
use std::time::Duration;

/// Longest time that a limit may be set to, in seconds: a day.
const LONGEST: f64 = 86_400.0;
/// Shortest time that a limit may be set to, in seconds.
const SHORTEST: f64 = 0.01;
/// Fewest requests a second that an address may be held to.
const SLOWEST: f64 = 0.01;
/// Most requests a second.
const FASTEST: f64 = 1e6;

/// Limits of the server; times in seconds.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Connections at once, viewers and downloads together.
    pub connections: usize,
    /// Connections at once from one address (IPv6: one network of 64 bits), loopback included.
    pub connections_per_address: usize,
    /// Connections at once that have opened the stream and not said Hello yet.
    pub hellos: usize,
    /// Requests that one address may make at once, all its viewers together ...
    pub request_burst: usize,
    /// ... and in each second after that.
    pub requests_per_s: f64,
    /// Largest message from a client, in bytes.
    pub message_bytes: usize,
    /// Time to say Hello in.
    pub hello_s: f64,
    /// Time for the head of a request, from the connection's beginning or the end of the last answer: so long is an idle
    /// connection kept. The handshake of TLS has the same time.
    pub request_s: f64,
    /// Time in which a client must take a piece of the answer to its request; the whole must be taken within 15 times that.
    pub answer_s: f64,
    /// Time between two pings to a viewer.
    pub ping_s: f64,
    /// Time in which a viewer must be heard of after a ping.
    pub pong_s: f64,
    /// Time in which a viewer must take a message.
    pub slow_s: f64,
    /// Time without any request after which a session ends; a stream that is open counts as one.
    pub session_idle_s: f64,
    /// Time after which a session ends in any case.
    pub session_s: f64,
    /// Time that a login at an identity provider may take, from the page that begins it until the browser is back.
    pub sign_in_s: f64,
    /// Time without any progress after which a running inspection counts as dead in `/healthz`.
    pub stall_s: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 1024,
            connections_per_address: 512,
            hellos: 256,
            request_burst: 5000,
            requests_per_s: 500.0,
            message_bytes: MAX_CLIENT_MESSAGE,
            hello_s: 10.0,
            request_s: 10.0,
            answer_s: 20.0,
            ping_s: 20.0,
            pong_s: 30.0,
            slow_s: 30.0,
            session_idle_s: 3600.0,
            session_s: 43_200.0,
            sign_in_s: 600.0,
            stall_s: 300.0,
        }
    }
}

/// A limit that cannot be kept.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("limit {field}: {reason}")]
pub struct LimitError {
    /// Which.
    pub field: &'static str,
    /// Why not.
    pub reason: String,
}

impl Limits {
    /// Whether every limit can be kept.
    ///
    /// # Errors
    /// [`LimitError`] that names the first that cannot.
    pub fn check(&self) -> Result<(), LimitError> {
        for (field, count) in [
            ("connections", self.connections),
            ("connections_per_address", self.connections_per_address),
            ("hellos", self.hellos),
            ("request_burst", self.request_burst),
        ] {
            if count == 0 {
                return Err(LimitError { field, reason: "0 would let nobody in".into() });
            }
        }
        if !(64..=MAX_CLIENT_MESSAGE).contains(&self.message_bytes) {
            let reason = format!("{} is not within 64 and {MAX_CLIENT_MESSAGE} bytes", self.message_bytes);
            return Err(LimitError { field: "message_bytes", reason });
        }
        if !(SLOWEST..=FASTEST).contains(&self.requests_per_s) {
            let reason = format!("{} is not within {SLOWEST} and {FASTEST} requests a second", self.requests_per_s);
            return Err(LimitError { field: "requests_per_s", reason });
        }
        for (field, time) in [
            ("hello_s", self.hello_s),
            ("request_s", self.request_s),
            ("answer_s", self.answer_s),
            ("ping_s", self.ping_s),
            ("pong_s", self.pong_s),
            ("slow_s", self.slow_s),
            ("session_idle_s", self.session_idle_s),
            ("session_s", self.session_s),
            ("sign_in_s", self.sign_in_s),
            ("stall_s", self.stall_s),
        ] {
            if !(SHORTEST..=LONGEST).contains(&time) {
                let reason = format!("{time} s is not within {SHORTEST} and {LONGEST} s");
                return Err(LimitError { field, reason });
            }
        }
        Ok(())
    }
}

/// A time of [`Limits`] that were checked.
pub(super) fn seconds(time: f64) -> Duration {
    Duration::try_from_secs_f64(time).unwrap_or(Duration::from_secs(LONGEST as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_can_be_kept_and_nonsense_is_named() {
        assert_eq!(Limits::default().check(), Ok(()));
        for (wrong, field) in [
            (Limits { connections: 0, ..Limits::default() }, "connections"),
            (Limits { hellos: 0, ..Limits::default() }, "hellos"),
            (Limits { message_bytes: 1 << 30, ..Limits::default() }, "message_bytes"),
            (Limits { request_burst: 0, ..Limits::default() }, "request_burst"),
            (Limits { requests_per_s: f64::NAN, ..Limits::default() }, "requests_per_s"),
            (Limits { requests_per_s: 0.0, ..Limits::default() }, "requests_per_s"),
            (Limits { slow_s: f64::NAN, ..Limits::default() }, "slow_s"),
            (Limits { ping_s: -1.0, ..Limits::default() }, "ping_s"),
            (Limits { hello_s: f64::INFINITY, ..Limits::default() }, "hello_s"),
        ] {
            assert_eq!(wrong.check().expect_err(field).field, field);
        }
    }
}
