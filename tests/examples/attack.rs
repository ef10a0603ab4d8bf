//! What many and hostile clients cost an agent, measured from outside: `attack AGENT [--half-open ADDRESS ...]`.
//!
//! The agent inspects a simulated part while thousands of idle connections, mute downloads, large Hellos and 200 viewers come
//! one after the other. Its memory must stay within a bound, and a viewer that came first must have the final model soon after
//! the end. With `--half-open`, viewers come from these addresses, which then vanish: to be run in a network namespace of its
//! own, where `ip address` may be changed. One JSON object goes to stdout; the exit code says whether every bound held.

use anyhow::{Context, Result, bail, ensure};
use futures_util::SinkExt;
use prost::Message as _;
use semascan_protocol::{ChunkId, ClientMessage, HeldChunk, Hello, SUBPROTOCOL, client_message};
use semascan_tests::agent::{Agent, Revisions, follow};
use semascan_tests::client::{Client, Holdings, open_socket};
use semascan_tests::process::{peak_resident_bytes, resident_bytes, sockets};
use serde_json::{Map, Value, json};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;

const SOURCE: &str = "virtual:starter-motor?seed=7&views=24&size=320x240&errors=none";
/// Seconds between two views: the inspection lasts as long as the attack.
const PACE: &str = "1.5";
const MEGABYTE: u64 = 1 << 20;

const IDLE: usize = 10_000;
const DOWNLOADS: usize = 300;
const DOWNLOAD_BYTES: usize = 4 << 20;
const HELLOS: usize = 40;
const HELLO_CHUNKS: usize = 200_000;
const VIEWERS: usize = 200;
const HALF_OPEN: usize = 1000;

/// Most memory that the agent may have resident at any time.
const MOST_MEGABYTES: u64 = 400;
/// Most bytes of log.
const MOST_LOG: u64 = 100_000;
/// Time after the end in which a fast viewer must hold the final model.
const FINAL_WITHIN: Duration = Duration::from_secs(2);
/// Time in which vanished viewers must be noticed.
const NOTICED_WITHIN: Duration = Duration::from_secs(60);
/// The whole may last so long.
const LONGEST: Duration = Duration::from_secs(300);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<bool> {
    let (agent, addresses) = match arguments {
        [agent] => (agent, &[][..]),
        [agent, flag, addresses @ ..] if flag == "--half-open" => (agent, addresses),
        _ => bail!("attack AGENT [--half-open ADDRESS ...]"),
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    runtime.block_on(async {
        let attack = attack(Path::new(agent), addresses);
        tokio::time::timeout(LONGEST, attack).await.context("the attack lasts too long")?
    })
}

/// Attacks an agent that it starts; whether every bound held.
async fn attack(program: &Path, addresses: &[String]) -> Result<bool> {
    let files = tempfile::tempdir()?;
    std::fs::write(files.path().join("large.wasm"), vec![7; DOWNLOAD_BYTES])?;
    let mut command = Command::new(program);
    command
        .args(["demo", "--no-open", "--port", "0", "--source", SOURCE, "--pace", PACE, "--web-dir"])
        .arg(files.path());
    let agent = Agent::start(command)?;
    let address = agent.address;
    let mut report = Report { figures: Map::new(), agent: &agent, bounds: Vec::new() };
    report.put("start");

    // On a thread of its own: what the others compute does not hold it up.
    let fast = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let mut holdings = Holdings::default();
        let followed: Result<u64> = runtime.block_on(async {
            let mut client = Client::connect(address, &mut holdings).await?;
            client.finish(&mut holdings).await?;
            Ok(client.progress.model_hash)
        });
        let at = Instant::now();
        ensure!(followed? == holdings.hash(), "the fast viewer has another model than the agent");
        let revisions = holdings.chunks.iter().map(|(id, chunk)| (*id, chunk.revision)).collect();
        Ok((revisions, at))
    });

    let most = file_limit()?.saturating_sub(500).min(IDLE);
    if most < IDLE {
        eprintln!("the limit of open files allows {most} of {IDLE} idle connections");
    }
    let mut idle = Vec::with_capacity(most);
    for _ in 0..most {
        // What the agent does not take any more waits in the kernel or is refused: both are answers.
        if let Ok(Ok(stream)) = tokio::time::timeout(Duration::from_secs(1), TcpStream::connect(address)).await {
            idle.push(stream);
        }
    }
    tokio::time::sleep(Duration::from_secs(2)).await;
    report.figures.insert("idle_connections".into(), idle.len().into());
    report.put("idle");
    drop(idle);

    let mut mute = Vec::new();
    for _ in 0..DOWNLOADS {
        let mut stream = TcpStream::connect(address).await?;
        let request = format!("GET /large.wasm HTTP/1.1\r\nHost: {address}\r\n\r\n");
        if stream.write_all(request.as_bytes()).await.is_ok() {
            mute.push(stream);
        }
    }
    tokio::time::sleep(Duration::from_secs(2)).await;
    report.figures.insert("mute_downloads".into(), mute.len().into());
    report.put("mute");
    drop(mute);

    let message = large_hello();
    let mut large = Vec::new();
    for _ in 0..HELLOS {
        let Ok(mut socket) = open_socket(address, SUBPROTOCOL, None).await else { continue };
        // An agent that refuses it closes while it is being sent.
        let _ =
            tokio::time::timeout(Duration::from_secs(2), socket.send(Message::Binary(message.clone().into()))).await;
        large.push(socket);
    }
    tokio::time::sleep(Duration::from_secs(2)).await;
    report.figures.insert("large_hellos".into(), large.len().into());
    report.figures.insert("hello_bytes".into(), message.len().into());
    report.put("hellos");
    drop(large);

    let processor_before = agent.processor_seconds()?;
    let mut viewers = Vec::new();
    for _ in 0..VIEWERS {
        let socket = open_socket(address, SUBPROTOCOL, None).await.context("a viewer cannot connect")?;
        viewers.push(tokio::spawn(follow(socket)));
    }
    let mut followed = Vec::new();
    for viewer in viewers {
        followed.push(viewer.await??);
    }
    let fast = tokio::task::spawn_blocking(|| fast.join()).await?;
    let (held, at): (Revisions, Instant) =
        fast.map_err(|_| anyhow::anyhow!("the fast viewer panicked"))?.context("the fast viewer")?;
    let right = followed.iter().filter(|(revisions, _)| *revisions == held).count();
    report.figures.insert("viewers_with_the_final_model".into(), right.into());
    let processor = agent.processor_seconds()? - processor_before;
    report.figures.insert("processor_seconds_with_the_inspection".into(), processor.into());
    report.put("viewers");
    report.bound("every viewer has the final model", right == VIEWERS && !held.is_empty());
    // The agent says it after it has judged the model: the first viewer that was told may have learnt it sooner.
    let told = followed.iter().map(|(_, at)| *at).min();
    let ended = told.into_iter().chain([agent.ended().await?]).min().context("no end")?;
    let late = at.saturating_duration_since(ended);
    report.figures.insert("fast_viewer_seconds_after_the_end".into(), late.as_secs_f64().into());
    report.bound("the fast viewer has the final model within 2 s of the end", late <= FINAL_WITHIN);

    if addresses.is_empty() {
        eprintln!("SKIPPED: half-open peers, without a network namespace");
    } else {
        half_open(&mut report, addresses).await?;
    }
    let peak = peak_resident_bytes(agent.process.id())? / MEGABYTE;
    report.figures.insert("peak_megabytes".into(), peak.into());
    report.bound("at most 400 MB", peak <= MOST_MEGABYTES);
    let log_bytes = agent.log_bytes.load(Ordering::Relaxed);
    report.figures.insert("log_bytes".into(), log_bytes.into());
    report.bound(
        "at most 100 kB of log, and no panic in it",
        log_bytes <= MOST_LOG && !agent.panicked.load(Ordering::Relaxed),
    );
    let held = report.bounds.iter().all(|(_, held)| *held);
    for (what, held) in &report.bounds {
        eprintln!("{} {what}", if *held { "held  " } else { "BROKEN" });
    }
    serde_json::to_writer_pretty(std::io::stdout().lock(), &Value::Object(report.figures))?;
    Ok(held)
}

/// Viewers from `addresses`, which vanish without a word.
async fn half_open(report: &mut Report<'_>, addresses: &[String]) -> Result<()> {
    let agent = report.agent;
    let before = sockets(agent.process.id())?;
    let mut vanished = Vec::new();
    for i in 0..HALF_OPEN {
        let from = &addresses[i % addresses.len()];
        if let Ok(socket) = viewer_from(from, agent.address).await {
            vanished.push(socket);
        }
    }
    tokio::time::sleep(Duration::from_secs(1)).await;
    let held = sockets(agent.process.id())?.saturating_sub(before);
    for address in addresses {
        let removed = Command::new("ip").args(["address", "del", &format!("{address}/32"), "dev", "lo"]).status()?;
        ensure!(removed.success(), "the address {address} cannot be taken away");
    }
    let begun = Instant::now();
    while sockets(agent.process.id())? > before + 2 && begun.elapsed() < NOTICED_WITHIN + Duration::from_secs(10) {
        tokio::time::sleep(Duration::from_millis(500)).await;
    }
    let noticed = begun.elapsed();
    report.figures.insert("half_open_peers".into(), vanished.len().into());
    report.figures.insert("half_open_held".into(), held.into());
    report.figures.insert("half_open_noticed_after_seconds".into(), noticed.as_secs_f64().into());
    report.put("half_open");
    report.bound("vanished viewers are noticed within 60 s", noticed <= NOTICED_WITHIN && held > 0);
    Ok(())
}

/// A viewer that connects from address `from`.
async fn viewer_from(from: &str, to: SocketAddr) -> Result<tokio_tungstenite::WebSocketStream<TcpStream>> {
    let socket = TcpSocket::new_v4()?;
    socket.bind(format!("{from}:0").parse()?)?;
    let stream = tokio::time::timeout(Duration::from_secs(5), socket.connect(to)).await??;
    let mut request = format!("ws://{to}/ws").into_client_request()?;
    request.headers_mut().insert("sec-websocket-protocol", HeaderValue::from_static(SUBPROTOCOL));
    let (mut socket, _) = tokio_tungstenite::client_async(request, stream).await?;
    let hello = Hello { client: "half-open".into(), ..Hello::default() };
    let hello = ClientMessage { body: Some(client_message::Body::Hello(hello)) };
    socket.send(Message::Binary(hello.encode_to_vec().into())).await?;
    Ok(socket)
}

/// A Hello of some 4 MB.
fn large_hello() -> Vec<u8> {
    let held = |i: usize| HeldChunk { id: Some(ChunkId { x: i as i32, y: i32::MIN, z: i32::MAX }), revision: 1 };
    let hello = Hello { client: "large".into(), held: (0..HELLO_CHUNKS).map(held).collect(), ..Hello::default() };
    ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec()
}

/// Files that this process may have open.
fn file_limit() -> Result<usize> {
    let limits = std::fs::read_to_string("/proc/self/limits").context("/proc/self/limits")?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max open files")).context("no limit of open files")?;
    line.split_whitespace().next().and_then(|n| n.parse().ok()).context("a limit that is no number")
}

/// What was measured.
struct Report<'a> {
    figures: Map<String, Value>,
    agent: &'a Agent,
    bounds: Vec<(&'static str, bool)>,
}

impl Report<'_> {
    /// The agent's memory at the end of `phase`.
    fn put(&mut self, phase: &str) {
        let id = self.agent.process.id();
        let megabytes = |bytes: Result<u64>| bytes.map_or(Value::Null, |b| (b / MEGABYTE).into());
        let memory = json!({ "now": megabytes(resident_bytes(id)), "peak": megabytes(peak_resident_bytes(id)) });
        eprintln!("{phase:<10} memory in MB: {memory}");
        self.figures.insert(format!("{phase}_megabytes"), memory);
    }

    fn bound(&mut self, what: &'static str, held: bool) {
        self.bounds.push((what, held));
    }
}
