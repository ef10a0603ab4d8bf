//! What a `ws://` address says: the server, and behind a `?` the keys of recordings and those of live sources.

use crate::recording::RecordingOptions;
use crate::recording::{Key, number};
use std::time::Duration;

/// Schemes of addresses of live sources.
const SCHEMES: [&str; 2] = ["ws", "wss"];

/// Keys of live sources, beside those of recordings.
pub const LIVE_KEYS: &[Key] = &[
    Key { name: "views", meaning: "the stream is over after so many views; by default when it is silent" },
    Key { name: "silence_s", meaning: "the stream is over after so many seconds without a picture (10)" },
    Key {
        name: "trigger",
        meaning: "`every` pair is a view, or one where the camera rests at another place: `still` (every)",
    },
    Key { name: "still_ms", meaning: "how long the camera rests before a view is taken (300)" },
];

/// Steps between two views of a camera that rests, where none are asked for: metres and radians.
const STEP: (f64, f64) = (5e-3, 0.02);

/// Where a camera streams, and how it is listened to.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveAddress {
    /// As it was given.
    pub uri: String,
    /// The server's address, without what is ours.
    pub server: String,
    /// Topics, frames, tolerances, and the step between views.
    pub recording: RecordingOptions,
    /// Views until the end.
    pub views: Option<u32>,
    /// Time without a picture until the end.
    pub silence: Duration,
    /// Whether a view is taken where the camera rests.
    pub waits_for_rest: bool,
    /// How long it rests before that.
    pub still: Duration,
}

impl LiveAddress {
    /// Whether `uri` is one.
    pub fn is_one(uri: &str) -> bool {
        uri.split_once("://").is_some_and(|(scheme, _)| SCHEMES.contains(&scheme))
    }

    /// Reads `ws://host:port/path?key=value&...`.
    ///
    /// # Errors
    /// What is wrong, naming the key.
    pub fn read(uri: &str) -> Result<Self, String> {
        Self::read_with(uri, RecordingOptions::default())
    }

    /// The same, where the keys of recordings add to `recording`.
    ///
    /// # Errors
    /// What is wrong, naming the key.
    pub fn read_with(uri: &str, recording: RecordingOptions) -> Result<Self, String> {
        let (server, query) = uri.split_once('?').unwrap_or((uri, ""));
        let mut address = Self {
            uri: uri.to_owned(),
            server: server.to_owned(),
            recording,
            views: None,
            silence: Duration::from_secs(10),
            waits_for_rest: false,
            still: Duration::from_millis(300),
        };
        let mut rest = Vec::new();
        for part in query.split('&').filter(|part| !part.is_empty()) {
            match part.split_once('=') {
                Some(("views", value)) => {
                    let views = value.parse().ok().filter(|views| *views > 0);
                    address.views = Some(views.ok_or_else(|| format!("views={value}: is no whole number from 1 on"))?);
                }
                Some(("silence_s", value)) => address.silence = time("silence_s", value, 1.0, 3600.0)?,
                Some(("still_ms", value)) => address.still = time("still_ms", value, 1e-3, 60.0)?,
                Some(("trigger", "still")) => address.waits_for_rest = true,
                Some(("trigger", "every")) => address.waits_for_rest = false,
                Some(("trigger", other)) => return Err(format!("trigger={other}: is neither `every` nor `still`")),
                _ => rest.push(part),
            }
        }
        address.recording = address.recording.with_query(&rest.join("&")).map_err(|reason| {
            let own: Vec<&str> = LIVE_KEYS.iter().map(|key| key.name).collect();
            format!("{reason}; of live sources also {}", own.join(", "))
        })?;
        let step = &mut address.recording;
        if address.waits_for_rest && step.least_shift == 0.0 && step.least_turn == 0.0 {
            (step.least_shift, step.least_turn) = STEP;
        }
        Ok(address)
    }
}

/// A time of so many units of `seconds`, up to `most` seconds.
fn time(key: &str, value: &str, seconds: f64, most: f64) -> Result<Duration, String> {
    let time = number(key, value)? * seconds;
    let in_range = (0.001..=most).contains(&time);
    if in_range { Ok(Duration::from_secs_f64(time)) } else { Err(format!("{key}={value}: is too short or too long")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_both_kinds_are_taken_and_no_others() {
        let address =
            LiveAddress::read("ws://cell:8765?trigger=still&views=5&depth=/d&silence_s=2&still_ms=500").expect("one");
        assert_eq!((address.server.as_str(), address.views), ("ws://cell:8765", Some(5)));
        assert_eq!((address.silence, address.still), (Duration::from_secs(2), Duration::from_millis(500)));
        assert!(address.waits_for_rest && address.recording.least_shift == 5e-3);
        assert_eq!(address.recording.depth.as_deref(), Some("/d"));
        let stepped = LiveAddress::read("wss://cell/x?trigger=still&shift_mm=20").expect("one");
        assert_eq!((stepped.recording.least_shift, stepped.recording.least_turn), (0.02, 0.0));
        for wrong in ["views=0", "trigger=noise", "silence_s=0", "silence_s=x", "still_ms=1e9", "viws=3"] {
            let said = LiveAddress::read(&format!("ws://cell?{wrong}")).expect_err(wrong);
            assert!(said.contains(wrong.split('=').next().expect("a key")), "{said}");
        }
        assert!(LiveAddress::is_one("ws://a") && !LiveAddress::is_one("http://a") && !LiveAddress::is_one("a.mcap"));
    }
}
