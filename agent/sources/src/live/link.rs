//! The connection to a server of Foxglove's protocol, on a thread of its own: it subscribes to what can be decoded, and is made again
//! when it is lost. What comes faster than it is taken is bounded: the oldest pictures are dropped and counted, never transforms.

use crate::messages::{Kind, Stamp};
use crate::recording::Channel as Decoded;
use futures_util::{SinkExt, StreamExt};
use semascan_foxglove::client::{Channel, FromServer, read_frame, read_text, subscription};
use semascan_foxglove::protocol::SUBPROTOCOLS;
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::{HeaderValue, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

/// Time in which a server must answer.
const ANSWER: Duration = Duration::from_secs(5);
/// Pause before a lost connection is made again, which doubles up to the second.
const PAUSE: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(4));
/// Largest message.
const LARGEST: usize = 256 << 20;
/// Bytes of pictures that wait at most.
const MOST_WAITING: usize = 256 << 20;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// A message that came.
#[derive(Clone, Debug)]
pub(super) struct Arrival {
    pub(super) channel: Arc<Decoded>,
    /// When the server sent it.
    pub(super) logged: Stamp,
    pub(super) bytes: Vec<u8>,
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
    /// A message came.
    Message(Arrival),
}

/// A connection that is made again when it is lost.
#[derive(Debug)]
pub(super) struct Link {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    queue: Mutex<Queue>,
    filled: Condvar,
    is_over: AtomicBool,
}

#[derive(Debug, Default)]
struct Queue {
    happenings: VecDeque<Happening>,
    /// Bytes of the pictures among them.
    bytes: usize,
    dropped: u64,
}

impl Link {
    /// Connects, and follows the server until it is dropped; why it cannot be reached.
    pub(super) fn connect(server: &str) -> Result<Self, String> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| e.to_string())?;
        let socket = runtime.block_on(open(server))?;
        let shared = Arc::<Shared>::default();
        let (server, follower) = (server.to_owned(), Arc::clone(&shared));
        let follow = move || runtime.block_on(follow(&server, socket, &follower));
        thread::Builder::new().name("camera".into()).spawn(follow).map_err(|error| error.to_string())?;
        Ok(Self { shared })
    }

    /// What happened next; `None` if nothing did within `patience`.
    pub(super) fn next(&self, patience: Duration) -> Option<Happening> {
        let queue = self.shared.lock();
        let waited = self.shared.filled.wait_timeout_while(queue, patience, |queue| queue.happenings.is_empty());
        let (mut queue, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let happening = queue.happenings.pop_front()?;
        queue.bytes -= picture_bytes(&happening);
        Some(happening)
    }

    /// Messages that were dropped because they came faster than they were taken.
    pub(super) fn dropped(&self) -> u64 {
        self.shared.lock().dropped
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
        queue.bytes += picture_bytes(&happening);
        queue.happenings.push_back(happening);
        while queue.bytes > MOST_WAITING {
            let Some(oldest) = queue.happenings.iter().position(|happening| picture_bytes(happening) > 0) else {
                break;
            };
            queue.bytes -= queue.happenings.remove(oldest).map_or(0, |happening| picture_bytes(&happening));
            queue.dropped += 1;
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
        Happening::Message(arrival) if is_picture(&arrival.channel) => arrival.bytes.len(),
        _ => 0,
    }
}

fn is_picture(channel: &Decoded) -> bool {
    matches!(channel.decoded, Some((Kind::Image | Kind::CompressedImage | Kind::PointCloud, _)))
}

/// Opens a connection; why that is not possible.
pub(super) async fn open(server: &str) -> Result<Socket, String> {
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
async fn follow(server: &str, socket: Socket, shared: &Shared) {
    let mut socket = Some(socket);
    let mut pause = PAUSE.0;
    while !shared.is_over() {
        let opened = match socket.take() {
            Some(socket) => Ok(socket),
            None => open(server).await,
        };
        if let Ok(socket) = opened {
            let (reason, has_spoken) = listen(socket, shared).await;
            shared.push(Happening::Lost { reason });
            if has_spoken {
                pause = PAUSE.0;
            }
        }
        // Who keeps failing is asked less and less often.
        tokio::time::sleep(pause).await;
        pause = (pause * 2).min(PAUSE.1);
    }
}

/// Listens to a server until the connection is lost; why, and whether it had something to say.
async fn listen(mut socket: Socket, shared: &Shared) -> (String, bool) {
    let mut channels: HashMap<u32, Arc<Decoded>> = HashMap::new();
    let mut has_spoken = false;
    while !shared.is_over() {
        let message = match timeout(Duration::from_millis(500), socket.next()).await {
            Err(_) => continue,
            Ok(None) => return ("the server closed it".to_owned(), has_spoken),
            Ok(Some(Err(error))) => return (error.to_string(), has_spoken),
            Ok(Some(Ok(message))) => message,
        };
        match message {
            Message::Text(text) => match read_text(&text) {
                Ok(FromServer::Info { name }) => {
                    has_spoken = true;
                    shared.push(Happening::Connected { server: name });
                }
                Ok(FromServer::Advertised(offered)) => {
                    let wanted = wanted(offered);
                    if !wanted.is_empty() {
                        let asked = socket.send(Message::text(subscription(wanted.keys().copied()))).await;
                        if let Err(error) = asked {
                            return (error.to_string(), has_spoken);
                        }
                        channels.extend(wanted);
                    }
                }
                Ok(FromServer::Gone(ids)) => ids.iter().for_each(|id| drop(channels.remove(id))),
                Ok(FromServer::Remark { is_trouble: true, text }) => shared.push(Happening::Remark { text }),
                Ok(FromServer::Remark { .. } | FromServer::Other) => {}
                Err(error) => return (error.to_string(), has_spoken),
            },
            Message::Binary(frame) => {
                if let Some((id, nanoseconds, message)) = read_frame(&frame)
                    && let Some(channel) = channels.get(&id)
                {
                    let logged = Stamp { nanoseconds: i64::try_from(nanoseconds).unwrap_or(i64::MAX) };
                    let arrival = Arrival { channel: Arc::clone(channel), logged, bytes: message.to_vec() };
                    shared.push(Happening::Message(arrival));
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

/// The channels whose messages are decoded, by their numbers.
fn wanted(offered: Vec<Channel>) -> HashMap<u32, Arc<Decoded>> {
    let decoded = offered
        .into_iter()
        .map(|channel| (channel.id, Decoded::new(&channel.topic, &channel.schema_name, &channel.encoding)));
    decoded.filter(|(_, channel)| channel.decoded.is_some()).map(|(id, channel)| (id, Arc::new(channel))).collect()
}
