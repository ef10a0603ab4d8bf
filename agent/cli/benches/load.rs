//! 200 viewers on one live inspection while reviews are sent: what they cost the agent, beside one viewer and beside a naive
//! broadcast of raw points. `cargo xtask bench load`.
//!
//! Of the 200 viewers one in ten is slow (100 kB/s) and ten never read. Asked for: bounded memory, an inspection at most 20 %
//! slower than with one viewer, 99 of 100 reviews within 250 ms. The viewers run on the cores of the agent: its own processor
//! time and theirs are both said. The naive broadcast is a program of its own (this one, called with `relay`): it follows the
//! agent as one viewer and sends every client every point of each chunk that changed, uncompressed, through a queue without a
//! bound. Its clients are as fast, slow and mute as those of the agent.
#![allow(clippy::print_stdout)]

use anyhow::{Context, Result, ensure};
use futures_util::SinkExt;
use prost::Message as _;
use semascan_inspection::ports::{Catalogue, InspectionFilter};
use semascan_model::InspectionId;
use semascan_protocol::server_message::Body;
use semascan_protocol::{ClientMessage, Hello, Phase, SUBPROTOCOL, client_message};
use semascan_store::data::DataFolder;
use semascan_tests::agent::{Agent, Revisions, follow};
use semascan_tests::client::{Client, Holdings, open_socket};
use semascan_tests::process::{peak_resident_bytes, processor_seconds};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::sync::mpsc;
use tokio_tungstenite::MaybeTlsStream;
use tokio_tungstenite::tungstenite::Message;

const SMALL: &str = "virtual:starter-motor?seed=3&views=4&size=160x120&cell=2.5";
/// As fast as it can be computed: what viewers cost shows.
const SOURCE: &str = "virtual:starter-motor?seed=7&views=24&size=480x360&errors=none";
const VIEWERS: usize = 200;
/// Every tenth viewer ...
const SLOW: usize = VIEWERS / 10;
const SLOW_BYTES_PER_SECOND: usize = 100_000;
const MUTE: usize = 10;
const FAST: usize = VIEWERS - SLOW - MUTE;
/// Between two reviews.
const REVIEW_EVERY: Duration = Duration::from_millis(50);

const MEGABYTE: u64 = 1 << 20;
/// Most memory that the agent may have resident at any time.
const MOST_MEGABYTES: u64 = 400;
const SLOWER: f64 = 1.2;
const REVIEW_MS: f64 = 250.0;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let done = match arguments.iter().position(|argument| argument == "relay") {
        Some(at) => relay(arguments.get(at + 1)).map(|()| true),
        None => load(),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Measures; whether every bound held.
fn load() -> Result<bool> {
    let scratch = tempfile::tempdir()?;
    let data = scratch.path().join("data");
    let made = Command::new(env!("CARGO_BIN_EXE_semascan")).args(["inspect", SMALL, "--data"]).arg(&data).output()?;
    ensure!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let past = DataFolder::open_beside(&data)?.catalogue().inspections(&InspectionFilter::default())?[0].id;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let one = runtime.block_on(watched(&data, past, &Watched { fast: 1, slow: 0, mute: 0, first: 0 }))?;
    one.print("one viewer");
    let many = Watched { fast: FAST, slow: SLOW, mute: MUTE, first: 1 << 20 };
    let many = runtime.block_on(watched(&data, past, &many))?;
    many.print("200 viewers");
    let naive = runtime.block_on(broadcast(&data))?;
    eprintln!(
        "naive broadcast   {:.0} MB sent to each, {} MB of memory at most, {:.1} s of processor, fast clients have it {:.1} s after \
         the end",
        naive.bytes as f64 / 1e6,
        naive.peak_megabytes,
        naive.processor_s,
        naive.final_s
    );
    let slower = many.duration_s / one.duration_s;
    let bounds = [
        ("every fast viewer has the final model", many.right == FAST),
        ("at most 400 MB of memory", many.peak_megabytes <= MOST_MEGABYTES),
        ("at most 20 % slower than with one viewer", slower <= SLOWER),
        ("a review takes at most 250 ms (p99)", many.review_p99_ms <= REVIEW_MS),
    ];
    eprintln!(
        "{:.0} % slower with 200 viewers; processor time of the agent: {:.1} s more",
        100.0 * (slower - 1.0),
        many.processor_s - one.processor_s
    );
    for (what, held) in bounds {
        eprintln!("{} {what}", if held { "held  " } else { "BROKEN" });
    }
    let figures = json!({
        "viewers": VIEWERS, "slow": SLOW, "mute": MUTE, "one": one.figures(), "many": many.figures(),
        "duration_ratio": slower,
        "naive": {
            "megabytes_to_each": naive.bytes as f64 / 1e6, "peak_megabytes": naive.peak_megabytes,
            "processor_s": naive.processor_s, "final_s": naive.final_s,
        },
    });
    println!("{figures}");
    Ok(bounds.iter().all(|(_, held)| *held))
}

/// Who watches an inspection.
struct Watched {
    fast: usize,
    slow: usize,
    mute: usize,
    /// Number of the first review.
    first: u64,
}

/// What an inspection that was watched came to.
struct Seen {
    /// From when the agent listened to when it said that the inspection is finished.
    duration_s: f64,
    /// Processor time of the agent in that time.
    processor_s: f64,
    /// And of the viewers.
    viewers_processor_s: f64,
    peak_megabytes: u64,
    /// Fast viewers that hold the final model.
    right: usize,
    /// After the end, when the last fast viewer held it.
    final_s: f64,
    bytes: u64,
    reviews: usize,
    review_p50_ms: f64,
    review_p99_ms: f64,
}

impl Seen {
    fn print(&self, who: &str) {
        eprintln!(
            "{who:<17} {:.1} s, {:.1} s of the agent's processor time and {:.1} s of the viewers', {} MB at most; {} fast viewers hold \
             the final model {:.2} s after the end; {:.1} MB for each; {} reviews: p50 {:.1} ms, p99 {:.1} ms",
            self.duration_s,
            self.processor_s,
            self.viewers_processor_s,
            self.peak_megabytes,
            self.right,
            self.final_s,
            self.bytes as f64 / 1e6,
            self.reviews,
            self.review_p50_ms,
            self.review_p99_ms
        );
    }

    fn figures(&self) -> Value {
        json!({
            "duration_s": self.duration_s, "processor_s": self.processor_s, "viewers_processor_s": self.viewers_processor_s,
            "peak_megabytes": self.peak_megabytes, "fast_with_the_final_model": self.right, "final_s": self.final_s,
            "megabytes_to_each": self.bytes as f64 / 1e6, "reviews": self.reviews, "review_p50_ms": self.review_p50_ms,
            "review_p99_ms": self.review_p99_ms,
        })
    }
}

/// An agent that inspects, watched by `who`.
async fn watched(data: &Path, past: InspectionId, who: &Watched) -> Result<Seen> {
    let agent = start(data)?;
    let address = agent.address;
    let own = std::process::id();
    let (processor, viewers_processor) = (agent.processor_seconds()?, processor_seconds(own)?);
    // One of the fast viewers decodes everything, on a thread of its own.
    let strict = std::thread::spawn(move || -> Result<(Revisions, u64, Instant)> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let mut holdings = Holdings::default();
        let client = runtime.block_on(async {
            let mut client = Client::connect(address, &mut holdings).await?;
            client.finish(&mut holdings).await?;
            anyhow::Ok(client)
        })?;
        let at = Instant::now();
        ensure!(client.progress.model_hash == holdings.hash(), "the viewer has another model than the agent");
        Ok((holdings.chunks.iter().map(|(id, chunk)| (*id, chunk.revision)).collect(), client.bytes, at))
    });
    let mut fast = Vec::new();
    for _ in 1..who.fast {
        fast.push(tokio::spawn(follow(open_socket(address, SUBPROTOCOL, None).await?)));
    }
    let mut others = Vec::new();
    for number in 0..who.slow + who.mute {
        let mut socket = open_socket(address, SUBPROTOCOL, None).await?;
        let hello = ClientMessage { body: Some(client_message::Body::Hello(Hello::default())) };
        socket.send(Message::Binary(hello.encode_to_vec().into())).await?;
        let MaybeTlsStream::Plain(stream) = socket.into_inner() else { anyhow::bail!("loopback is not encrypted") };
        let is_slow = number < who.slow;
        others.push(tokio::spawn(async move { if is_slow { crawl(stream).await } else { hold(stream).await } }));
    }
    let is_over = Arc::new(AtomicBool::new(false));
    let reviews = {
        let (is_over, first) = (Arc::clone(&is_over), who.first);
        std::thread::spawn(move || review(address, past, first, &is_over))
    };
    let ended = agent.ended().await?;
    let processor = agent.processor_seconds()? - processor;
    is_over.store(true, Ordering::Relaxed);
    let (held, bytes, mut last) = join(strict).await?.context("the strict viewer")?;
    let mut right = 1;
    for viewer in fast {
        let (revisions, at) = viewer.await??;
        right += usize::from(revisions == held);
        last = last.max(at);
    }
    let mut reviews = join(reviews).await??;
    others.iter().for_each(tokio::task::JoinHandle::abort);
    ensure!(!agent.panicked.load(Ordering::Relaxed), "the agent panicked");
    reviews.sort_by(f64::total_cmp);
    let at = |share: f64| reviews.get(((reviews.len() as f64 * share) as usize).min(reviews.len() - 1)).copied();
    Ok(Seen {
        duration_s: ended.duration_since(agent.started).as_secs_f64(),
        processor_s: processor,
        viewers_processor_s: processor_seconds(own)? - viewers_processor,
        peak_megabytes: peak_resident_bytes(agent.process.id())? / MEGABYTE,
        right,
        final_s: last.saturating_duration_since(ended).as_secs_f64(),
        bytes,
        reviews: reviews.len(),
        review_p50_ms: at(0.5).context("no review was answered")?,
        review_p99_ms: at(0.99).context("no review was answered")?,
    })
}

async fn join<T: Send + 'static>(thread: std::thread::JoinHandle<T>) -> Result<T> {
    let joined = tokio::task::spawn_blocking(|| thread.join()).await?;
    joined.map_err(|_| anyhow::anyhow!("a thread panicked"))
}

fn start(data: &Path) -> Result<Agent> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["serve", "--port", "0", "--source", SOURCE, "--data"]).arg(data);
    Agent::start(command)
}

/// Reads at a limited rate until the stream ends.
async fn crawl(mut stream: tokio::net::TcpStream) {
    let mut buffer = vec![0; SLOW_BYTES_PER_SECOND / 20];
    while stream.read(&mut buffer).await.is_ok_and(|n| n > 0) {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Holds a connection and never reads from it.
async fn hold(stream: tokio::net::TcpStream) {
    std::future::pending::<()>().await;
    drop(stream);
}

/// Sends reviews of a past inspection until it `is_over`; milliseconds that each took.
fn review(address: SocketAddr, past: InspectionId, first: u64, is_over: &AtomicBool) -> Result<Vec<f64>> {
    let mut stream = BufReader::new(TcpStream::connect(address)?);
    let mut times = Vec::new();
    for number in first.. {
        if is_over.load(Ordering::Relaxed) {
            break;
        }
        let review = json!({
            "id": format!("00000000-0000-4000-8000-{number:012x}"), "subject": {"kind": "part"}, "seen": 0,
            "action": {"type": "comment"}, "person": "A. Reviewer", "reason": "because"
        })
        .to_string();
        let head = format!(
            "POST /api/v1/inspections/{past}/reviews HTTP/1.1\r\nHost: {address}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\n\r\n",
            review.len()
        );
        let begun = Instant::now();
        stream.get_mut().write_all(format!("{head}{review}").as_bytes())?;
        let mut length = 0;
        let mut line = String::new();
        let mut status = String::new();
        loop {
            line.clear();
            ensure!(stream.read_line(&mut line)? > 0, "the agent ended the connection");
            if status.is_empty() {
                status.clone_from(&line);
            }
            if let Some(("content-length", value)) = line.trim().to_lowercase().split_once(": ") {
                length = value.parse()?;
            }
            if line.trim().is_empty() {
                break;
            }
        }
        let mut body = vec![0; length];
        stream.read_exact(&mut body)?;
        times.push(1e3 * begun.elapsed().as_secs_f64());
        ensure!(status.starts_with("HTTP/1.1 201"), "{status}: {}", String::from_utf8_lossy(&body));
        std::thread::sleep(REVIEW_EVERY);
    }
    Ok(times)
}

/// What the naive broadcast came to.
struct Naive {
    bytes: u64,
    peak_megabytes: u64,
    processor_s: f64,
    /// After the end, when the last fast client had everything.
    final_s: f64,
}

/// The same inspection, sent on by the naive broadcast to as many clients.
async fn broadcast(data: &Path) -> Result<Naive> {
    let agent = start(data)?;
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("relay").arg(agent.address.to_string()).stdout(Stdio::piped()).stdin(Stdio::null());
    let mut relay = command.spawn()?;
    let mut lines = BufReader::new(relay.stdout.take().context("no stdout")?).lines();
    let address: SocketAddr = lines.next().context("the relay ended")??.parse()?;
    let mut fast = Vec::new();
    let mut others = Vec::new();
    for number in 0..VIEWERS {
        let mut stream = tokio::net::TcpStream::connect(address).await?;
        if number < FAST {
            fast.push(tokio::spawn(async move {
                let (mut buffer, mut bytes) = (vec![0; 1 << 16], 0);
                loop {
                    match stream.read(&mut buffer).await? {
                        0 => return anyhow::Ok((bytes, Instant::now())),
                        n => bytes += n as u64,
                    }
                }
            }));
        } else {
            others.push(tokio::spawn(async move {
                if number < FAST + SLOW { crawl(stream).await } else { hold(stream).await }
            }));
        }
    }
    let ended = agent.ended().await?;
    let (mut bytes, mut last) = (0, ended);
    for client in fast {
        let (received, at) = client.await??;
        bytes = bytes.max(received);
        last = last.max(at);
    }
    let (peak, processor_s) = (peak_resident_bytes(relay.id())?, processor_seconds(relay.id())?);
    others.iter().for_each(tokio::task::JoinHandle::abort);
    relay.kill()?;
    relay.wait()?;
    let final_s = last.saturating_duration_since(ended).as_secs_f64();
    Ok(Naive { bytes, peak_megabytes: peak / MEGABYTE, processor_s, final_s })
}

/// The naive broadcast: follows the agent at `address`, and sends whoever connects all points of every chunk that changes: three
/// coordinates and confidence as 32-bit floats, both classes, the colour. Clients that are behind have a queue as long as it gets.
fn relay(address: Option<&String>) -> Result<()> {
    let address: SocketAddr = address.context("relay ADDRESS")?.parse()?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
        println!("{}", listener.local_addr()?);
        let mut clients: Vec<mpsc::UnboundedSender<Arc<Vec<u8>>>> = Vec::new();
        let mut holdings = Holdings::default();
        let mut client = Client::connect(address, &mut holdings).await?;
        let mut sent: Vec<Arc<Vec<u8>>> = Vec::new();
        while !matches!(client.progress.phase(), Phase::Finished | Phase::Failed) {
            tokio::select! {
                accepted = listener.accept() => {
                    let (mut stream, _) = accepted?;
                    let (sender, mut queue) = mpsc::unbounded_channel::<Arc<Vec<u8>>>();
                    // Who comes late gets everything from the beginning.
                    sent.iter().for_each(|message| drop(sender.send(Arc::clone(message))));
                    clients.push(sender);
                    tokio::spawn(async move {
                        while let Some(message) = queue.recv().await {
                            if stream.write_all(&message).await.is_err() {
                                break;
                            }
                        }
                    });
                }
                body = client.step(&mut holdings) => {
                    if let Body::Chunk(chunk) = body? {
                        let id = chunk.id.context("a chunk without id")?.to_array();
                        let points = holdings.chunks.get(&id).map(|chunk| raw(&chunk.cloud)).unwrap_or_default();
                        let message = Arc::new(points);
                        clients.retain(|client| client.send(Arc::clone(&message)).is_ok());
                        sent.push(message);
                    }
                }
            }
        }
        // Fast clients learn by the end of their connection that they have everything.
        drop(clients);
        tokio::time::sleep(Duration::from_secs(600)).await;
        Ok(())
    })
}

/// The points of a chunk as they are.
fn raw(cloud: &semascan_model::SemanticCloud) -> Vec<u8> {
    let mut bytes = Vec::new();
    for point in cloud.iter() {
        point.position.iter().for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
        bytes.extend_from_slice(&point.confidence.to_le_bytes());
        bytes.extend_from_slice(&point.label.to_le_bytes());
        bytes.extend_from_slice(&point.defect.to_le_bytes());
        bytes.extend_from_slice(&point.color);
    }
    bytes
}
