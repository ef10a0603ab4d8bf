//! An agent as a process of its own, watched from outside, and viewers that cost as little as they can.

use crate::client::{Socket, next_body};
use crate::process::processor_seconds;
use anyhow::{Context, Result, bail, ensure};
use futures_util::SinkExt;
use prost::Message as _;
use semascan_protocol::server_message::Body;
use semascan_protocol::{ClientMessage, Hello, Phase, client_message};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use tokio_tungstenite::tungstenite::Message;

/// An agent that runs until this is dropped.
#[derive(Debug)]
pub struct Agent {
    /// The process.
    pub process: Child,
    /// Where it listens.
    pub address: SocketAddr,
    /// When it listened.
    pub started: Instant,
    /// Bytes of log that it wrote since then.
    pub log_bytes: Arc<AtomicU64>,
    /// Whether its log speaks of a panic.
    pub panicked: Arc<AtomicBool>,
    ended: Arc<OnceLock<Instant>>,
}

impl Agent {
    /// Starts the agent as `command` says, and waits until it listens.
    ///
    /// # Errors
    /// If it cannot be started, or ends first.
    pub fn start(mut command: Command) -> Result<Self> {
        let process = command.stderr(Stdio::piped()).stdin(Stdio::null()).spawn();
        let mut process = process.with_context(|| command.get_program().display().to_string())?;
        let mut log = BufReader::new(process.stderr.take().context("no stderr")?);
        let mut line = Vec::new();
        let address = loop {
            line.clear();
            ensure!(log.read_until(b'\n', &mut line)? > 0, "the agent ended before it listened");
            let text = String::from_utf8_lossy(&line);
            if let Some((_, rest)) = text.split_once("listening on http://") {
                // Nothing, a line end or a colour follows.
                let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == ':')).unwrap_or(rest.len());
                break rest[..end].parse().with_context(|| text.clone().into_owned())?;
            }
        };
        let (log_bytes, ended) = (Arc::new(AtomicU64::new(0)), Arc::new(OnceLock::new()));
        let panicked = Arc::new(AtomicBool::new(false));
        let (bytes, end, panics) = (Arc::clone(&log_bytes), Arc::clone(&ended), Arc::clone(&panicked));
        std::thread::spawn(move || {
            let mut line = Vec::new();
            while log.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
                bytes.fetch_add(line.len() as u64, Ordering::Relaxed);
                let text = String::from_utf8_lossy(&line);
                if text.contains(" finished: ") {
                    let _ = end.set(Instant::now());
                }
                if text.contains(" panicked at ") {
                    panics.store(true, Ordering::Relaxed);
                }
                line.clear();
            }
        });
        Ok(Self { process, address, started: Instant::now(), log_bytes, panicked, ended })
    }

    /// When the agent said that the inspection is finished; waits for it.
    ///
    /// # Errors
    /// If it does not say it within some minutes.
    pub async fn ended(&self) -> Result<Instant> {
        for _ in 0..3000 {
            if let Some(at) = self.ended.get() {
                return Ok(*at);
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        bail!("the agent did not say that the inspection is finished")
    }

    /// Processor time that it took so far.
    ///
    /// # Errors
    /// If the system does not say it.
    pub fn processor_seconds(&self) -> Result<f64> {
        processor_seconds(self.process.id())
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        // It has ended already where this fails.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Revisions of the chunks that a viewer holds.
pub type Revisions = BTreeMap<[i32; 3], u32>;

/// Follows the stream to its end, and says when that came, without decoding the chunks: of many viewers the decoders would be
/// measured instead of the agent.
///
/// # Errors
/// If the connection ends or a message is bad.
pub async fn follow(mut socket: Socket) -> Result<(Revisions, Instant)> {
    let hello = ClientMessage { body: Some(client_message::Body::Hello(Hello::default())) };
    socket.send(Message::Binary(hello.encode_to_vec().into())).await?;
    let mut revisions = Revisions::new();
    loop {
        match next_body(&mut socket).await?.0 {
            Body::Clear(_) => revisions.clear(),
            Body::Chunk(chunk) => {
                revisions.insert(chunk.id.context("a chunk without id")?.to_array(), chunk.revision);
            }
            Body::Gone(gone) => {
                revisions.remove(&gone.id.context("a tombstone without id")?.to_array());
            }
            Body::Progress(progress) if matches!(progress.phase(), Phase::Finished | Phase::Failed) => {
                return Ok((revisions, Instant::now()));
            }
            Body::Refused(refused) => bail!("refused: {}", refused.reason),
            // What says nothing of the model.
            _ => {}
        }
    }
}
