//! The disk that inspections and recordings are written to: its room, and how fast it is.

use super::super::cell_section::CellSection;
use super::{Finding, Health};
use serde_json::json;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Bytes that are written to see how fast the disk is.
const WRITTEN: usize = 32 << 20;
/// Room below which an inspection may not fit, bytes.
const LEAST_ROOM: u64 = 2 << 30;
/// A disk writes at least so much more than comes.
const RESERVE: f64 = 2.0;
/// Hours that a recording should fit.
const HOURS: f64 = 1.0;

/// Looks at the disk; `stream` is how many bytes a second the source sends, where that is known.
pub(super) fn finding(cell: &CellSection, stream: Option<f64>) -> Finding {
    let what = "disk";
    let folder = nearest_folder(cell.data.as_deref().unwrap_or(Path::new(".")));
    let speed = match write_speed(&folder) {
        Ok(speed) => speed,
        Err(error) => {
            let text = format!("{}: cannot be written: {error}", folder.display());
            let mend =
                "give the user that semascan runs as the right to write there, or name another folder with cell.data";
            return Finding::wrong(what, Health::Failed, text, mend);
        }
    };
    let room = room(&folder);
    let gigabytes = room.map_or_else(|| "room unknown".to_owned(), |room| format!("{:.1} GB free", room as f64 * 1e-9));
    let text = format!("{}: {gigabytes}, writes {:.0} MB/s", folder.display(), speed * 1e-6);
    // What is recorded besides needs more.
    let recorded = stream.filter(|_| cell.camera.record.is_some());
    let hours = recorded.zip(room).map(|(stream, room)| room as f64 / stream / 3600.0);
    let details = json!({ "folder": folder, "free_bytes": room, "bytes_per_s": speed, "stream_bytes_per_s": stream });
    let found = if room.is_some_and(|room| room < LEAST_ROOM) {
        Finding::wrong(
            what,
            Health::Failed,
            text,
            "make room: `semascan gc` removes old inspections; or name another disk with cell.data",
        )
    } else if recorded.is_some_and(|stream| speed < RESERVE * stream) {
        let text = format!("{text}, and {:.0} MB/s come to be recorded", recorded.unwrap_or_default() * 1e-6);
        Finding::wrong(
            what,
            Health::Failed,
            text,
            "record to a faster disk, or let the camera send compressed pictures",
        )
    } else if let Some(hours) = hours.filter(|hours| *hours < HOURS) {
        let text = format!("{text}: a recording fits for {:.0} minutes", hours * 60.0);
        Finding::wrong(what, Health::Warning, text, "make room, or record to another disk")
    } else {
        Finding::ok(what, text)
    };
    Finding { details, ..found }
}

/// The folder itself, or the nearest above it that is there.
fn nearest_folder(folder: &Path) -> PathBuf {
    let there = folder.ancestors().find(|folder| folder.is_dir());
    there.filter(|there| !there.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned()
}

/// Bytes a second that reach the disk.
fn write_speed(folder: &Path) -> std::io::Result<f64> {
    let path = folder.join(format!(".semascan-doctor-{}", std::process::id()));
    let block = vec![0x5a; 1 << 20];
    let written = OpenOptions::new().write(true).create_new(true).open(&path).and_then(|mut file| {
        let began = Instant::now();
        for _ in 0..WRITTEN / block.len() {
            file.write_all(&block)?;
        }
        file.sync_all()?;
        Ok(WRITTEN as f64 / began.elapsed().as_secs_f64().max(1e-6))
    });
    // One that could not be made is not there.
    let _ = fs::remove_file(&path);
    written
}

/// Bytes that are free.
#[cfg(unix)]
fn room(folder: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(folder).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

/// It is not known here.
#[cfg(not(unix))]
fn room(_: &Path) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_is_slower_than_the_camera_fails_and_nothing_stays_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut cell = CellSection { data: Some(folder.path().join("data/new")), ..CellSection::default() };
        let found = finding(&cell, Some(1e15));
        assert_eq!(found.health, Health::Ok, "{found:?}");
        cell.camera.record = Some("run.mcap".into());
        let found = finding(&cell, Some(1e15));
        assert!(found.health == Health::Failed && found.mend.contains("faster"), "{found:?}");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }
}
