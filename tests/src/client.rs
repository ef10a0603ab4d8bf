//! A native client of the live stream, as strict as the viewer.

use anyhow::{Context, Result, bail};
use futures_util::{SinkExt, StreamExt};
use prost::Message as _;
use semascan_protocol::chunk::{ChunkDecoder, DecodedChunk, model_hash};
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    ChunkId, ClientMessage, HeldChunk, Hello, Inspection, Phase, Progress, SUBPROTOCOL, ViewReport, Welcome,
    client_message, decode_server,
};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// Longest wait for any message of a running inspection.
const PATIENCE: Duration = Duration::from_secs(120);

/// A socket to the agent.
pub type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// Opens a socket, with an Origin if one is given.
///
/// # Errors
/// If the agent refuses it.
pub async fn open_socket(address: SocketAddr, subprotocol: &str, origin: Option<&str>) -> Result<Socket> {
    open_stream(address, "/ws", subprotocol, origin).await
}

/// Opens a socket to the stream at `path`, which may have a query.
async fn open_stream(address: SocketAddr, path: &str, subprotocol: &str, origin: Option<&str>) -> Result<Socket> {
    let mut request = format!("ws://{address}{path}").into_client_request()?;
    request.headers_mut().insert("sec-websocket-protocol", HeaderValue::from_str(subprotocol)?);
    if let Some(origin) = origin {
        request.headers_mut().insert("origin", HeaderValue::from_str(origin)?);
    }
    Ok(connect_async(request).await?.0)
}

/// What a client holds, across connections.
#[derive(Debug, Default)]
pub struct Holdings {
    /// The inspection they belong to.
    pub inspection: Inspection,
    /// Chunks by coordinates.
    pub chunks: BTreeMap<[i32; 3], DecodedChunk>,
    decoder: ChunkDecoder,
}

impl Holdings {
    /// Hash of the model held.
    pub fn hash(&self) -> u64 {
        model_hash(self.chunks.iter().map(|(id, c)| (*id, c.hash)))
    }

    /// Number of points held.
    pub fn points(&self) -> usize {
        self.chunks.values().map(|c| c.cloud.len()).sum()
    }

    fn hello(&self) -> Hello {
        let held = |(id, c): (&[i32; 3], &DecodedChunk)| HeldChunk {
            id: Some(ChunkId::from_array(*id)),
            revision: c.revision,
        };
        Hello {
            client: "test".into(),
            capabilities: Vec::new(),
            inspection_id: self.inspection.id.clone(),
            epoch: self.inspection.epoch,
            held: self.chunks.iter().map(held).collect(),
        }
    }
}

/// One connection.
#[derive(Debug)]
pub struct Client {
    socket: Socket,
    /// The agent's answer to Hello.
    pub welcome: Welcome,
    /// Bytes received, all messages counted.
    pub bytes: u64,
    /// Chunk messages received, tombstones included.
    pub chunk_messages: u64,
    /// Times the agent asked to clear.
    pub clears: u32,
    /// View reports received.
    pub views: Vec<ViewReport>,
    /// Newest progress.
    pub progress: Progress,
}

impl Client {
    /// Connects and says what `holdings` hold; if the agent cannot resume them they are cleared.
    ///
    /// # Errors
    /// If the agent refuses.
    pub async fn connect(address: SocketAddr, holdings: &mut Holdings) -> Result<Self> {
        Self::connect_to(address, "/ws", &[], holdings).await
    }

    /// As [`connect`](Self::connect), to the stream at `path`, which may have a query, as a client with `capabilities`.
    ///
    /// # Errors
    /// If the agent refuses.
    pub async fn connect_to(
        address: SocketAddr,
        path: &str,
        capabilities: &[&str],
        holdings: &mut Holdings,
    ) -> Result<Self> {
        let mut socket = open_stream(address, path, SUBPROTOCOL, None).await?;
        let capabilities = capabilities.iter().map(|name| (*name).to_owned()).collect();
        let hello = Hello { capabilities, ..holdings.hello() };
        let hello = ClientMessage { body: Some(client_message::Body::Hello(hello)) };
        socket.send(Message::Binary(hello.encode_to_vec().into())).await?;
        let (body, bytes) = next_body(&mut socket).await?;
        let Body::Welcome(welcome) = body else { bail!("expected Welcome, got {body:?}") };
        if !welcome.resumed {
            holdings.chunks.clear();
        }
        holdings.inspection = welcome.inspection.clone().context("Welcome without inspection")?;
        Ok(Self {
            socket,
            welcome,
            bytes,
            chunk_messages: 0,
            clears: 0,
            views: Vec::new(),
            progress: Progress::default(),
        })
    }

    /// Takes one message in; the body for tests that look closer.
    ///
    /// # Errors
    /// If the connection or the message is bad.
    pub async fn step(&mut self, holdings: &mut Holdings) -> Result<Body> {
        let (body, bytes) = next_body(&mut self.socket).await?;
        self.bytes += bytes;
        match &body {
            Body::Chunk(update) => {
                self.chunk_messages += 1;
                let chunk = holdings.decoder.decode(update)?;
                holdings.chunks.insert(chunk.id, chunk);
            }
            Body::Gone(gone) => {
                self.chunk_messages += 1;
                holdings.chunks.remove(&gone.id.context("tombstone without id")?.to_array());
            }
            Body::Clear(clear) => {
                self.clears += 1;
                holdings.chunks.clear();
                holdings.inspection = clear.inspection.clone().context("Clear without inspection")?;
            }
            Body::Progress(progress) => self.progress = progress.clone(),
            Body::View(view) => self.views.push(view.clone()),
            Body::Refused(refused) => bail!("refused: {}", refused.reason),
            // Messages that no test counts.
            _ => {}
        }
        Ok(body)
    }

    /// Follows the stream until the inspection is over.
    ///
    /// # Errors
    /// If the connection or a message is bad.
    pub async fn finish(&mut self, holdings: &mut Holdings) -> Result<()> {
        while !matches!(self.progress.phase(), Phase::Finished | Phase::Failed) {
            self.step(holdings).await?;
        }
        Ok(())
    }
}

/// The next message and its size.
///
/// # Errors
/// If the connection ends or the message cannot be decoded.
pub async fn next_body(socket: &mut Socket) -> Result<(Body, u64)> {
    loop {
        let message = tokio::time::timeout(PATIENCE, socket.next()).await.context("nothing arrives")?;
        match message.context("the agent closed the connection")?? {
            Message::Binary(bytes) => {
                let body = decode_server(&bytes)?.body.context("empty message")?;
                return Ok((body, bytes.len() as u64));
            }
            Message::Close(frame) => bail!("closed: {frame:?}"),
            _ => {}
        }
    }
}
