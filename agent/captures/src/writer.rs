//! A capture that is written: after each view it is on the disk.
//!
//! The MCAP writer fills a buffer in memory, and [`CaptureWriter::sync`] brings that to the file. So where the disk is full
//! nothing is lost: the bytes wait, and the next call goes on where the last one failed.

use crate::channel::{SEGMENTATION, TOPICS, Topic};
use crate::encode::{self, Encoded};
use crate::info::{CaptureInfo, INFO};
use crate::reader::{CaptureError, CaptureReader};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions};
use semascan_inspection::event::ProcessedView;
use semascan_inspection::source::{SourceError, TrueMesh};
use semascan_perception::view::View;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Bytes of a chunk before compression. A message that is longer is a chunk of its own: a message cannot be divided.
const CHUNK: u64 = 1 << 20;
/// Level of zstd: fast, because views are written while others are computed.
const LEVEL: u32 = 1;

/// A capture that is written.
pub struct CaptureWriter {
    path: PathBuf,
    file: File,
    /// Bytes of the file that are whole and on the disk.
    durable: u64,
    buffer: Buffer,
    writer: mcap::Writer<NoSeek<Buffer>>,
    channels: BTreeMap<&'static str, u16>,
    /// Bytes of messages in the chunk that is being filled.
    in_chunk: u64,
    views: u32,
    /// What the source said of itself last.
    settings: Vec<(String, String)>,
    /// Time of the last message, nanoseconds after 1970.
    time: u64,
}

impl CaptureWriter {
    /// A new capture at `path` of a source like `info`, with what it knows to be true. On the disk when this returns.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file; there must be none yet.
    pub fn create(path: &Path, info: &CaptureInfo, truth: Option<&TrueMesh>) -> Result<Self, CaptureError> {
        let file = File::options().write(true).create_new(true).open(path).map_err(CaptureError::io(path))?;
        let mut capture = Self::begin(path, file, info, truth)?;
        capture.sync()?;
        sync_folder_of(path)?;
        Ok(capture)
    }

    /// Goes on with the capture at `path`, which may have been cut anywhere: its whole views stay, what comes after them is
    /// dropped. Their segmentations are dropped too: the inspection is made again from the views.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file; the old file then stays as it was.
    pub fn reopen(path: &Path) -> Result<Self, CaptureError> {
        let mut old = CaptureReader::open(path)?;
        let part = path.with_extension("mcap.part");
        let file = File::create(&part).map_err(CaptureError::io(&part))?;
        let mut capture = Self::begin(path, file, old.info(), old.truth())?;
        while let Some(recorded) = old.next_view() {
            // Views after a damaged piece are not reached: what is whole in front of it stays.
            let Ok(recorded) = recorded else { break };
            capture.settings = recorded.settings.unwrap_or_else(|| capture.settings.clone());
            let settings = capture.settings.clone();
            match &recorded.view {
                Ok(view) => capture.append_messages(encode::view(recorded.index, view, &settings, capture.now()))?,
                Err(reason) => capture.append_messages(vec![encode::failed_view(recorded.index, reason, &settings)])?,
            }
            capture.views += 1;
            capture.sync()?;
        }
        fs::rename(&part, path).map_err(CaptureError::io(path))?;
        sync_folder_of(path)?;
        Ok(capture)
    }

    fn begin(path: &Path, file: File, info: &CaptureInfo, truth: Option<&TrueMesh>) -> Result<Self, CaptureError> {
        let buffer = Buffer::default();
        let failed = |error: McapError| CaptureError::Mcap { path: path.to_owned(), source: error };
        let mut writer = WriteOptions::new()
            .library(concat!("semascan ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(LEVEL)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true)
            .create(NoSeek::new(buffer.clone()))
            .map_err(failed)?;
        let json = serde_json::to_string(info).map_err(|error| CaptureError::Format {
            path: path.to_owned(),
            reason: format!("the source cannot be described: {error}"),
        })?;
        let metadata = Metadata { name: INFO.0.into(), metadata: BTreeMap::from([(INFO.1.into(), json)]) };
        writer.write_metadata(&metadata).map_err(failed)?;
        let mut channels = BTreeMap::new();
        for Topic { name, schema, descriptors } in TOPICS {
            let schema = writer.add_schema(schema, "protobuf", descriptors).map_err(failed)?;
            channels.insert(name, writer.add_channel(schema, name, "protobuf", &BTreeMap::new()).map_err(failed)?);
        }
        let mut capture = Self {
            path: path.to_owned(),
            file,
            durable: 0,
            buffer,
            writer,
            channels,
            in_chunk: 0,
            views: 0,
            settings: Vec::new(),
            time: 0,
        };
        let truth = truth.map(encode::truth);
        capture.append_messages(truth.into_iter().collect())?;
        Ok(capture)
    }

    /// Takes the next view of the source in, or why it could not be had, with what the source says of itself by now. It is
    /// on the disk after the next [`sync`](Self::sync).
    ///
    /// # Errors
    /// [`CaptureError`] naming the file.
    pub fn append(
        &mut self,
        view: &Result<View, SourceError>,
        settings: &[(String, String)],
    ) -> Result<(), CaptureError> {
        let said = if settings == self.settings { &[] } else { settings };
        let messages = match view {
            Ok(view) => encode::view(self.views, view, said, self.now()),
            Err(error) => vec![encode::failed_view(self.views, &error.to_string(), said)],
        };
        self.append_messages(messages)?;
        self.settings = settings.to_vec();
        self.views += 1;
        Ok(())
    }

    /// Takes in what the inspection said of the pixels of its `view`-th view.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file.
    pub fn append_segmentation(&mut self, view: u32, processed: &ProcessedView) -> Result<(), CaptureError> {
        match encode::segmentation(view, processed) {
            Some((_, message)) => self.append_message(SEGMENTATION, view, &message),
            None => Ok(()),
        }
    }

    /// Views that it holds, those that their source could not give included.
    pub fn views(&self) -> u32 {
        self.views
    }

    /// Brings all that was taken in to the disk. After a failure the next call goes on where this one ended.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file.
    pub fn sync(&mut self) -> Result<(), CaptureError> {
        self.writer.flush().map_err(|source| CaptureError::Mcap { path: self.path.clone(), source })?;
        self.in_chunk = 0;
        self.write_out()
    }

    /// Ends the file with its index. What follows is an error of the caller.
    ///
    /// # Errors
    /// [`CaptureError`] naming the file.
    pub fn finish(&mut self) -> Result<(), CaptureError> {
        self.writer.finish().map_err(|source| CaptureError::Mcap { path: self.path.clone(), source })?;
        self.write_out()
    }

    fn write_out(&mut self) -> Result<(), CaptureError> {
        let mut bytes = self.buffer.0.lock().unwrap_or_else(PoisonError::into_inner);
        if bytes.is_empty() {
            return Ok(());
        }
        let Self { file, durable, .. } = self;
        // Again from the last whole view on, whatever an earlier try has left behind it.
        file.seek(SeekFrom::Start(*durable))
            .and_then(|_| file.write_all(&bytes))
            .and_then(|()| file.sync_data())
            .map_err(CaptureError::io(&self.path))?;
        *durable += bytes.len() as u64;
        bytes.clear();
        Ok(())
    }

    fn append_messages(&mut self, messages: Vec<Encoded>) -> Result<(), CaptureError> {
        self.time = self.now();
        let sequence = self.views;
        messages.iter().try_for_each(|(topic, message)| self.append_message(*topic, sequence, message))
    }

    fn append_message(&mut self, topic: Topic, sequence: u32, message: &[u8]) -> Result<(), CaptureError> {
        let failed = |source| CaptureError::Mcap { path: self.path.clone(), source };
        if self.in_chunk > 0 && self.in_chunk + message.len() as u64 > CHUNK {
            self.writer.flush().map_err(failed)?;
            self.in_chunk = 0;
        }
        self.in_chunk += message.len() as u64;
        let channel_id = self.channels.get(topic.name).copied().unwrap_or_default();
        let header = MessageHeader { channel_id, sequence, log_time: self.time, publish_time: self.time };
        self.writer.write_to_known_channel(&header, message).map_err(failed)
    }

    /// Nanoseconds after 1970, never before the last message.
    fn now(&self) -> u64 {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        u64::try_from(now.as_nanos()).unwrap_or(u64::MAX).max(self.time)
    }
}

/// What the MCAP writer has written, on its way to the file.
#[derive(Clone, Debug, Default)]
struct Buffer(Arc<Mutex<Vec<u8>>>);

impl Write for Buffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Brings the name of a new file to the disk, where the system can.
fn sync_folder_of(path: &Path) -> Result<(), CaptureError> {
    if !cfg!(unix) {
        return Ok(());
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // Some network file systems cannot, and keep names in order themselves.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        result => result.map_err(CaptureError::io(folder)),
    }
}
