//! What the log says of clients: what they sent is escaped and cut, and what repeats is counted instead of written.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Lines of one kind that are written in a window of time ...
const LINES: u32 = 20;
/// ... of that length; the rest is counted.
const WINDOW: Duration = Duration::from_secs(10);
/// Characters of a client's text that are shown.
const SHOWN: usize = 80;

/// Text of a client as the log may show it: control characters and those that change the direction of writing are escaped,
/// and what is too long is cut, with its length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Excerpt<'a>(pub(super) &'a str);

impl Display for Excerpt<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for c in self.0.chars().take(SHOWN) {
            let invisible =
                matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
            if c.is_control() || invisible { write!(f, "{}", c.escape_unicode())? } else { f.write_char(c)? }
        }
        if self.0.chars().nth(SHOWN).is_some() {
            write!(f, "... ({} bytes)", self.0.len())?;
        }
        Ok(())
    }
}

/// Kinds of lines, each bounded for itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Connected,
    Left,
    ViewerRefused,
    RequestRefused,
    ConnectionRefused,
    ConnectionFailed,
    LoggedIn,
    LoginRefused,
    ProviderFailed,
}

impl Kind {
    /// Those that say that something was refused.
    pub(super) const REFUSALS: [Self; 6] = [
        Self::ViewerRefused,
        Self::RequestRefused,
        Self::ConnectionRefused,
        Self::ConnectionFailed,
        Self::LoginRefused,
        Self::ProviderFailed,
    ];

    /// What is counted, for people.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Connected => "viewers connected",
            Self::Left => "viewers left",
            Self::ViewerRefused => "viewers refused",
            Self::RequestRefused => "requests refused",
            Self::ConnectionRefused => "connections refused",
            Self::ConnectionFailed => "connections that could not be taken",
            Self::LoggedIn => "logins and logouts",
            Self::LoginRefused => "logins refused",
            Self::ProviderFailed => "logins that the identity provider did not answer",
        }
    }
}

#[derive(Debug)]
struct Window {
    began: Instant,
    lines: u32,
    left_out: u64,
}

/// Bounds what is written of each kind.
#[derive(Debug, Default)]
pub(super) struct ClientLog {
    windows: Mutex<BTreeMap<Kind, Window>>,
    counts: Mutex<BTreeMap<Kind, u64>>,
}

impl ClientLog {
    /// Writes a line of what goes its way; `text` is made only if it is written.
    pub(super) fn info<T: Display>(&self, kind: Kind, text: impl FnOnce() -> T) {
        if self.admits(kind, Instant::now()) {
            tracing::info!("{}", text());
        }
    }

    /// Writes a line of what went wrong; `text` is made only if it is written.
    pub(super) fn warn<T: Display>(&self, kind: Kind, text: impl FnOnce() -> T) {
        if self.admits(kind, Instant::now()) {
            tracing::warn!("{}", text());
        }
    }

    /// Says how many lines were left out in the windows that are over.
    pub(super) fn say_what_was_left_out(&self) {
        for (kind, count) in self.left_out(Instant::now()) {
            tracing::warn!("{count} more {} in {} s, not listed", kind.name(), WINDOW.as_secs());
        }
    }

    /// Lines of a kind so far, those that were left out included.
    pub(super) fn count(&self, kind: Kind) -> u64 {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner).get(&kind).copied().unwrap_or_default()
    }

    fn admits(&self, kind: Kind, now: Instant) -> bool {
        *self.counts.lock().unwrap_or_else(PoisonError::into_inner).entry(kind).or_default() += 1;
        let mut windows = self.windows.lock().unwrap_or_else(PoisonError::into_inner);
        let window = windows.entry(kind).or_insert(Window { began: now, lines: 0, left_out: 0 });
        if window.left_out == 0 && now.duration_since(window.began) >= WINDOW {
            *window = Window { began: now, lines: 0, left_out: 0 };
        }
        let admitted = window.lines < LINES;
        if admitted {
            window.lines += 1;
        } else {
            window.left_out += 1;
        }
        admitted
    }

    fn left_out(&self, now: Instant) -> Vec<(Kind, u64)> {
        let mut windows = self.windows.lock().unwrap_or_else(PoisonError::into_inner);
        let over = |_: &Kind, window: &mut Window| now.duration_since(window.began) >= WINDOW;
        windows.extract_if(.., over).map(|(kind, window)| (kind, window.left_out)).filter(|(_, n)| *n > 0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_clients_are_escaped_and_cut() {
        assert_eq!(Excerpt("viewer 1.0, Zürich").to_string(), "viewer 1.0, Zürich");
        let hostile = Excerpt("a\x1b[2J\r\nERROR \u{202e}x\u{9b}").to_string();
        assert_eq!(hostile, "a\\u{1b}[2J\\u{d}\\u{a}ERROR \\u{202e}x\\u{9b}");
        let long = "ü".repeat(4 << 20);
        let cut = Excerpt(&long).to_string();
        assert!(cut.len() < 200 && cut.ends_with("... (8388608 bytes)"), "{cut}");
        assert_eq!(Excerpt(&"x".repeat(SHOWN)).to_string().len(), SHOWN);
    }

    #[test]
    fn what_repeats_is_counted_and_said() {
        let log = ClientLog::default();
        let now = Instant::now();
        let written = (0..1000).filter(|_| log.admits(Kind::ViewerRefused, now)).count();
        assert_eq!(written, LINES as usize);
        assert_eq!((log.count(Kind::ViewerRefused), log.count(Kind::Connected)), (1000, 0));
        assert!(log.admits(Kind::Connected, now), "other kinds are not concerned");
        assert_eq!(log.left_out(now), []);
        assert!(!log.admits(Kind::ViewerRefused, now + WINDOW), "not before it was said");
        assert_eq!(log.left_out(now + WINDOW), [(Kind::ViewerRefused, 981)]);
        assert!(log.admits(Kind::ViewerRefused, now + WINDOW));
        assert_eq!(log.left_out(now + 3 * WINDOW), []);
    }
}
