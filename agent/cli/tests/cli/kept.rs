//! `--data DIR`: inspections that are killed while they are kept lose no view that was acknowledged, are continued by the
//! next start, and come to the model of an inspection that was never cut off.

use crate::{semascan, stderr, without_generation};
use semascan_captures::CaptureReader;
use semascan_inspection::ports::{Catalogue, InspectionFilter, InspectionRow, InspectionState};
use semascan_model::record::Outcome;
use semascan_store::data::DataFolder;
use semascan_store::read_inspection;
use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How many inspections are killed, where the variable does not say it.
const KILLS: u32 = 6;
const COUNT: &str = "SEMASCAN_TEST_KILLS";
const MOTOR: &str = "virtual:starter-motor?seed=3&views=4&size=128x96&cell=4";

fn inspect(source: &str, data: &Path, more: &[&str]) -> std::process::Output {
    semascan(&[&["inspect", source, "--data", data.to_str().expect("UTF-8")], more].concat())
}

/// Views come slowly enough that most inspections are killed in the middle.
const PACE: [&str; 2] = ["--pace", "0.25"];

/// The only inspection in a data folder.
fn only(data: &Path) -> (InspectionRow, DataFolder) {
    let folder = DataFolder::open_beside(data).expect("a data folder");
    let mut rows = folder.catalogue().inspections(&InspectionFilter::default()).expect("reads");
    assert_eq!(rows.len(), 1, "{rows:?}");
    (rows.remove(0), folder)
}

/// Bytes of the model that an inspection came to, but for the line that is another one in every run.
fn model(folder: &Path) -> Vec<u8> {
    without_generation(fs::read(folder.join("cloud.ply")).expect("a cloud"))
}

fn whole_views(path: &Path) -> u32 {
    let Ok(mut reader) = CaptureReader::open(path) else { return 0 };
    std::iter::from_fn(|| reader.next_view()).filter(Result::is_ok).count() as u32
}

/// Starts an inspection, and waits until it keeps views or has ended: how long it takes to start depends on the machine.
fn begun(data: &Path) -> Child {
    let mut child = Command::new(env!("CARGO_BIN_EXE_semascan"))
        .args(["inspect", MOTOR, "-v", "--data", data.to_str().expect("UTF-8")])
        .args(PACE)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("starts");
    let is_kept = || fs::read_dir(data.join("captures")).is_ok_and(|mut files| files.next().is_some());
    while !is_kept() && child.try_wait().expect("a process").is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

/// Kills an inspection `life` after it began; returns the views that it had acknowledged: one line each on stderr.
fn killed(data: &Path, life: Duration) -> u32 {
    let mut child = begun(data);
    let lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let acknowledged = std::thread::spawn(move || {
        let lines = lines.map_while(Result::ok);
        lines.filter(|line| line.contains("view ") && line.contains("points more")).count() as u32
    });
    std::thread::sleep(life);
    child.kill().expect("killed");
    child.wait().expect("gone");
    acknowledged.join().expect("read")
}

/// Puts the beginning of a record behind the files that are written, as a write that was cut off by a loss of power leaves it.
fn truncate_last_writes(data: &Path, capture: &Path) {
    for path in [capture.to_owned(), data.join("semascan.db-wal")] {
        let Ok(bytes) = fs::read(&path) else { continue };
        let half = bytes.get(8..bytes.len().min(5000)).unwrap_or_default();
        OpenOptions::new().append(true).open(&path).and_then(|mut file| file.write_all(half)).expect("writes");
    }
}

#[test]
fn killed_inspections_lose_no_acknowledged_view_and_come_to_the_same_model() {
    let kills = std::env::var(COUNT).map_or(KILLS, |count| count.parse().expect("a number of kills"));
    let root = tempfile::tempdir().expect("temporary folder");
    let reference = root.path().join("reference");
    let begin = Instant::now();
    let first = begun(&reference);
    let started = begin.elapsed();
    let first = first.wait_with_output().expect("ends");
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let whole = begin.elapsed() - started;
    let (row, folder) = only(&reference);
    assert_eq!((row.state, row.views), (InspectionState::Finished, 4));
    let expected = model(&folder.result_path(row.id));
    let moments = (1..=kills).map(|k| (f64::from(k) * 0.618_033_988_749_895).fract());
    let (mut nothing, mut continued, mut finished, mut views) = (0, 0, 0, 0);
    for (kill, moment) in moments.enumerate() {
        let data = root.path().join(format!("killed-{kill}"));
        let acknowledged = killed(&data, whole.mul_f64(1.02 * moment));
        let before = DataFolder::open_beside(&data).ok().and_then(|folder| {
            folder.catalogue().inspections(&InspectionFilter::default()).expect("the database is whole").pop()
        });
        let Some(row) = before else {
            assert_eq!(acknowledged, 0, "kill {kill}");
            nothing += 1;
            let _ = fs::remove_dir_all(&data);
            continue;
        };
        views += acknowledged;
        let capture: PathBuf = data.join("captures").join(format!("{}.mcap", row.id));
        assert!(row.views >= acknowledged, "kill {kill}: {} rows of {acknowledged} acknowledged views", row.views);
        assert!(whole_views(&capture) >= row.views, "kill {kill}: a committed view is not captured");
        if row.state == InspectionState::Running {
            if kill % 2 == 1 {
                truncate_last_writes(&data, &capture);
                assert!(whole_views(&capture) >= row.views, "kill {kill}");
            }
            if kill % 3 == 0 {
                // Its continuation is killed too.
                let more = killed(&data, whole.mul_f64(0.7 * moment));
                let (between, _) = only(&data);
                assert!(between.views >= row.views.max(more), "kill {kill}: a view was lost by the second kill");
                assert!(whole_views(&capture) >= between.views, "kill {kill}");
                views += more;
            }
            let again = inspect(MOTOR, &data, &PACE);
            assert_eq!(again.status.code(), Some(0), "kill {kill}: {}", stderr(&again));
            continued += 1;
        } else {
            finished += 1;
        }
        let (after, folder) = only(&data);
        assert_eq!((after.id, after.began), (row.id, row.began), "kill {kill}: it is the same inspection");
        assert_eq!((after.state, after.views), (InspectionState::Finished, 4), "kill {kill}");
        let saved = read_inspection(&folder.result_path(row.id)).expect("whole");
        assert_eq!((saved.record.id, saved.record.outcome), (row.id, Outcome::Finished));
        assert!(model(&folder.result_path(row.id)) == expected, "kill {kill}: another model");
        let verified = folder.verify().expect("reads");
        assert_eq!(verified.faults, [], "kill {kill}");
        let history = folder.catalogue().events(row.id, 0, u32::MAX).expect("reads");
        assert!(history.iter().zip(0..).all(|(event, place)| event.sequence == place), "kill {kill}: a gap");
        drop(folder);
        let _ = fs::remove_dir_all(&data);
    }
    eprintln!(
        "{kills} inspections of {:.1} s killed in {:.0} s: {nothing} had not begun, {continued} were continued, {finished} \
         were finished; {views} acknowledged views, 0 lost",
        whole.as_secs_f64(),
        begin.elapsed().as_secs_f64()
    );
    assert!(continued > kills / 4 && views > 0, "the kills came too early or too late to test anything");
}

#[test]
fn a_capture_is_inspected_again_to_the_same_model_on_one_and_two_threads() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("data");
    let first = inspect(MOTOR, &data, &[]);
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let (row, folder) = only(&data);
    let expected = model(&folder.result_path(row.id));
    let capture = folder.capture_path(row.id);
    for threads in ["1", "2"] {
        let out = root.path().join(threads);
        let (capture, target) = (capture.to_str().expect("UTF-8"), out.to_str().expect("UTF-8"));
        let again = semascan(&["inspect", capture, "--out", target, "--threads", threads]);
        assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
        assert!(model(&out) == expected, "{threads} threads: another model");
        let truth = read_inspection(&out).expect("whole").record.truth;
        assert!(truth.is_some(), "the capture knows the truth");
    }
    // Other settings, another model.
    let out = root.path().join("coarse");
    let coarse = ["--out", out.to_str().expect("UTF-8"), "--voxel", "3"];
    let again = semascan(&[&["inspect", capture.to_str().expect("UTF-8")], coarse.as_slice()].concat());
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    assert!(model(&out) != expected);
}

#[test]
fn an_inspection_whose_source_is_another_one_now_is_closed_as_interrupted() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("data");
    // A capture is a source that can change between two starts.
    let source = root.path().join("source");
    assert_eq!(inspect(MOTOR, &source, &[]).status.code(), Some(0));
    let (row, folder) = only(&source);
    let path = root.path().join("x.mcap");
    fs::copy(folder.capture_path(row.id), &path).expect("copied");
    let uri = path.to_str().expect("UTF-8");
    let whole = inspect(uri, &data, &[]);
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    // As if it had been killed before it ended.
    let (row, folder) = only(&data);
    folder.catalogue().close(row.id, row.began, InspectionState::Running, None).expect("set");
    drop(folder);
    let other = root.path().join("other");
    assert_eq!(inspect(&MOTOR.replace("seed=3", "seed=4"), &other, &[]).status.code(), Some(0));
    let (another, folder) = only(&other);
    fs::copy(folder.capture_path(another.id), &path).expect("copied");
    let again = inspect(uri, &data, &[]);
    assert_eq!(again.status.code(), Some(1), "{}", stderr(&again));
    let (closed, folder) = only(&data);
    assert_eq!(closed.state, InspectionState::Interrupted);
    let reason = closed.reason.expect("a reason");
    assert!(reason.contains("view 0 of the source is not the one that was recorded"), "{reason}");
    assert_eq!(folder.verify().expect("reads").faults, []);
}

#[test]
fn verify_names_what_is_damaged_backup_is_whole_and_gc_leaves_held_ones() {
    let root = tempfile::tempdir().expect("temporary folder");
    let data = root.path().join("data");
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    for seed in [3, 4] {
        let uri = MOTOR.replace("seed=3", &format!("seed={seed}")).replace("views=4", "views=2");
        let made = inspect(&uri, &data, &[]);
        assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    }
    assert_eq!(semascan(&["verify", &text(&data)]).status.code(), Some(0));
    let copy = root.path().join("copy");
    let backup = semascan(&["backup", &text(&data), "--out", &text(&copy)]);
    assert_eq!(backup.status.code(), Some(0), "{}", stderr(&backup));
    let verified = semascan(&["verify", &text(&copy)]);
    assert_eq!(verified.status.code(), Some(0), "{}", stderr(&verified));
    assert_eq!(semascan(&["backup", &text(&data), "--out", &text(&copy)]).status.code(), Some(2), "not into another");
    // One byte of one file, and a file that is gone.
    let rows = DataFolder::open_beside(&copy).expect("opens");
    let ids: Vec<_> =
        rows.catalogue().inspections(&InspectionFilter::default()).expect("reads").into_iter().map(|r| r.id).collect();
    let damaged = rows.capture_path(ids[0]);
    let mut bytes = fs::read(&damaged).expect("reads");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, bytes).expect("writes");
    let gone = rows.result_path(ids[1]).join("mesh.ply");
    fs::remove_file(&gone).expect("removed");
    let verified = semascan(&["verify", &text(&copy)]);
    let said = stderr(&verified);
    assert_eq!(verified.status.code(), Some(1), "{said}");
    assert!(said.contains(&text(&damaged)) && said.contains(&format!("{}: is missing", text(&gone))), "{said}");
    // All are over the limit; the held one stays.
    let held = ids[1].to_string();
    let older = semascan(&["gc", &text(&data), "--older-than", "1"]);
    assert_eq!(older.status.code(), Some(0), "{}", stderr(&older));
    assert_eq!(
        DataFolder::open_beside(&data)
            .expect("opens")
            .catalogue()
            .inspections(&InspectionFilter::default())
            .expect("reads")
            .len(),
        2
    );
    let folder = DataFolder::open(&data).expect("opens");
    folder.catalogue().hold(ids[1], true).expect("held");
    let everything = semascan_store::data::Retention { age: None, bytes: Some(0) };
    let removed = folder.collect(&everything, jiff::Timestamp::now(), false).expect("removed");
    assert_eq!(removed.iter().map(|one| one.id).collect::<Vec<_>>(), [ids[0]]);
    assert!(!folder.capture_path(ids[0]).exists() && !folder.result_path(ids[0]).exists());
    assert!(folder.capture_path(ids[1]).exists());
    assert_eq!(folder.verify().expect("reads").faults, []);
    drop(folder);
    let unknown = semascan(&["gc", &text(&data), "--release", &held.replace(&held[..4], "ffff")]);
    assert_eq!(unknown.status.code(), Some(2), "{}", stderr(&unknown));
    assert_eq!(semascan(&["gc", &text(&root.path().join("none"))]).status.code(), Some(2));
    assert!(!root.path().join("none").exists());
}
