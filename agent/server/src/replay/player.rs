//! Plays a tape to one viewer, at its speed and from its event on.

use super::tape::{Step, Tape};
use crate::live::LiveModel;
use crate::live_stream::apply;
use jiff::Timestamp;
use std::collections::HashMap;
use std::sync::{Arc, Weak};
use std::time::Duration;

/// Longest pause between two recorded events that is waited for, before the speed counts: an inspection may have been cut off
/// in the evening and continued in the morning.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);
/// Speeds that can be asked for.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// What of a past inspection is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    /// How many recorded seconds pass in one.
    pub(crate) speed: f64,
    /// The event that is shown when it begins; those before it are shown at once.
    pub(crate) from: u64,
}

impl Pace {
    /// The pace that a query asks for; the error names the parameter.
    pub(crate) fn of(query: &HashMap<String, String>) -> Result<Self, String> {
        let given = |name: &str| query.get(name).map(String::as_str);
        let speed = match given("speed").map(str::parse::<f64>) {
            None => 1.0,
            Some(Ok(speed)) if SPEEDS.contains(&speed) => speed,
            Some(_) => return Err(format!("speed: is no number from {} to {}", SPEEDS.start(), SPEEDS.end())),
        };
        let from = match given("from").map(str::parse::<u64>) {
            None => 0,
            Some(Ok(from)) => from,
            Some(Err(_)) => return Err("from: is no number of an event".into()),
        };
        Ok(Self { speed, from })
    }

    /// The pause in front of an event at `time` that follows one at `before`.
    fn pause(self, before: Option<Timestamp>, event: u64, time: Timestamp) -> Duration {
        let Some(before) = before.filter(|_| event > self.from) else { return Duration::ZERO };
        // The clock of then may have been set back.
        let recorded = Duration::try_from(time.duration_since(before)).unwrap_or_default();
        recorded.min(LONGEST_PAUSE).div_f64(self.speed)
    }
}

/// Plays `tape` to `live` until its end, or until nobody follows any more.
pub(super) async fn play(tape: Arc<Tape>, live: Weak<LiveModel>, pace: Pace) {
    let mut before = None;
    for Step { event, attached } in &tape.steps {
        let pause = pace.pause(before, event.sequence, event.time);
        if !pause.is_zero() {
            tokio::time::sleep(pause).await;
        }
        let Some(live) = live.upgrade() else { return };
        apply(&live, event, attached.clone());
        before = Some(event.time);
    }
    if let Some(live) = live.upgrade()
        && !tape.remark.is_empty()
    {
        live.say(&tape.remark);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pace(query: &[(&str, &str)]) -> Result<Pace, String> {
        Pace::of(&query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect())
    }

    #[test]
    fn a_pace_is_a_speed_and_a_place() {
        assert_eq!(pace(&[]), Ok(Pace { speed: 1.0, from: 0 }));
        assert_eq!(pace(&[("speed", "2.5"), ("from", "12")]), Ok(Pace { speed: 2.5, from: 12 }));
        for (name, wrong) in
            [("speed", "0"), ("speed", "nan"), ("speed", "inf"), ("speed", "-1"), ("speed", "x"), ("from", "-1")]
        {
            assert!(pace(&[(name, wrong)]).is_err_and(|said| said.starts_with(name)), "{name}={wrong}");
        }
    }

    #[test]
    fn recorded_times_pass_at_the_speed_and_what_lies_before_the_place_at_once() {
        let at = |second: i64| Timestamp::from_second(1_700_000_000 + second).expect("in range");
        let pace = Pace { speed: 4.0, from: 10 };
        assert_eq!(pace.pause(None, 20, at(9)), Duration::ZERO);
        assert_eq!(pace.pause(Some(at(0)), 10, at(9)), Duration::ZERO, "it is the first that is shown");
        assert_eq!(pace.pause(Some(at(0)), 11, at(2)), Duration::from_millis(500));
        assert_eq!(pace.pause(Some(at(0)), 11, at(40_000)), Duration::from_secs(15));
        assert_eq!(pace.pause(Some(at(5)), 11, at(2)), Duration::ZERO, "the clock was set back");
    }
}
