//! How long the end of integrating a view is from its last decoded chunk at the clients.
//!
//! Two fast clients on loopback decode everything while a third reads at 100 kB/s. Views are captured beforehand (the
//! virtual cell at 640x480) and replayed, so that rendering does not compete for the cores: a camera would not either.
//! Prints one JSON object on stdout.

use anyhow::{Context, Result};
use futures_util::SinkExt;
use prost::Message as _;
use semascan_inspection::Inspection;
use semascan_inspection::bus::Events;
use semascan_inspection::event::EventKind;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_perception::view::View;
use semascan_protocol::{ClientMessage, Hello, Phase, SUBPROTOCOL, client_message};
use semascan_server::{LiveModel, LiveStream};
use semascan_tests::client::{Client, Holdings, open_socket};
use semascan_tests::served::Served;
use semascan_tests::sources::open;
use serde_json::json;
use std::io::Write as _;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::io::AsyncReadExt;
use tokio_tungstenite::MaybeTlsStream;

const SOURCE: &str = "virtual:starter-motor?seed=7&views=12";
const ROUNDS: usize = 6;
/// Time between two views: shorter than any robot's motion.
const PACE: Duration = Duration::from_millis(500);
const SLOW_BYTES_PER_SECOND: u64 = 100_000;

/// Views from memory.
struct Replay {
    info: SourceInfo,
    views: std::vec::IntoIter<View>,
}

impl Source for Replay {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        self.views.next().map(Ok)
    }
}

/// Publishes an inspection to `live`; when each view was integrated, and how many chunk messages had been published after
/// it.
fn publish(events: Events, live: &LiveModel) -> Vec<(Instant, u64)> {
    let mut stream = LiveStream::new(live);
    let mut marks = Vec::new();
    for event in events {
        let integrated = Instant::now();
        stream.handle(&event);
        if matches!(event.kind, EventKind::ModelChanged { complete: false, .. }) {
            marks.push((integrated, live.totals().messages));
        }
    }
    marks
}

/// Follows an inspection; when the n-th chunk message had been decoded.
async fn follow(address: SocketAddr) -> Result<Vec<Instant>> {
    let mut holdings = Holdings::default();
    let mut client = Client::connect(address, &mut holdings).await?;
    let mut decoded = Vec::new();
    while client.progress.phase() != Phase::Finished {
        client.step(&mut holdings).await?;
        decoded.resize(client.chunk_messages as usize, Instant::now());
    }
    Ok(decoded)
}

/// Reads raw bytes at a limited rate until it is dropped.
async fn crawl(address: SocketAddr) -> Result<()> {
    let mut socket = open_socket(address, SUBPROTOCOL, None).await?;
    let hello = Hello { client: "slow".into(), ..Hello::default() };
    let message = ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec();
    socket.send(tokio_tungstenite::tungstenite::Message::Binary(message.into())).await?;
    let MaybeTlsStream::Plain(mut stream) = socket.into_inner() else { anyhow::bail!("loopback is not encrypted") };
    let mut buffer = vec![0; SLOW_BYTES_PER_SECOND as usize / 20];
    while stream.read(&mut buffer).await? > 0 {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut source = open(SOURCE)?;
    let mut views = Vec::new();
    while let Some(view) = source.next_view() {
        views.push(view?);
    }
    let info = source.info().clone();
    let runtime = tokio::runtime::Runtime::new()?;
    let mut latencies = Vec::new();
    let mut totals = Default::default();
    for _ in 0..ROUNDS {
        runtime.block_on(async {
            let served = Served::start()?;
            let live = Arc::clone(&served.live);
            let slow = tokio::spawn(crawl(served.address));
            let fast: Vec<_> = (0..2).map(|_| tokio::spawn(follow(served.address))).collect();
            tokio::time::sleep(Duration::from_millis(200)).await;
            let replay = Replay { info: info.clone(), views: views.clone().into_iter() };
            let mut spec = InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() };
            spec.source.pace_s = PACE.as_secs_f64();
            let inspection = Inspection::new(spec, Box::new(replay))?;
            let (events, stream) = (inspection.subscribe(), Arc::clone(&live));
            let handle = inspection.start();
            let marks = tokio::task::spawn_blocking(move || publish(events, &stream)).await?;
            handle.wait()?;
            for client in fast {
                let decoded = client.await??;
                let mut before = 0;
                for &(integrated, messages) in &marks {
                    // A view that published nothing has nothing to wait for.
                    if messages > before {
                        let at = decoded.get(messages as usize - 1).context("a fast client missed a revision")?;
                        latencies.push(at.saturating_duration_since(integrated));
                    }
                    before = messages;
                }
            }
            slow.abort();
            totals = live.totals();
            anyhow::Ok(())
        })?;
    }
    latencies.sort_unstable();
    let at = |share: f64| latencies[((latencies.len() - 1) as f64 * share).round() as usize].as_secs_f64() * 1e3;
    let figures = json!({
        "source": SOURCE,
        "views": views.len(),
        "samples": latencies.len(),
        "latency_median_ms": at(0.5),
        "latency_p99_ms": at(0.99),
        "stream_bytes": totals.bytes,
        "snapshot_bytes": totals.snapshot_bytes,
        "stream_to_snapshot": totals.bytes as f64 / totals.snapshot_bytes.max(1) as f64,
        "points": totals.points,
        "snapshot_bytes_per_point": totals.snapshot_bytes as f64 / totals.points.max(1) as f64,
    });
    writeln!(std::io::stdout(), "{figures}")?;
    Ok(())
}
