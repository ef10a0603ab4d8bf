//! What a process takes of the machine, as Linux says it.

use anyhow::{Context, Result};

/// Memory of process `id` that is resident, in bytes.
///
/// # Errors
/// If the system does not say it: there is no such process, or this is not Linux.
pub fn resident_bytes(id: u32) -> Result<u64> {
    status_kilobytes(id, "VmRSS:").map(|kilobytes| kilobytes << 10)
}

/// The most memory that process `id` ever had resident, in bytes.
///
/// # Errors
/// As [`resident_bytes`].
pub fn peak_resident_bytes(id: u32) -> Result<u64> {
    status_kilobytes(id, "VmHWM:").map(|kilobytes| kilobytes << 10)
}

/// Processor time that process `id` took so far, in seconds, at Linux's 100 ticks a second.
///
/// # Errors
/// If the system does not say it.
pub fn processor_seconds(id: u32) -> Result<f64> {
    let path = format!("/proc/{id}/stat");
    let stat = std::fs::read_to_string(&path).with_context(|| path.clone())?;
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok()).with_context(|| path.clone());
    Ok((ticks(11)? + ticks(12)?) / 100.0)
}

/// Sockets that process `id` has open.
///
/// # Errors
/// If its folder of open files cannot be read.
pub fn sockets(id: u32) -> Result<usize> {
    let folder = format!("/proc/{id}/fd");
    let files = std::fs::read_dir(&folder).with_context(|| folder.clone())?;
    // A file that was closed meanwhile has no link any more.
    let links = files.flatten().filter_map(|file| std::fs::read_link(file.path()).ok());
    Ok(links.filter(|link| link.to_string_lossy().starts_with("socket:")).count())
}

fn status_kilobytes(id: u32, field: &str) -> Result<u64> {
    let path = format!("/proc/{id}/status");
    let status = std::fs::read_to_string(&path).with_context(|| path.clone())?;
    let value = status.lines().find_map(|line| line.strip_prefix(field)).with_context(|| format!("{path}: {field}"))?;
    value.trim().trim_end_matches(" kB").parse().with_context(|| format!("{path}: {field}{value}"))
}
