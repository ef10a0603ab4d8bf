//! When to connect again: exponential backoff with jitter, as a state machine without clock or socket.
//!
//! After the n-th failure in a row the wait is drawn evenly from `[d/2, d]`, `d = min(0.5 s * 2^(n-1), 5 s)`: at least
//! 0.25 s, at most 5 s, and a restarted agent does not meet all its viewers in the same instant. Only a welcome counts
//! as success: an agent that accepts and hangs up is not hammered.

/// Bounds of the wait in milliseconds.
pub const MIN_WAIT_MS: u32 = 250;
/// See [`MIN_WAIT_MS`].
pub const MAX_WAIT_MS: u32 = 5_000;

/// How long an agent may take from the start of a connection to its welcome.
pub const WELCOME_TIMEOUT_MS: u32 = 10_000;

/// Where the connection stands.
#[derive(Clone, Debug, PartialEq, Eq)]
enum State {
    /// A socket is being opened or waits for its welcome.
    Opening,
    /// Welcomed.
    Live,
    /// Waiting for the next attempt.
    Waiting,
    /// Over for good.
    Stopped,
}

/// What the owner of the socket is to do next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Open a socket; the attempt's number in a row, from 1.
    Connect {
        /// From 1.
        attempt: u32,
    },
    /// Call [`Reconnect::timer_fired`] in so many milliseconds.
    Wait {
        /// Milliseconds.
        ms: u32,
    },
    /// Nothing.
    Nothing,
}

/// The state machine.
#[derive(Clone, Debug)]
pub struct Reconnect {
    state: State,
    failures: u32,
}

impl Reconnect {
    /// Starts; the first action is to connect.
    pub fn start() -> (Self, Action) {
        (Self { state: State::Opening, failures: 0 }, Action::Connect { attempt: 1 })
    }

    /// The agent said welcome.
    pub fn welcomed(&mut self) {
        if self.state == State::Opening {
            self.state = State::Live;
            self.failures = 0;
        }
    }

    /// The socket closed or failed. `random` is drawn evenly from 0..1 by the caller.
    pub fn closed(&mut self, random: f32) -> Action {
        if !matches!(self.state, State::Opening | State::Live) {
            return Action::Nothing;
        }
        self.state = State::Waiting;
        self.failures = self.failures.saturating_add(1);
        Action::Wait { ms: wait_ms(self.failures, random) }
    }

    /// The wait is over.
    pub fn timer_fired(&mut self) -> Action {
        if self.state != State::Waiting {
            return Action::Nothing;
        }
        self.state = State::Opening;
        Action::Connect { attempt: self.failures.saturating_add(1) }
    }

    /// Refused, or closed by the page: no further attempt.
    pub fn stop(&mut self) {
        self.state = State::Stopped;
    }

    /// Whether it is over for good.
    #[cfg(test)]
    pub fn is_stopped(&self) -> bool {
        self.state == State::Stopped
    }

    /// Whether the agent has welcomed this connection.
    pub fn is_live(&self) -> bool {
        self.state == State::Live
    }
}

fn wait_ms(failures: u32, random: f32) -> u32 {
    let doublings = failures.saturating_sub(1).min(16);
    let longest = (2 * MIN_WAIT_MS).saturating_mul(1 << doublings).min(MAX_WAIT_MS);
    let random = if random.is_finite() { random.clamp(0.0, 1.0) } else { 1.0 };
    longest / 2 + ((longest / 2) as f32 * random) as u32
}

/// What a viewer says of an agent that picked another subprotocol; `None` if it picked ours.
pub fn protocol_mismatch(picked: &str) -> Option<String> {
    use semascan_protocol::SUBPROTOCOL;
    if picked == SUBPROTOCOL {
        return None;
    }
    let theirs = if picked.is_empty() { "no known protocol" } else { picked };
    Some(format!(
        "this viewer speaks {SUBPROTOCOL}, the agent speaks {theirs}: reload the page, or update the older one"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn waits_grow_to_the_limit_and_start_over_after_a_welcome() {
        let (mut link, first) = Reconnect::start();
        assert_eq!(first, Action::Connect { attempt: 1 });
        let mut waits = Vec::new();
        for attempt in 2..9 {
            let Action::Wait { ms } = link.closed(0.0) else { panic!("no wait") };
            waits.push(ms);
            assert_eq!(link.timer_fired(), Action::Connect { attempt });
        }
        assert_eq!(waits, [250, 500, 1000, 2000, 2500, 2500, 2500]);
        link.welcomed();
        assert!(link.is_live());
        assert_eq!(link.closed(0.0), Action::Wait { ms: 250 });
        assert_eq!(link.timer_fired(), Action::Connect { attempt: 2 });
    }

    #[test]
    fn an_agent_that_hangs_up_before_its_welcome_is_not_hammered() {
        let (mut link, _) = Reconnect::start();
        let mut last = 0;
        for _ in 0..4 {
            let Action::Wait { ms } = link.closed(1.0) else { panic!("no wait") };
            assert!(ms > last);
            last = ms;
            link.timer_fired();
        }
    }

    #[test]
    fn a_refused_link_stays_silent() {
        let (mut link, _) = Reconnect::start();
        link.stop();
        assert_eq!(link.closed(0.5), Action::Nothing);
        assert_eq!(link.timer_fired(), Action::Nothing);
        link.welcomed();
        assert!(link.is_stopped());
    }

    #[test]
    fn a_stale_timer_or_a_second_close_does_nothing() {
        let (mut link, _) = Reconnect::start();
        assert_eq!(link.timer_fired(), Action::Nothing);
        assert!(matches!(link.closed(0.5), Action::Wait { .. }));
        assert_eq!(link.closed(0.5), Action::Nothing, "an error and its close event are one failure");
    }

    #[test]
    fn the_mismatch_names_both_versions() {
        assert_eq!(protocol_mismatch("semascan.v1"), None);
        let text = protocol_mismatch("semascan.v2").unwrap_or_default();
        assert!(text.contains("semascan.v1") && text.contains("semascan.v2"), "{text}");
        assert!(protocol_mismatch("").is_some());
    }

    proptest! {
        #[test]
        fn every_wait_is_within_bounds(failures in any::<u32>(), random in any::<f32>()) {
            let ms = wait_ms(failures, random);
            prop_assert!((MIN_WAIT_MS..=MAX_WAIT_MS).contains(&ms), "{ms}");
        }
    }
}
