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

/// What a message is about. A message holds only until what it is about is as it should be again: then it goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    /// Messages of the agent that were not understood; the latest stands for all.
    Malformed,
    /// Views that the networks were not trained for; the latest stands for all.
    Domain,
    /// The end of the inspection.
    Outcome,
    /// What people decide about the inspection.
    Review,
    /// A decision of this person that did not arrive.
    Decision,
    /// The mesh.
    Mesh,
    /// The file that the mesh is compared with.
    Reference,
    /// A file that is opened.
    File,
    /// What of a recording is shown.
    Recording,
    /// A file that is saved.
    Export,
    /// Earlier views, which the agent is asked for.
    EarlierViews,
    /// The page's address.
    Address,
    /// A puck that moves the camera.
    SpaceMouse,
}

impl Topic {
    /// Those that are of one inspection.
    const OF_INSPECTION: [Self; 6] =
        [Self::Malformed, Self::Domain, Self::Outcome, Self::Review, Self::Mesh, Self::EarlierViews];

    /// Whether its messages come in floods, so that the latest stands for all.
    fn is_flood(self) -> bool {
        matches!(self, Self::Malformed | Self::Domain)
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
    topic: Topic,
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
    pub(super) fn push(&mut self, level: Level, topic: Topic, mut text: String) {
        if let Some((end, _)) = text.char_indices().nth(Self::MAX_TEXT) {
            text.truncate(end);
            text.push('…');
        }
        let same = |n: &&mut Notice| n.level == level && n.topic == topic && (topic.is_flood() || n.text == text);
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

    /// Takes away what was said of a topic: it holds no more.
    pub(super) fn retract(&mut self, topic: Topic) {
        self.shown.retain(|n| n.topic != topic);
    }

    /// Another inspection begins: takes away what was said of the one before.
    pub(super) fn begin(&mut self) {
        Topic::OF_INSPECTION.into_iter().for_each(|topic| self.retract(topic));
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
