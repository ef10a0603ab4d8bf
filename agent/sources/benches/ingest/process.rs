//! What this process has used, as Linux counts it.

use anyhow::{Context, Result};
use std::fs;

/// Ticks a second of the times in `/proc`: the same on every Linux of today.
const TICKS: f64 = 100.0;

/// What was used by now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Usage {
    pub(crate) processor_seconds: f64,
    pub(crate) resident_bytes: u64,
}

impl Usage {
    /// By now.
    pub(crate) fn now() -> Result<Self> {
        let stat = fs::read_to_string("/proc/self/stat").context("this bench counts on Linux alone")?;
        // The name of the program may have spaces and ends with a parenthesis.
        let (_, fields) = stat.rsplit_once(')').context("/proc/self/stat")?;
        let fields: Vec<&str> = fields.split_whitespace().collect();
        let ticks = |place: usize| fields.get(place).and_then(|n| n.parse::<f64>().ok());
        let (user, system) = ticks(11).zip(ticks(12)).context("/proc/self/stat")?;
        let status = fs::read_to_string("/proc/self/status")?;
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes = resident.and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok());
        let resident_bytes = kilobytes.context("/proc/self/status")? * 1024;
        Ok(Self { processor_seconds: (user + system) / TICKS, resident_bytes })
    }
}
