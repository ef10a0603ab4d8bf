//! Short messages to the person, a few at a time.

/// How urgent a notice is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Level {
    /// Something worked; goes away by itself.
    Info,
    /// Something is not as it should be; goes away by itself, later.
    Warning,
    /// Something failed; stays until it is dismissed.
    Error,
}

impl Level {
    /// Stable name for styles and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }

    /// Milliseconds until the notice goes away by itself, or `None` if it stays.
    fn lifetime_ms(self) -> Option<u32> {
        match self {
            Self::Info => Some(5_000),
            Self::Warning => Some(10_000),
            Self::Error => None,
        }
    }
}

/// A message on screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// Unique in this session.
    pub id: u64,
    /// How urgent it is.
    pub level: Level,
    /// What it says.
    pub text: String,
    /// How often it was said.
    pub count: u32,
    topic: Option<&'static str>,
    left_ms: Option<u32>,
}

/// The messages on screen, oldest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notices {
    shown: Vec<Notice>,
    next_id: u64,
}

impl Notices {
    /// Most messages on screen at once; a newer one drives the oldest out.
    pub const MAX: usize = 4;
    /// Longest text, in characters.
    const MAX_TEXT: usize = 400;

    /// The messages, oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Notice> {
        self.shown.iter()
    }

    /// Shows a message; one that is on screen already is counted instead of repeated.
    pub(super) fn push(&mut self, level: Level, text: String) {
        self.show(level, None, text);
    }

    /// Shows a message of a kind that may come in floods: the latest of its `topic` stands for all, with their number.
    pub(super) fn push_on(&mut self, topic: &'static str, level: Level, text: String) {
        self.show(level, Some(topic), text);
    }

    fn show(&mut self, level: Level, topic: Option<&'static str>, mut text: String) {
        if let Some((end, _)) = text.char_indices().nth(Self::MAX_TEXT) {
            text.truncate(end);
            text.push('…');
        }
        let same = |n: &&mut Notice| n.level == level && n.topic == topic && (topic.is_some() || n.text == text);
        if let Some(same) = self.shown.iter_mut().find(same) {
            same.count = same.count.saturating_add(1);
            same.text = text;
            same.left_ms = level.lifetime_ms();
            return;
        }
        if self.shown.len() == Self::MAX {
            self.shown.remove(0);
        }
        self.shown.push(Notice { id: self.next_id, level, text, count: 1, topic, left_ms: level.lifetime_ms() });
        self.next_id += 1;
    }

    /// Takes a message away.
    pub(super) fn dismiss(&mut self, id: u64) {
        self.shown.retain(|n| n.id != id);
    }

    /// Takes away what has been on screen long enough.
    pub(super) fn elapsed(&mut self, ms: u32) {
        for notice in &mut self.shown {
            notice.left_ms = notice.left_ms.map(|left| left.saturating_sub(ms));
        }
        self.shown.retain(|n| n.left_ms != Some(0));
    }

    /// Whether some message will go away by itself.
    pub(super) fn fading(&self) -> bool {
        self.shown.iter().any(|n| n.left_ms.is_some())
    }
}
