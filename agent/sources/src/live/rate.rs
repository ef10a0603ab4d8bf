//! How often pictures come, and whether they have stopped.

use std::time::{Duration, Instant};

/// A pause is worth a word that is longer than this, and than several usual ones.
const LEAST: Duration = Duration::from_millis(400);
const USUAL_ONES: u32 = 5;
/// How much of the usual pause the last one is.
const SHARE: f64 = 0.1;
/// After so long a silence it is told, though it may go on.
const TELL_AFTER: Duration = Duration::from_secs(2);

/// The rhythm of a stream.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rate {
    last: Option<Instant>,
    /// The usual time between two pictures, seconds.
    usual: Option<f64>,
    is_told: bool,
}

impl Rate {
    /// Takes note of a picture; what is to be said where it came after an unusual pause.
    pub(super) fn note(&mut self, arrived: Instant) -> Option<String> {
        self.is_told = false;
        let last = self.last.replace(arrived)?;
        let pause = arrived.duration_since(last);
        let Some(usual) = self.usual else {
            self.usual = Some(pause.as_secs_f64());
            return None;
        };
        if self.is_silent(pause) {
            return Some(format!(
                "no picture came for {:.2} s, and {:.0} ms are usual; it goes on",
                pause.as_secs_f64(),
                1e3 * usual
            ));
        }
        self.usual = Some(usual + SHARE * (pause.as_secs_f64() - usual));
        None
    }

    /// What is to be said of a silence that goes on; once.
    pub(super) fn silence(&mut self) -> Option<String> {
        let pause = self.last?.elapsed();
        if self.is_told || pause < TELL_AFTER || !self.is_silent(pause) {
            return None;
        }
        self.is_told = true;
        Some(format!("no picture has come for {:.0} s; it is waited for", pause.as_secs_f64()))
    }

    fn is_silent(&self, pause: Duration) -> bool {
        let usual = self.usual.map(|usual| Duration::from_secs_f64(usual) * USUAL_ONES);
        usual.is_some_and(|usual| pause > usual.max(LEAST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_is_told_that_is_longer_than_usual() {
        let began = Instant::now();
        let mut rate = Rate::default();
        let mut tell = |ms: u64| rate.note(began + Duration::from_millis(ms));
        assert!((0..20).all(|frame| tell(33 * frame).is_none()));
        assert!(tell(33 * 20 + 100).is_none(), "some pictures were lost");
        assert!(tell(1300).is_some_and(|said| said.contains("0.54 s")));
        assert!(tell(1333).is_none());
        let mut slow = Rate::default();
        assert!((0..20).all(|frame| slow.note(began + Duration::from_secs(frame)).is_none()), "one a second");
    }
}
