//! A capture that is read, to its last whole view: a file that was cut anywhere, as by a crash, ends there and says so. One
//! piece after the other is read, so that memory does not grow with the file.

use crate::channel::{CALIBRATION, COLOR, DEPTH, LABELS, SEGMENTATION, TOPICS, TRUTH, Topic, VIEW};
use crate::decode::{self, Parts};
use crate::info::{CaptureInfo, INFO};
use crate::schema::capture;
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use prost::Message;
use semascan_inspection::ports::ArchivedView;
use semascan_inspection::source::TrueMesh;
use semascan_perception::view::View;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Most bytes of a record, and of a chunk before and after compression.
const LARGEST: usize = 256 << 20;

/// Why a capture cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file cannot be written or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// It is no MCAP file, or a damaged one.
    #[error("{}: {source}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: McapError,
    },
    /// What it holds cannot be used.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl CaptureError {
    /// An I/O error with the file that it is about.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

/// How a capture ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CaptureEnd {
    /// With its index: it was finished.
    Finished,
    /// In between: whoever wrote it was cut off, or the file was.
    Cut,
}

/// One view as it was recorded.
#[derive(Clone, Debug)]
pub struct RecordedView {
    /// Position in the order of the source, from 0.
    pub index: u32,
    /// The view, or why the source could not give it.
    pub view: Result<View, String>,
    /// What the source said of itself from then on; `None` where that did not change.
    pub settings: Option<Vec<(String, String)>>,
}

/// Which view is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// The one at this place in the order of the source.
    Index(u32),
    /// The one of this capture time on the source's clock, seconds.
    Stamp(f64),
}

/// A capture that is read from its beginning to its end.
pub struct CaptureReader {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    topics: BTreeMap<u16, Topic>,
    info: CaptureInfo,
    truth: Option<TrueMesh>,
    parts: Parts,
    next: u32,
    /// Views that the index of the file names.
    indexed: Option<u64>,
    end: Option<CaptureEnd>,
}

/// What is read of a record.
enum Piece {
    Message(Topic, Vec<u8>),
    Info(BTreeMap<String, String>),
    /// The number of views, from the index behind them.
    Views(u64),
    Other,
}

impl CaptureReader {
    /// Opens the capture at `path` and reads what its source is.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file: it cannot be read, is no MCAP file, none of semascan, or is cut before all that comes
    /// in front of the first view.
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        let file = File::open(path).map_err(CaptureError::io(path))?;
        let options =
            LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(LARGEST);
        let mut reader = LinearReader::new_with_options(options);
        let (mut topics, mut end, mut info) = (BTreeMap::new(), None, None);
        let format = |reason: String| CaptureError::Format { path: path.to_owned(), reason };
        loop {
            let info_first =
                || format("holds no capture of semascan: there is no metadata record `semascan`".to_owned());
            let read = read(&mut reader, &file, path, &mut topics, &mut end)?;
            match (read, &info) {
                (None, None) if end == Some(CaptureEnd::Cut) => {
                    return Err(format("is cut in front of its first view".to_owned()));
                }
                (Some(Piece::Message(..)) | None, None) => return Err(info_first()),
                (Some(Piece::Info(metadata)), None) => {
                    let json = metadata.get(INFO.1).ok_or_else(info_first)?;
                    let found: CaptureInfo = serde_json::from_str(json)
                        .map_err(|error| format(format!("metadata record `semascan`: {error}")))?;
                    found
                        .check()
                        .map_err(|(field, reason)| format(format!("metadata record `semascan`: {field} {reason}")))?;
                    let is_all = !found.has_truth;
                    info = Some(found);
                    if is_all {
                        break;
                    }
                }
                (Some(Piece::Message(TRUTH, message)), Some(known)) => {
                    let truth = decode::truth(&message, known.truth_taxonomy.as_ref())
                        .map_err(|reason| format(format!("the true surface: {reason}")))?;
                    let info = known.clone();
                    return Ok(Self::new(path, file, reader, topics, info, Some(truth), end));
                }
                (Some(Piece::Message(..)) | None, Some(_)) => {
                    return Err(format("is cut in front of its first view".to_owned()));
                }
                (Some(Piece::Info(_) | Piece::Views(_) | Piece::Other), _) => {}
            }
        }
        let info = info.ok_or_else(|| format("holds no capture of semascan".to_owned()))?;
        Ok(Self::new(path, file, reader, topics, info, None, end))
    }

    fn new(
        path: &Path,
        file: File,
        reader: LinearReader,
        topics: BTreeMap<u16, Topic>,
        info: CaptureInfo,
        truth: Option<TrueMesh>,
        end: Option<CaptureEnd>,
    ) -> Self {
        Self {
            path: path.to_owned(),
            file,
            reader,
            topics,
            info,
            truth,
            parts: Parts::default(),
            next: 0,
            indexed: None,
            end,
        }
    }

    /// What the source is.
    pub fn info(&self) -> &CaptureInfo {
        &self.info
    }

    /// The true surface, where the source knew it.
    pub fn truth(&self) -> Option<&TrueMesh> {
        self.truth.as_ref()
    }

    /// How the file ends; `None` until all views were read.
    pub fn end(&self) -> Option<CaptureEnd> {
        self.end
    }

    /// The next view that is whole; `None` after the last.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file and the view: it is damaged there. A damaged piece of the file is its end.
    pub fn next_view(&mut self) -> Option<Result<RecordedView, CaptureError>> {
        if self.end.is_some() {
            return None;
        }
        loop {
            let Self { reader, file, path, topics, end, .. } = self;
            match read(reader, file, path, topics, end) {
                Ok(Some(Piece::Message(topic, message))) => match topic {
                    COLOR => self.parts.color = Some(message),
                    DEPTH => self.parts.depth = Some(message),
                    CALIBRATION => self.parts.calibration = Some(message),
                    LABELS => self.parts.labels = Some(message),
                    VIEW => {
                        let recorded = self.whole_view(&message);
                        if recorded.is_err() {
                            self.end = Some(CaptureEnd::Cut);
                        }
                        return Some(recorded);
                    }
                    _ => {}
                },
                Ok(Some(Piece::Views(views))) => self.indexed = Some(views),
                Ok(Some(Piece::Info(_) | Piece::Other)) => {}
                Ok(None) => {
                    let missing = self.indexed.filter(|views| *views != u64::from(self.next));
                    return missing.map(|views| {
                        let reason = format!("is damaged: {} views of {views} could be read", self.next);
                        Err(CaptureError::Format { path: self.path.clone(), reason })
                    });
                }
                Err(error) => {
                    self.end = Some(CaptureEnd::Cut);
                    return Some(Err(error));
                }
            }
        }
    }

    /// One view of the capture at `path`, with what the inspection said of the pixels of its `inspected`-th view; `None` where
    /// there is none. Other views are passed over without decoding them.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file: it cannot be read, or is damaged in front of the view.
    pub fn find(path: &Path, wanted: Wanted, inspected: u32) -> Result<Option<ArchivedView>, CaptureError> {
        let mut capture = Self::open(path)?;
        let format = |reason: String| CaptureError::Format { path: path.to_owned(), reason };
        let (mut view, mut labels) = (None, None);
        while view.is_none() || labels.is_none() {
            let Self { reader, file, path, topics, end, .. } = &mut capture;
            let (topic, message) = match read(reader, file, path, topics, end) {
                Ok(Some(Piece::Message(topic, message))) => (topic, message),
                Ok(Some(_)) => continue,
                Ok(None) => break,
                // What comes behind a damaged piece is not reached; the view may lie in front of it.
                Err(_) if view.is_some() => break,
                Err(error) => return Err(error),
            };
            match topic {
                COLOR => capture.parts.color = Some(message),
                DEPTH => capture.parts.depth = Some(message),
                CALIBRATION => capture.parts.calibration = Some(message),
                LABELS => capture.parts.labels = Some(message),
                VIEW => {
                    let parts = std::mem::take(&mut capture.parts);
                    let end = capture::View::decode(message.as_slice()).map_err(|error| format(error.to_string()))?;
                    let is_it = match wanted {
                        Wanted::Index(index) => end.index == index,
                        Wanted::Stamp(stamp) => end.stamp.is_some_and(|own| own.to_bits() == stamp.to_bits()),
                    };
                    if is_it && view.is_none() {
                        view = Some(match &end.failure {
                            Some(reason) => Err(reason.clone()),
                            None => Ok(decode::view(&parts, &end).map_err(format)?),
                        });
                    }
                }
                SEGMENTATION => {
                    let found = capture::Segmentation::decode(message.as_slice());
                    let found = found.map_err(|error| format(format!("labels: {error}")))?;
                    if found.view == inspected {
                        labels = Some(decode::segmentation(found).map_err(format)?);
                    }
                }
                _ => {}
            }
        }
        Ok(view.map(|view| ArchivedView { view, labels }))
    }

    /// The view whose end is `message`.
    fn whole_view(&mut self, message: &[u8]) -> Result<RecordedView, CaptureError> {
        let format = |reason: String| CaptureError::Format { path: self.path.clone(), reason };
        let parts = std::mem::take(&mut self.parts);
        let end = capture::View::decode(message).map_err(|error| format(format!("view {}: {error}", self.next)))?;
        if end.index != self.next {
            return Err(format(format!("view {} stands where view {} is expected", end.index, self.next)));
        }
        let settings: Vec<_> = end.settings.iter().map(|s| (s.name.clone(), s.value.clone())).collect();
        let view = match &end.failure {
            Some(reason) => Err(reason.clone()),
            None => Ok(decode::view(&parts, &end).map_err(format)?),
        };
        self.next += 1;
        Ok(RecordedView { index: end.index, view, settings: (!settings.is_empty()).then_some(settings) })
    }
}

/// The next record that matters; `None` at the end, which `end` then says. A file that was cut ends in front of what is not
/// whole.
fn read(
    reader: &mut LinearReader,
    mut file: &File,
    path: &Path,
    topics: &mut BTreeMap<u16, Topic>,
    end: &mut Option<CaptureEnd>,
) -> Result<Option<Piece>, CaptureError> {
    let failed = |source| CaptureError::Mcap { path: path.to_owned(), source };
    loop {
        let event = match reader.next_event() {
            Some(Ok(event)) => event,
            Some(Err(McapError::UnexpectedEof)) => {
                *end = Some(CaptureEnd::Cut);
                return Ok(None);
            }
            Some(Err(error)) => return Err(failed(error)),
            None => {
                *end = Some(CaptureEnd::Finished);
                return Ok(None);
            }
        };
        match event {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted)).map_err(CaptureError::io(path))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => {
                return Ok(Some(match mcap::parse_record(opcode, data).map_err(failed)? {
                    Record::Channel(channel) => {
                        let known = TOPICS.iter().find(|topic| topic.name == channel.topic);
                        if let Some(topic) = known.filter(|_| channel.message_encoding == "protobuf") {
                            topics.insert(channel.id, *topic);
                        }
                        Piece::Other
                    }
                    Record::Message { header, data } => match topics.get(&header.channel_id) {
                        Some(topic) => Piece::Message(*topic, data.into_owned()),
                        None => Piece::Other,
                    },
                    Record::Statistics(statistics) => {
                        let counts = statistics.channel_message_counts.iter();
                        let views = counts.filter(|(id, _)| topics.get(id) == Some(&VIEW)).map(|(_, count)| count);
                        Piece::Views(views.sum())
                    }
                    Record::Metadata(metadata) if metadata.name == INFO.0 => Piece::Info(metadata.metadata),
                    _ => Piece::Other,
                }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CaptureWriter;
    use proptest::prelude::*;
    use semascan_inspection::source::Source;
    use semascan_simulation::{VirtualCell, VirtualCellSpec};
    use std::sync::LazyLock;

    /// A capture of two views, with what is true.
    static VALID: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=3&views=2&size=96x72&cell=5").expect("a source");
        let mut source = VirtualCell::open(&spec).expect("opens");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let info = CaptureInfo::new(source.info(), source.truth());
        let mut writer = CaptureWriter::create(&path, &info, source.truth()).expect("made");
        while let Some(view) = source.next_view() {
            writer.append(&view, &[]).expect("taken in");
            writer.sync().expect("written");
        }
        writer.finish().expect("finished");
        std::fs::read(&path).expect("reads")
    });

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn damaged_captures_are_read_to_their_damage_or_refused(
            damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
            cut in any::<prop::sample::Index>(),
            is_cut in any::<bool>(),
            is_in_front in any::<bool>(),
        ) {
            let mut bytes = VALID.clone();
            // What comes first says how the rest is read.
            let reach = if is_in_front { bytes.len().min(4096) } else { bytes.len() };
            damage.iter().for_each(|(at, byte)| bytes[at.index(reach)] = *byte);
            if is_cut {
                bytes.truncate(cut.index(bytes.len() + 1));
            }
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("x.mcap");
            std::fs::write(&path, bytes).expect("written");
            if let Ok(mut reader) = CaptureReader::open(&path) {
                let views = std::iter::from_fn(|| reader.next_view()).count();
                // Two views, and at most one word about what is wrong with the rest.
                prop_assert!(views <= 3);
            }
            let _ = CaptureReader::find(&path, Wanted::Index(1), 1);
        }
    }
}
