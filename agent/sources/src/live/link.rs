//! The connection to a server of Foxglove's protocol, on a thread of its own: it subscribes to what is wanted, and is made again
//! when it is lost or gives no sign of life. Nothing is decoded here and no byte is copied, so that it keeps up with the camera
//! whatever the others do. What comes faster than it is taken is bounded: the oldest pictures are dropped and counted, never
//! transforms.

use super::faults::{FaultKind, Faults};
use super::recorder::Recorder;
use crate::messages::{Kind, Stamp};
use crate::recording::Channel as Decoded;
use futures_util::{SinkExt, StreamExt};
use semascan_foxglove::client::{Channel, FromServer, read_frame, read_text, subscription};
use semascan_foxglove::protocol::SUBPROTOCOLS;
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::runtime::Runtime;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::{HeaderValue, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Bytes, Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

/// Time in which a server must answer.
const ANSWER: Duration = Duration::from_secs(5);
/// Pause before a lost connection is made again, which doubles up to the second.
const PAUSE: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(4));
/// How often it is seen whether the link is still wanted.
const LOOK: Duration = Duration::from_millis(500);
/// A server that is silent for so long is pinged; one that does not answer is gone, though nobody closed the connection.
const PING_AFTER: Duration = Duration::from_secs(2);
const GONE_AFTER: Duration = Duration::from_secs(6);
/// Largest message.
const LARGEST: usize = 256 << 20;
/// Bytes of pictures that wait at most.
const MOST_WAITING: usize = 256 << 20;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// A channel as the server offers it, and what of it is decoded.
#[derive(Debug)]
pub(super) struct Streamed {
    pub(super) offered: Channel,
    pub(super) decoded: Decoded,
}

/// A message that came.
#[derive(Clone, Debug)]
pub(super) struct Arrival {
    pub(super) channel: Arc<Streamed>,
    /// When the server sent it.
    pub(super) logged: Stamp,
    /// When it came.
    pub(super) at: Instant,
    pub(super) bytes: Bytes,
}

/// Which messages are asked for, and who takes them beside the one who follows the link.
#[derive(Debug, Default)]
pub(super) struct Wanted {
    /// A topic whose messages are asked for whatever they are.
    pub(super) topic: Option<String>,
    /// Whether messages that are not decoded are asked for and handed on, too.
    pub(super) follows_all: bool,
    /// Takes every message of every channel.
    pub(super) recorder: Option<Recorder>,
}

/// What happened on a link.
#[derive(Clone, Debug)]
pub(super) enum Happening {
    /// It is there.
    Connected {
        /// What the server calls itself.
        server: String,
    },
    /// It is not there any more.
    Lost { reason: String },
    /// The server has something to say to people.
    Remark { text: String },
    /// Messages of a channel that was not offered.
    Stray { number: u32 },
    /// A message came.
    Message(Arrival),
}

/// A connection that is made again when it is lost.
#[derive(Debug)]
pub(super) struct Link {
    shared: Arc<Shared>,
    follower: Option<JoinHandle<Option<Recorder>>>,
}

#[derive(Debug)]
struct Shared {
    queue: Mutex<Queue>,
    filled: Condvar,
    is_over: AtomicBool,
    faults: Faults,
}

#[derive(Debug, Default)]
struct Queue {
    happenings: VecDeque<Happening>,
    /// Bytes of the pictures among them.
    bytes: usize,
    received: u64,
    dropped: u64,
}

/// Messages of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counted {
    /// Those that came.
    pub(super) received: u64,
    /// Those that were dropped because they came faster than they were taken.
    pub(super) dropped: u64,
}

/// A connection that was made and is not followed yet.
#[derive(Debug)]
pub(super) struct Opened {
    server: String,
    runtime: Runtime,
    socket: Socket,
}

impl Opened {
    /// Connects to a server; why it cannot be reached.
    pub(super) fn new(server: &str) -> Result<Self, String> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| e.to_string())?;
        let socket = runtime.block_on(open(server))?;
        Ok(Self { server: server.to_owned(), runtime, socket })
    }

    /// Follows the server until the link is dropped. What goes wrong is told to `faults`.
    ///
    /// # Errors
    /// Why there is no thread for it.
    pub(super) fn follow(self, wanted: Wanted, faults: Faults) -> Result<Link, String> {
        let Self { server, runtime, socket } = self;
        let shared =
            Arc::new(Shared { queue: Mutex::default(), filled: Condvar::new(), is_over: false.into(), faults });
        let following = Arc::clone(&shared);
        let follow = move || {
            runtime.block_on(follow(&server, socket, &wanted, &following));
            wanted.recorder
        };
        let follower = thread::Builder::new().name("camera".into()).spawn(follow).map_err(|error| error.to_string())?;
        Ok(Link { shared, follower: Some(follower) })
    }
}

impl Link {
    /// What happened next; `None` if nothing did within `patience`.
    pub(super) fn next(&self, patience: Duration) -> Option<Happening> {
        let queue = self.shared.lock();
        let waited = self.shared.filled.wait_timeout_while(queue, patience, |queue| queue.happenings.is_empty());
        let (mut queue, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let happening = queue.happenings.pop_front()?;
        queue.bytes -= picture_bytes(&happening);
        Some(happening)
    }

    /// What came by now.
    pub(super) fn counted(&self) -> Counted {
        let queue = self.shared.lock();
        Counted { received: queue.received, dropped: queue.dropped }
    }

    /// Ends the connection; gives back who recorded. It takes as long as a connection that is being made.
    pub(super) fn end(mut self) -> Option<Recorder> {
        self.shared.is_over.store(true, Ordering::Relaxed);
        self.follower.take().and_then(|follower| follower.join().ok()).flatten()
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        // Nothing panics between two related writes.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, happening: Happening) {
        let mut queue = self.lock();
        queue.received += u64::from(matches!(happening, Happening::Message(_)));
        queue.bytes += picture_bytes(&happening);
        queue.happenings.push_back(happening);
        while queue.bytes > MOST_WAITING {
            let Some(oldest) = queue.happenings.iter().position(|happening| picture_bytes(happening) > 0) else {
                break;
            };
            let Some(Happening::Message(dropped)) = queue.happenings.remove(oldest) else { break };
            queue.bytes -= dropped.bytes.len();
            queue.dropped += 1;
            self.faults.report(
                &dropped.channel.offered.topic,
                FaultKind::Overflow,
                "a message was dropped: they come faster than they are taken",
            );
        }
        drop(queue);
        self.filled.notify_one();
    }

    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

/// Bytes of a message with a picture; 0 of all others.
fn picture_bytes(happening: &Happening) -> usize {
    match happening {
        Happening::Message(arrival) if is_picture(&arrival.channel.decoded) => arrival.bytes.len(),
        _ => 0,
    }
}

fn is_picture(channel: &Decoded) -> bool {
    matches!(channel.decoded, Some((Kind::Image | Kind::CompressedImage | Kind::PointCloud, _)))
}

/// Opens a connection; why that is not possible.
async fn open(server: &str) -> Result<Socket, String> {
    let mut request = server.into_client_request().map_err(|error| error.to_string())?;
    let protocols = HeaderValue::from_str(&SUBPROTOCOLS.join(", ")).map_err(|error| error.to_string())?;
    request.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, protocols);
    let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
    match timeout(ANSWER, connect_async_with_config(request, Some(config), true)).await {
        Err(_) => Err(format!("no answer within {} s", ANSWER.as_secs())),
        Ok(Err(Error::Http(answer))) => {
            Err(format!("it answers {}: is it a server of Foxglove's protocol?", answer.status()))
        }
        Ok(Err(error)) => Err(error.to_string()),
        Ok(Ok((socket, _))) => Ok(socket),
    }
}

/// Follows a server, and connects again as often as it is lost.
async fn follow(server: &str, socket: Socket, wanted: &Wanted, shared: &Shared) {
    let mut socket = Some(socket);
    let mut pause = PAUSE.0;
    while !shared.is_over() {
        let opened = match socket.take() {
            Some(socket) => Ok(socket),
            None => open(server).await,
        };
        if let Ok(socket) = opened {
            let (reason, has_spoken) = listen(socket, wanted, shared).await;
            if shared.is_over() {
                return;
            }
            shared.push(Happening::Lost { reason });
            if has_spoken {
                pause = PAUSE.0;
            }
        }
        // Who keeps failing is asked less and less often.
        let until = tokio::time::Instant::now() + pause;
        while !shared.is_over() && tokio::time::Instant::now() < until {
            tokio::time::sleep_until(until.min(tokio::time::Instant::now() + LOOK)).await;
        }
        pause = (pause * 2).min(PAUSE.1);
    }
}

/// Listens to a server until the connection is lost; why, and whether it had something to say.
async fn listen(mut socket: Socket, wanted: &Wanted, shared: &Shared) -> (String, bool) {
    let mut channels: HashMap<u32, Arc<Streamed>> = HashMap::new();
    let mut has_spoken = false;
    let (mut heard, mut is_pinged) = (Instant::now(), false);
    while !shared.is_over() {
        let message = match timeout(LOOK, socket.next()).await {
            Err(_) if heard.elapsed() > GONE_AFTER => {
                return (format!("it gave no sign of life for {} s", GONE_AFTER.as_secs()), has_spoken);
            }
            Err(_) if heard.elapsed() > PING_AFTER && !is_pinged => {
                is_pinged = true;
                if let Err(error) = socket.send(Message::Ping(Bytes::new())).await {
                    return (error.to_string(), has_spoken);
                }
                continue;
            }
            Err(_) => continue,
            Ok(None) => return ("the server closed it".to_owned(), has_spoken),
            Ok(Some(Err(error))) => return (error.to_string(), has_spoken),
            Ok(Some(Ok(message))) => message,
        };
        (heard, is_pinged) = (Instant::now(), false);
        match message {
            Message::Text(text) => match read_text(&text) {
                Ok(FromServer::Info { name }) => {
                    has_spoken = true;
                    shared.push(Happening::Connected { server: name });
                }
                Ok(FromServer::Advertised(offered)) => {
                    let asked_for = wanted.of(offered);
                    if !asked_for.is_empty() {
                        let asked = socket.send(Message::text(subscription(asked_for.keys().copied()))).await;
                        if let Err(error) = asked {
                            return (error.to_string(), has_spoken);
                        }
                        channels.extend(asked_for);
                    }
                }
                Ok(FromServer::Gone(ids)) => ids.iter().for_each(|id| drop(channels.remove(id))),
                Ok(FromServer::Remark { is_trouble: true, text }) => shared.push(Happening::Remark { text }),
                Ok(FromServer::Remark { .. } | FromServer::Other) => {}
                Err(error) => return (error.to_string(), has_spoken),
            },
            Message::Binary(frame) => {
                let Some((id, nanoseconds, message)) = read_frame(&frame) else { continue };
                match channels.get(&id) {
                    Some(channel) => {
                        let logged = Stamp { nanoseconds: i64::try_from(nanoseconds).unwrap_or(i64::MAX) };
                        let bytes = frame.slice(frame.len() - message.len()..);
                        wanted.take(Arrival { channel: Arc::clone(channel), logged, at: heard, bytes }, shared);
                    }
                    None => shared.push(Happening::Stray { number: id }),
                }
            }
            Message::Close(frame) => {
                let reason = frame.map(|frame| frame.reason.to_string()).filter(|reason| !reason.is_empty());
                return (reason.unwrap_or_else(|| "the server closed it".to_owned()), has_spoken);
            }
            Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
        }
    }
    ("it is not wanted any more".to_owned(), has_spoken)
}

impl Wanted {
    /// The channels whose messages are asked for, by their numbers.
    fn of(&self, offered: Vec<Channel>) -> HashMap<u32, Arc<Streamed>> {
        let channels = offered.into_iter().map(|offered| {
            let decoded = Decoded::new(&offered.topic, &offered.schema_name, &offered.encoding);
            (offered.id, Arc::new(Streamed { offered, decoded }))
        });
        channels
            .filter(|(_, channel)| self.follows_all || self.recorder.is_some() || self.is_followed(channel))
            .collect()
    }

    /// Hands a message to whoever takes it.
    fn take(&self, arrival: Arrival, shared: &Shared) {
        if let Some(recorder) = &self.recorder {
            recorder.take(arrival.clone());
        }
        if self.follows_all || self.is_followed(&arrival.channel) {
            shared.push(Happening::Message(arrival));
        }
    }

    fn is_followed(&self, channel: &Streamed) -> bool {
        channel.decoded.decoded.is_some() || self.topic.as_deref() == Some(&channel.offered.topic)
    }
}
