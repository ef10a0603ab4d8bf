//! Whether a camera at 30 Hz is taken in without loss while its views are inspected and everything is recorded.
//!
//! Another process streams colour (640 x 480, JPEG), depth (16UC1), both calibrations, transforms and joints at 100 Hz as a robot's
//! bridge does; pictures are those of the virtual cell. This one records all of it and inspects one view a second. What was sent is
//! compared with what is in the file, message by message. Memory is that of this process while the stream runs.
//!
//! `--seconds N` says how long (600), `--registration kinematic` leaves the alignment of the views out. Prints one JSON object on stdout.
#![allow(clippy::print_stdout)] // A benchmark prints its figures.

mod camera;
mod process;

use anyhow::{Context, Result, ensure};
use process::Usage;
use semascan_inspection::Inspection;
use semascan_inspection::event::EventKind;
use semascan_inspection::spec::{InspectionSpec, LabelSource, RegistrationMethod};
use semascan_sources::OpenOptions;
use semascan_sources::live::{LiveAddress, LiveSource};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Seconds without a picture after which the stream is over.
const SILENCE: u64 = 3;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|place| arguments.get(place + 1));
    let of_xtask = std::env::var("SEMASCAN_BENCH_SECONDS").ok();
    let seconds: u64 = value("--seconds").or(of_xtask.as_ref()).map_or(Ok(600), |n| n.parse()).context("--seconds")?;
    if arguments.iter().any(|argument| argument == camera::ARGUMENT) {
        return camera::stream(seconds);
    }
    let registration = match value("--registration").map(String::as_str) {
        Some("kinematic") => RegistrationMethod::Kinematic,
        _ => RegistrationMethod::Auto,
    };
    println!("{:#}", measure(seconds, registration)?);
    Ok(())
}

fn measure(seconds: u64, registration: RegistrationMethod) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("stream.mcap");
    let mut server = Command::new(std::env::current_exe()?);
    server.args([camera::ARGUMENT, "--seconds", &seconds.to_string()]).stdout(Stdio::piped());
    let mut server = server.spawn().context("the camera's process")?;
    let mut said = BufReader::new(server.stdout.take().context("a pipe")?).lines();
    let port = said.next().context("the camera says nothing")??;
    eprintln!("30 Hz for {seconds} s, one view a second inspected, all of it recorded");

    let record = file.display();
    let uri = format!("ws://127.0.0.1:{port}?trigger=period:1&fixed_frame=table&silence_s={SILENCE}&record={record}");
    let address = LiveAddress::read(&uri).map_err(anyhow::Error::msg)?;
    let mut spec = InspectionSpec { labels: LabelSource::None, registration, ..InspectionSpec::default() };
    spec.source.uri = Some(uri.clone());
    let source = LiveSource::open(address, OpenOptions::from(&spec))?;
    let faults = source.faults();
    let begun = Usage::now()?;
    let began = Instant::now();
    let inspection = Inspection::new(spec, Box::new(source))?;
    let events = inspection.subscribe();
    let handle = inspection.start();
    let followed = thread::spawn(move || {
        let finished = events.filter_map(|event| match &event.kind {
            EventKind::ViewFinished { record, .. } => Some(record.reason.is_none()),
            _ => None,
        });
        finished.fold((0_u64, 0_u64), |(used, left_out), is_used| {
            (used + u64::from(is_used), left_out + u64::from(!is_used))
        })
    });

    // Memory second by second while the stream runs.
    let is_over = Arc::new(AtomicBool::new(false));
    let over = Arc::clone(&is_over);
    let sampled = thread::spawn(move || {
        let mut samples = Vec::new();
        while !over.load(Ordering::Relaxed) && began.elapsed().as_secs() < seconds {
            samples.extend(Usage::now().ok().map(|usage| usage.resident_bytes));
            thread::sleep(Duration::from_secs(1));
        }
        (samples, Usage::now().ok())
    });
    let sent = said.next().context("the camera ended without a word")??;
    let sent: Value = serde_json::from_str(&sent)?;
    let (samples, ended) = sampled.join().map_err(|_| anyhow::anyhow!("the thread of the samples"))?;
    let inspected = handle.wait();
    is_over.store(true, Ordering::Relaxed);
    let (used, left_out) = followed.join().map_err(|_| anyhow::anyhow!("the thread of the events"))?;
    ensure!(server.wait()?.success(), "the camera's process failed");
    let inspected = inspected?;
    let stream = inspected.record.settings.iter().find(|setting| setting.name == "stream").map(|s| s.value.clone());

    let recorded = recorded(&file)?;
    let sent_by_topic: BTreeMap<String, u64> = serde_json::from_value(sent["messages"].clone())?;
    let lost: u64 =
        sent_by_topic.iter().map(|(topic, n)| n.saturating_sub(recorded.get(topic).copied().unwrap_or(0))).sum();
    let ended = ended.context("no figures of this process")?;
    let cpu = (ended.processor_seconds - begun.processor_seconds) / seconds as f64;
    // The first seconds build up buffers and the model.
    let megabytes = |place: usize| samples.get(place).map(|bytes| *bytes as f64 * 1e-6);
    Ok(json!({
        "seconds": seconds,
        "sent": sent_by_topic,
        "recorded": recorded,
        "lost": lost,
        "worst_lag_ms": sent["worst_lag_ms"],
        "stream_said": stream,
        "views_used": used,
        "views_left_out": left_out,
        "faults": faults.summary(),
        "processor_s_per_s": cpu,
        "memory_mb": {
            "after_10_s": megabytes(10),
            "half_way": megabytes(samples.len() / 2),
            "end_of_stream": megabytes(samples.len().saturating_sub(1)),
            "largest": samples.iter().max().map(|bytes| *bytes as f64 * 1e-6),
        },
        "file_mb": std::fs::metadata(&file)?.len() as f64 * 1e-6,
    }))
}

/// Messages of a file by topic.
fn recorded(path: &Path) -> Result<BTreeMap<String, u64>> {
    let content = std::fs::read(path)?;
    let summary = mcap::Summary::read(&content)?.context("the file has no index")?;
    let counts = summary.stats.context("the file counts nothing")?.channel_message_counts;
    let named =
        summary.channels.iter().map(|(id, channel)| (channel.topic.clone(), counts.get(id).copied().unwrap_or(0)));
    Ok(named.collect())
}
