//! What went wrong on a stream: told as it happens, counted to the end. Streams bring the same fault thirty times a second, so each
//! kind of each topic is told once, and again when it comes back after a while.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A fault that was away for so long is told again.
const AWAY: Duration = Duration::from_secs(5);
/// The latest faults that can be asked for.
const MOST_RECENT: usize = 1000;
/// Topics and kinds that are counted one by one; a server may make up any number of topics.
const MOST_KINDS: usize = 500;

/// What a fault is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// The connection was lost, or the server said what cannot be read.
    Connection,
    /// A message of a channel that was not offered.
    Channel,
    /// A message that cannot be read; the reason names the field.
    Message,
    /// Pictures that came twice, or after later ones.
    Order,
    /// The clock of the pictures was set.
    Clock,
    /// No picture came.
    Silence,
    /// A camera's calibration is missing or has changed.
    Calibration,
    /// A transform that does not fit, or a pose that is not known.
    Pose,
    /// A picture that cannot be used.
    Picture,
    /// More came than could be held or written.
    Overflow,
    /// The recording cannot be written.
    Recording,
}

impl FaultKind {
    /// As people read it.
    fn name(self) -> &'static str {
        match self {
            Self::Connection => "connection",
            Self::Channel => "channel",
            Self::Message => "message",
            Self::Order => "order",
            Self::Clock => "clock",
            Self::Silence => "silence",
            Self::Calibration => "calibration",
            Self::Pose => "pose",
            Self::Picture => "picture",
            Self::Overflow => "overflow",
            Self::Recording => "recording",
        }
    }
}

/// Something that went wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The topic or frame that it is of; empty where it is of the whole stream.
    pub topic: String,
    /// What it is of.
    pub kind: FaultKind,
    /// What happened, naming the field where there is one.
    pub reason: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.topic.as_str() {
            "" => write!(f, "{}: {}", self.kind.name(), self.reason),
            topic => write!(f, "{topic}: {}: {}", self.kind.name(), self.reason),
        }
    }
}

/// The faults of a stream. All clones are the same ones.
#[derive(Clone, Debug)]
pub struct Faults {
    uri: Arc<str>,
    told: Arc<Mutex<Told>>,
}

#[derive(Debug, Default)]
struct Told {
    counted: BTreeMap<(String, FaultKind), Counted>,
    recent: VecDeque<Fault>,
}

#[derive(Debug)]
struct Counted {
    number: u64,
    latest: Instant,
    first: String,
}

impl Faults {
    /// None yet, of the stream at `uri`.
    pub(super) fn new(uri: &str) -> Self {
        Self { uri: uri.into(), told: Arc::default() }
    }

    /// Takes note of a fault, and tells it where it is news.
    pub(super) fn report(&self, topic: &str, kind: FaultKind, reason: impl Into<String>) {
        let fault = Fault { topic: topic.to_owned(), kind, reason: reason.into() };
        let mut told = self.lock();
        let is_known = told.counted.contains_key(&(fault.topic.clone(), kind));
        // What is too much to be counted by topic is counted by kind.
        let topic = if is_known || told.counted.len() < MOST_KINDS { fault.topic.clone() } else { String::new() };
        let now = Instant::now();
        let counted = told.counted.entry((topic, kind)).or_insert_with(|| Counted {
            number: 0,
            latest: now,
            first: fault.reason.clone(),
        });
        let is_news = counted.number == 0 || now.duration_since(counted.latest) > AWAY;
        counted.number += 1;
        counted.latest = now;
        if is_news {
            tracing::warn!("{}: {fault}", self.uri);
        }
        if told.recent.len() == MOST_RECENT {
            told.recent.pop_front();
        }
        told.recent.push_back(fault);
    }

    /// The latest ones, at most a thousand, the oldest first.
    pub fn recent(&self) -> Vec<Fault> {
        self.lock().recent.iter().cloned().collect()
    }

    /// All of them in a few words; empty where there was none.
    pub fn summary(&self) -> String {
        let told = self.lock();
        let said = told.counted.iter().map(|((topic, kind), counted)| {
            let fault = Fault { topic: topic.clone(), kind: *kind, reason: counted.first.clone() };
            format!("{} x {fault}", counted.number)
        });
        said.collect::<Vec<_>>().join("; ")
    }

    fn lock(&self) -> MutexGuard<'_, Told> {
        // Nothing panics between two related writes.
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_counted_by_topic_and_kind_and_memory_is_bounded() {
        let faults = Faults::new("ws://cell");
        for number in 0..2 * MOST_RECENT {
            faults.report(&format!("/topic{}", number % (2 * MOST_KINDS)), FaultKind::Message, "field data: is cut");
        }
        faults.report("", FaultKind::Connection, "the server closed it");
        assert_eq!(faults.recent().len(), MOST_RECENT);
        assert!(faults.lock().counted.len() <= MOST_KINDS + 2);
        let said = faults.summary();
        assert!(said.contains("2 x /topic7: message: field data: is cut"), "{said}");
        assert!(said.contains("1 x connection: the server closed it"), "{said}");
    }
}
