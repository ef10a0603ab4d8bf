//! When views of a camera are taken, and when there are no more: the options that all cameras share.

use crate::recording::{Key, number};
use std::time::Duration;

/// Options of all cameras, behind the `?` of their address.
pub const TIMING_KEYS: &[Key] = &[
    Key { name: "views", meaning: "it is over after so many views; by default when nothing comes any more" },
    Key { name: "silence_s", meaning: "it is over when nothing has come for so many seconds (10)" },
    Key { name: "interval_ms", meaning: "least time between two views (0)" },
];

/// When views are taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Views until the end.
    pub views: Option<u32>,
    /// Time without a capture until the end; a camera that is lost is looked for as long.
    pub silence: Duration,
    /// Least time between two views.
    pub interval: Duration,
}

impl Default for Timing {
    fn default() -> Self {
        Self { views: None, silence: Duration::from_secs(10), interval: Duration::ZERO }
    }
}

impl Timing {
    /// Takes over the option `key`; `false` if it is none of [`TIMING_KEYS`].
    ///
    /// # Errors
    /// What is wrong with its value.
    pub fn take(&mut self, key: &str, value: &str) -> Result<bool, String> {
        let time = |seconds: f64, most: f64| {
            let time = number(key, value)? * seconds;
            if time > most { Err(format!("{key}={value}: is too long")) } else { Ok(Duration::from_secs_f64(time)) }
        };
        match key {
            "views" => {
                let views = value.parse().ok().filter(|views| *views > 0);
                self.views = Some(views.ok_or_else(|| format!("views={value}: is no whole number from 1 on"))?);
            }
            "silence_s" => self.silence = time(1.0, 3600.0)?,
            "interval_ms" => self.interval = time(1e-3, 3600.0)?,
            _ => return Ok(false),
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_taken_and_wrong_values_are_named() {
        let mut timing = Timing::default();
        for key in TIMING_KEYS {
            assert_eq!(timing.take(key.name, "2"), Ok(true), "{}", key.name);
        }
        let expected = Timing { views: Some(2), silence: Duration::from_secs(2), interval: Duration::from_millis(2) };
        assert_eq!(timing, expected);
        assert_eq!(timing.take("exposure_us", "2"), Ok(false));
        for (key, value) in [("views", "0"), ("views", "x"), ("silence_s", "-1"), ("interval_ms", "1e12")] {
            let said = timing.take(key, value).expect_err(key);
            assert!(said.contains(key) && said.contains(value), "{said}");
        }
    }
}
