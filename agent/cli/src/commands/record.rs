//! `semascan record ws://... OUT.mcap`: what a live source sends, as it comes.

use super::Failure;
use super::numbers;
use super::signals::{Signals, Work};
use anyhow::anyhow;
use clap::Args;
use semascan_inspection::StopSwitch;
use semascan_sources::live::{LiveAddress, record};
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `semascan record`.
#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// What to listen to: `ws://HOST:PORT`, a server of Foxglove's WebSocket protocol (foxglove_bridge of ROS, Foxglove's SDK)
    source: String,
    /// The file to write, which is not there yet. Foxglove opens it, and it can be inspected
    out: PathBuf,
    /// Record for so many seconds [default: until it is stopped, or nothing has come for 10 s (?silence_s=SECONDS)]
    #[arg(long, value_name = "SECONDS", value_parser = numbers::pause, allow_negative_numbers = true)]
    seconds: Option<f64>,
}

impl RecordArgs {
    pub(crate) fn run(self, signals: &Signals) -> Result<(), Failure> {
        if !LiveAddress::is_one(&self.source) {
            return Err(Failure::Call(anyhow!("{} is no address of a live source: ws://HOST:PORT", self.source)));
        }
        let address = LiveAddress::read(&self.source).map_err(|reason| Failure::Call(anyhow!("{reason}")))?;
        if self.out.try_exists().map_err(|error| anyhow!("{}: {error}", self.out.display()))? {
            return Err(Failure::Call(anyhow!("{} is there already", self.out.display())));
        }
        let stop = signals.begin(|| {
            let stop = StopSwitch::default();
            // What was written is on the disk to the last second.
            Ok::<_, Failure>((stop.clone(), Work { stop, too_late: Box::new(|| {}) }))
        })?;
        let limit = self.seconds.map(Duration::from_secs_f64);
        let recorded = record(&address, &self.out, limit, || stop.is_set())?;
        for (topic, count) in &recorded.messages {
            eprintln!("{count:>8}  {topic}");
        }
        eprintln!("{}: {}", self.out.display(), recorded.end);
        match recorded.messages.values().sum::<u64>() {
            0 => Err(Failure::Work(anyhow!("nothing was recorded"))),
            _ => Ok(()),
        }
    }
}
