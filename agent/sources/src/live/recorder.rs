//! What a live source sends, message by message as it comes, in an MCAP file: Foxglove opens it, and it is a recording that can be
//! inspected.
//!
//! The file is written on a thread of its own: a disk that is slow for a while holds neither the camera nor the inspection up. What
//! waits to be written is bounded, and what finds no room is counted as lost and said.

use super::LiveAddress;
use super::faults::{FaultKind, Faults};
use super::link::{Arrival, Happening, Opened, Streamed, Wanted};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions};
use semascan_inspection::source::SourceError;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Bytes of a chunk: so much is lost at most where the machine fails.
const CHUNK: u64 = 1 << 20;
/// How often the file is brought to the disk.
const SYNC: Duration = Duration::from_secs(1);
/// Bytes that wait to be written at most.
const MOST_WAITING: usize = 256 << 20;

/// What was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Messages by topic.
    pub messages: BTreeMap<String, u64>,
    /// Messages that came and are not in the file.
    pub lost: u64,
    /// Why it ended.
    pub end: String,
}

/// Records everything that the server at `address` sends into a new file, until `is_over` says so, for `limit`, or until the server
/// is silent as long as the address allows; a connection that is lost is made again.
///
/// # Errors
/// [`SourceError`] if nobody answers at the address, or the file cannot be written; what was written stays.
pub fn record(
    address: &LiveAddress,
    path: &Path,
    limit: Option<Duration>,
    is_over: impl Fn() -> bool,
) -> Result<Recorded, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: address.uri.clone(), reason };
    let opened = Opened::new(&address.server).map_err(refuse)?;
    let faults = Faults::new(&address.uri);
    let recorder = Recorder::begin(path, faults.clone())?;
    let wanted = Wanted { topic: None, follows_all: true, recorder: Some(recorder) };
    let link = opened.follow(wanted, faults.clone()).map_err(refuse)?;
    let (began, mut heard) = (Instant::now(), Instant::now());
    let end = loop {
        if is_over() {
            break "it was stopped".to_owned();
        }
        if limit.is_some_and(|limit| began.elapsed() >= limit) {
            break "the time is over".to_owned();
        }
        if heard.elapsed() > address.silence {
            break format!("nothing came for {} s", address.silence.as_secs_f64());
        }
        match link.next(Duration::from_millis(100)) {
            Some(Happening::Message(_)) => heard = Instant::now(),
            Some(Happening::Lost { reason }) => {
                faults.report("", FaultKind::Connection, format!("it is lost ({reason}), and is made again"));
            }
            Some(Happening::Connected { .. } | Happening::Remark { .. } | Happening::Stray { .. }) | None => {}
        }
    };
    let recorder = link.end().ok_or_else(|| refuse("the thread of the connection ended unexpectedly".to_owned()))?;
    let Written { messages, lost } = recorder.finish()?;
    Ok(Recorded { messages, lost, end })
}

/// Writes messages into a file, on a thread of its own. A recorder that is dropped finishes its file, too.
#[derive(Debug)]
pub(super) struct Recorder {
    path: PathBuf,
    sender: Sender<Arrival>,
    shared: Arc<Shared>,
    writer: JoinHandle<Result<BTreeMap<String, u64>, McapError>>,
}

#[derive(Debug)]
struct Shared {
    waiting_bytes: AtomicUsize,
    written: AtomicU64,
    lost: AtomicU64,
    faults: Faults,
}

/// What became of the messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Written {
    /// Those in the file, by topic.
    pub(super) messages: BTreeMap<String, u64>,
    /// Those that are not.
    pub(super) lost: u64,
}

impl Recorder {
    /// Begins a new file.
    ///
    /// # Errors
    /// [`SourceError`] if it is there already, or cannot be written.
    pub(super) fn begin(path: &Path, faults: Faults) -> Result<Self, SourceError> {
        let io = |source| SourceError::Io { path: path.to_owned(), source };
        let file = File::create_new(path).map_err(io)?;
        let named = |error: McapError| SourceError::Format { path: path.to_owned(), reason: error.to_string() };
        let writing = Writing::new(file).map_err(named)?;
        let shared = Arc::new(Shared {
            waiting_bytes: AtomicUsize::new(0),
            written: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            faults,
        });
        let (sender, arrivals) = channel();
        let writing_for = Arc::clone(&shared);
        let write = move || writing.follow(&arrivals, &writing_for);
        let writer = thread::Builder::new().name("recorder".into()).spawn(write).map_err(io)?;
        Ok(Self { path: path.to_owned(), sender, shared, writer })
    }

    /// Takes a message; it never waits.
    pub(super) fn take(&self, arrival: Arrival) {
        let length = arrival.bytes.len();
        let waiting = self.shared.waiting_bytes.fetch_add(length, Ordering::Relaxed);
        if waiting + length > MOST_WAITING {
            self.shared.lose(&arrival, "it is not recorded: the disk is slower than the camera");
        } else if let Err(unsent) = self.sender.send(arrival) {
            self.shared.lose(&unsent.0, "it is not recorded: the file is not written any more");
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`SourceError`] if it could not be written; what was written stays.
    pub(super) fn finish(self) -> Result<Written, SourceError> {
        let Self { path, sender, shared, writer } = self;
        drop(sender);
        let refuse = |reason: String| SourceError::Format { path, reason };
        let messages = match writer.join() {
            Ok(Ok(messages)) => messages,
            Ok(Err(error)) => return Err(refuse(error.to_string())),
            Err(_) => return Err(refuse("its writer ended unexpectedly".to_owned())),
        };
        Ok(Written { messages, lost: shared.lost.load(Ordering::Relaxed) })
    }
}

impl Shared {
    fn lose(&self, arrival: &Arrival, reason: &str) {
        self.waiting_bytes.fetch_sub(arrival.bytes.len(), Ordering::Relaxed);
        self.lost.fetch_add(1, Ordering::Relaxed);
        self.faults.report(&arrival.channel.offered.topic, FaultKind::Overflow, reason);
    }
}

/// A file that is written.
struct Writing {
    writer: mcap::Writer<BufWriter<File>>,
    file: File,
    /// The channels by those of the connection; one that is made again offers the same ones anew.
    channels: Vec<(Arc<Streamed>, u16)>,
    /// How many were written, by topic.
    messages: BTreeMap<String, u64>,
    sequences: HashMap<u16, u32>,
}

impl Writing {
    fn new(file: File) -> Result<Self, McapError> {
        let writer = WriteOptions::new()
            .library(concat!("semascan ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            .chunk_size(Some(CHUNK))
            .create(BufWriter::new(file.try_clone()?))?;
        Ok(Self { writer, file, channels: Vec::new(), messages: BTreeMap::new(), sequences: HashMap::new() })
    }

    /// Writes what comes until nobody sends any more. Where that fails, what comes later is counted as lost.
    fn follow(mut self, arrivals: &Receiver<Arrival>, shared: &Shared) -> Result<BTreeMap<String, u64>, McapError> {
        let mut synced = Instant::now();
        let mut failed = None;
        loop {
            let arrival = match arrivals.recv_timeout(SYNC) {
                Ok(arrival) => Some(arrival),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if failed.is_some() {
                if let Some(arrival) = &arrival {
                    shared.lose(arrival, "it is not recorded: the file cannot be written");
                }
                continue;
            }
            let mut result = Ok(());
            if let Some(arrival) = &arrival {
                result = self.write(arrival);
                match result {
                    Ok(()) => {
                        shared.waiting_bytes.fetch_sub(arrival.bytes.len(), Ordering::Relaxed);
                        shared.written.fetch_add(1, Ordering::Relaxed);
                    }
                    Err(_) => shared.lose(arrival, "it is not recorded: the file cannot be written"),
                }
            }
            if result.is_ok() && synced.elapsed() > SYNC {
                synced = Instant::now();
                result = self.sync();
            }
            if let Err(error) = result {
                shared.faults.report("", FaultKind::Recording, format!("the recording ends here: {error}"));
                failed = Some(error);
            }
        }
        // The index is written whatever happened before.
        let finished = self.writer.finish().map(drop);
        failed.map_or(finished, Err)?;
        self.writer.into_inner().flush()?;
        self.file.sync_data()?;
        Ok(self.messages)
    }

    fn write(&mut self, arrival: &Arrival) -> Result<(), McapError> {
        let channel_id = self.channel(&arrival.channel)?;
        let sequence = self.sequences.entry(channel_id).or_default();
        *sequence = sequence.wrapping_add(1);
        let time = u64::try_from(arrival.logged.nanoseconds).unwrap_or(0);
        let header = MessageHeader { channel_id, sequence: *sequence, log_time: time, publish_time: time };
        self.writer.write_to_known_channel(&header, &arrival.bytes)?;
        let topic = &arrival.channel.offered.topic;
        match self.messages.get_mut(topic) {
            Some(count) => *count += 1,
            None => drop(self.messages.insert(topic.clone(), 1)),
        }
        Ok(())
    }

    /// The file's channel for one of the connection.
    fn channel(&mut self, streamed: &Arc<Streamed>) -> Result<u16, McapError> {
        if let Some((_, id)) = self.channels.iter().find(|(known, _)| Arc::ptr_eq(known, streamed)) {
            return Ok(*id);
        }
        let offered = &streamed.offered;
        let encoding = match (offered.schema_encoding.as_str(), offered.encoding.as_str()) {
            ("", "cdr") => "ros2msg",
            ("", "ros1") => "ros1msg",
            ("", "json") => "jsonschema",
            ("", other) => other,
            (said, _) => said,
        };
        // The writer gives the same number to what is the same.
        let schema = self.writer.add_schema(&offered.schema_name, encoding, &offered.schema)?;
        let id = self.writer.add_channel(schema, &offered.topic, &offered.encoding, &BTreeMap::new())?;
        self.channels.retain(|(_, known)| *known != id);
        self.channels.push((Arc::clone(streamed), id));
        Ok(id)
    }

    fn sync(&mut self) -> Result<(), McapError> {
        self.writer.flush()?;
        Ok(self.file.sync_data()?)
    }
}
