//! What a live source sends, message by message as it comes, in an MCAP file: Foxglove opens it, and it is a recording that can be
//! inspected.

use super::LiveAddress;
use super::link::open;
use futures_util::{SinkExt, StreamExt};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions};
use semascan_foxglove::client::{Channel, FromServer, read_frame, read_text, subscription};
use semascan_inspection::source::SourceError;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;
use tokio::time::{Instant, timeout};
use tokio_tungstenite::tungstenite::Message;

/// Bytes of a chunk: so much is lost at most where the machine fails.
const CHUNK: u64 = 1 << 20;
/// How often the file is brought to the disk.
const SYNC: Duration = Duration::from_secs(1);

/// What was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Messages by topic.
    pub messages: BTreeMap<String, u64>,
    /// Why it ended.
    pub end: String,
}

/// Records everything that the server at `address` sends into a new file, until `is_over` says so, for `limit`, or until the server
/// ends or is silent as long as the address allows.
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
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|error| refuse(error.to_string()))?;
    let socket = runtime.block_on(open(&address.server)).map_err(refuse)?;
    let file = File::create_new(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })?;
    let named = |error: McapError| SourceError::Format { path: path.to_owned(), reason: error.to_string() };
    let mut recorder = Recorder::new(file).map_err(named)?;
    let taken = runtime.block_on(recorder.follow(socket, address, limit, is_over));
    // The index is written whatever happened before.
    let finished = recorder.finish();
    let end = taken.map_err(named)?;
    Ok(Recorded { messages: finished.map_err(named)?, end })
}

struct Recorder {
    writer: mcap::Writer<BufWriter<File>>,
    file: File,
    /// By the server's number of the channel: the file's, and the topic.
    channels: HashMap<u32, (u16, String)>,
    /// How many came, by topic.
    messages: BTreeMap<String, u64>,
    sequences: HashMap<u16, u32>,
}

impl Recorder {
    fn new(file: File) -> Result<Self, McapError> {
        let writer = WriteOptions::new()
            .library(concat!("semascan ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            .chunk_size(Some(CHUNK))
            .create(BufWriter::new(file.try_clone()?))?;
        Ok(Self { writer, file, channels: HashMap::new(), messages: BTreeMap::new(), sequences: HashMap::new() })
    }

    /// Writes what the server sends; why it ended.
    async fn follow<S>(
        &mut self,
        mut socket: S,
        address: &LiveAddress,
        limit: Option<Duration>,
        is_over: impl Fn() -> bool,
    ) -> Result<String, McapError>
    where
        S: StreamExt<Item = Result<Message, tokio_tungstenite::tungstenite::Error>>
            + SinkExt<Message, Error = tokio_tungstenite::tungstenite::Error>
            + Unpin,
    {
        let (began, mut heard, mut synced) = (Instant::now(), Instant::now(), Instant::now());
        loop {
            if is_over() {
                return Ok("it was stopped".to_owned());
            }
            if limit.is_some_and(|limit| began.elapsed() >= limit) {
                return Ok("the time is over".to_owned());
            }
            if heard.elapsed() > address.silence {
                return Ok(format!("nothing came for {} s", address.silence.as_secs_f64()));
            }
            if synced.elapsed() > SYNC {
                synced = Instant::now();
                self.sync()?;
            }
            let message = match timeout(Duration::from_millis(100), socket.next()).await {
                Err(_) => continue,
                Ok(None) => return Ok("the server closed the connection".to_owned()),
                Ok(Some(Err(error))) => return Ok(format!("the connection is lost: {error}")),
                Ok(Some(Ok(message))) => message,
            };
            match message {
                Message::Text(text) => match read_text(&text) {
                    Ok(FromServer::Advertised(channels)) => {
                        let asked = Message::text(subscription(channels.iter().map(|channel| channel.id)));
                        for channel in channels {
                            self.add(channel)?;
                        }
                        if let Err(error) = socket.send(asked).await {
                            return Ok(format!("the connection is lost: {error}"));
                        }
                    }
                    Ok(_) => {}
                    Err(error) => return Ok(error.to_string()),
                },
                Message::Binary(frame) => {
                    if let Some((id, nanoseconds, message)) = read_frame(&frame) {
                        heard = Instant::now();
                        self.write(id, nanoseconds, message)?;
                    }
                }
                Message::Close(_) => return Ok("the server closed the connection".to_owned()),
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }

    fn add(&mut self, channel: Channel) -> Result<(), McapError> {
        let encoding = match (channel.schema_encoding.as_str(), channel.encoding.as_str()) {
            ("", "cdr") => "ros2msg",
            ("", "ros1") => "ros1msg",
            ("", "json") => "jsonschema",
            ("", other) => other,
            (said, _) => said,
        };
        let schema = self.writer.add_schema(&channel.schema_name, encoding, &channel.schema)?;
        let id = self.writer.add_channel(schema, &channel.topic, &channel.encoding, &BTreeMap::new())?;
        self.messages.entry(channel.topic.clone()).or_default();
        self.channels.insert(channel.id, (id, channel.topic));
        Ok(())
    }

    fn write(&mut self, id: u32, nanoseconds: u64, message: &[u8]) -> Result<(), McapError> {
        // What was not advertised has no type.
        let Some((channel_id, topic)) = self.channels.get(&id) else { return Ok(()) };
        let sequence = self.sequences.entry(*channel_id).or_default();
        *sequence = sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        self.writer.write_to_known_channel(&header, message)?;
        if let Some(count) = self.messages.get_mut(topic) {
            *count += 1;
        }
        Ok(())
    }

    fn sync(&mut self) -> Result<(), McapError> {
        self.writer.flush()?;
        Ok(self.file.sync_data()?)
    }

    fn finish(mut self) -> Result<BTreeMap<String, u64>, McapError> {
        self.writer.finish()?;
        self.writer.into_inner().flush()?;
        self.file.sync_data()?;
        Ok(self.messages)
    }
}
