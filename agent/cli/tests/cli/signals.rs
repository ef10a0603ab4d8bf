//! SIGINT and SIGTERM in every stage: exit code and record agree, and the end comes in time.
#![cfg(unix)]

use crate::{MOTOR, semascan, stderr};
use semascan_model::record::{InspectionRecord, Outcome};
use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// The drain of 5 s, and what a loaded machine adds to it.
const LONGEST_END: Duration = Duration::from_secs(30);

fn outcome(folder: &Path) -> Option<Outcome> {
    let text = std::fs::read_to_string(folder.join("inspection.json")).ok()?;
    Some(InspectionRecord::from_json(&text).expect("a whole record").outcome)
}

fn signal(process: u32, name: &str) {
    let sent = Command::new("kill").args([name, &process.to_string()]).status().expect("kill is there");
    assert!(sent.success());
}

fn start(args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(args).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("starts")
}

fn ended(mut child: Child) -> ExitStatus {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status;
        }
        if begin.elapsed() > LONGEST_END {
            let _ = child.kill();
            panic!("it did not end within {LONGEST_END:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// 128 and the number of the signal, whether the program says so or, before it began, the system.
fn code(status: ExitStatus) -> i32 {
    status.code().or(status.signal().map(|number| 128 + number)).expect("one of both")
}

#[test]
fn a_signal_at_any_instant_ends_an_inspection_as_its_record_says() {
    let dir = tempfile::tempdir().expect("temporary folder");
    // The pace gives the views their time however fast the machine is; opening, refining and writing come before and after.
    let inspect = ["inspect", "virtual:starter-motor?seed=3&views=8&size=320x240&cell=2.5", "--pace", "0.3", "--out"];
    let begin = Instant::now();
    let whole = semascan(&[&inspect[..], &[dir.path().join("whole").to_str().expect("UTF-8")]].concat());
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    let time = begin.elapsed();
    const INSTANTS: u32 = 7;
    let mut seen = [0; 3];
    for i in 0..INSTANTS {
        let out = dir.path().join(format!("out-{i}"));
        let child = start(&[&inspect[..], &[out.to_str().expect("UTF-8")]].concat());
        let (name, expected) = if i % 2 == 0 { ("-INT", 130) } else { ("-TERM", 143) };
        std::thread::sleep(time * i / INSTANTS);
        // A child that has ended and was not waited for can still be sent a signal.
        signal(child.id(), name);
        let code = code(ended(child));
        match outcome(&out) {
            None => {
                assert_eq!(code, expected, "instant {i}: before there was a folder");
                seen[0] += 1;
            }
            Some(Outcome::Stopped) => {
                assert_eq!(code, expected, "instant {i}");
                seen[1] += 1;
            }
            Some(Outcome::Finished) => {
                assert_eq!(code, 0, "instant {i}: it was finished");
                seen[2] += 1;
            }
            Some(other) => panic!("instant {i}: code {code} and {other:?}"),
        }
    }
    let [before, stopped, finished] = seen;
    eprintln!("{INSTANTS} signals: {before} before the folder, {stopped} stopped, {finished} finished");
    assert!(stopped >= 3, "{seen:?}");
}

/// What an inspection with `-vv` says when it comes to a stage, and whether it can still be stopped then: later it may be
/// finished before the signal is looked at.
const STAGES: [(&str, bool); 11] = [
    ("view 0: acquire begins", true),
    ("view 0: segment begins", true),
    ("view 0: register begins", true),
    ("view 0: fuse begins", true),
    ("view 5: acquire begins", true),
    ("view 11: fuse begins", false),
    ("poses refined", false),
    ("meshed and measured", false),
    ("compared with the pictures", false),
    ("compared with the truth", false),
    ("is written to", false),
];

#[test]
fn a_signal_in_every_stage_ends_an_inspection_as_its_record_says() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let source = "virtual:starter-motor?seed=3&views=12&size=160x120&cell=2.5";
    for (stage, (marker, stops)) in STAGES.into_iter().enumerate() {
        // Either signal goes the same way.
        let (name, expected) = [("-INT", 130), ("-TERM", 143)][stage % 2];
        let out = dir.path().join(format!("out{stage}{name}"));
        let mut child = start(&["inspect", source, "-vv", "--out", out.to_str().expect("UTF-8")]);
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
        assert!(lines.any(|line| line.contains(marker)), "{marker}: it never came to that");
        signal(child.id(), name);
        // Nobody may wait for who reads its words.
        let words = std::thread::spawn(move || lines.collect::<Vec<_>>());
        let code = code(ended(child));
        let words = words.join().expect("its words").join("\n");
        let stated = outcome(&out).unwrap_or_else(|| panic!("{marker}, {name}: no record: {words}"));
        let agrees = match stated {
            Outcome::Stopped => code == expected,
            Outcome::Finished => code == 0 && !stops,
            _ => false,
        };
        assert!(agrees, "{marker}, {name}: code {code}, record {stated:?}: {words}");
        // The set is whole, whatever it holds.
        semascan_store::read_inspection(&out).unwrap_or_else(|error| panic!("{marker}, {name}: {error}"));
    }
}

#[test]
fn a_signal_ends_every_other_command_at_once_and_leaves_nothing_half_written() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let made = semascan(&["inspect", MOTOR, "--out", &path("motor")]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let (cloud, truth) = (path("motor/cloud.ply"), path("motor/truth.ply"));
    let (set, turn, report, exported) = (path("set"), path("turn"), path("report.json"), path("exported"));
    let calls: [&[&str]; 6] = [
        &["synth", "--parts", "500", "--views", "20", "--seed", "1", "--out", &set],
        &["synth", "--turntable", "can", "--parts", "50", "--views", "72", "--seed", "1", "--out", &turn],
        &["tables", "P0", "--table", "1", "--seeds", "1000", "--out", &report],
        &["evaluate", &cloud, &truth, "--align", "--samples", "10000000"],
        &["evaluate", "--photometric", &path("motor"), "virtual:starter-motor?seed=3&views=3&size=4096x3072&cell=0.5"],
        &["export", &cloud, "--format", "obj,stl,glb", "--voxel", "0.2", "--smooth", "1000", "--out", &exported],
    ];
    for call in calls {
        for (name, expected) in [("-INT", 130), ("-TERM", 143)] {
            let child = start(call);
            std::thread::sleep(Duration::from_millis(400));
            signal(child.id(), name);
            let begin = Instant::now();
            let code = code(ended(child));
            // A command that was done by then cannot be stopped any more.
            assert!(code == expected || (code == 0 && call[0] == "export"), "{call:?}, {name}: {code}");
            assert!(begin.elapsed() < Duration::from_secs(2), "{call:?}, {name}: {:?}", begin.elapsed());
        }
    }
    assert!(!Path::new(&report).exists(), "a report of tables that were not computed");
    // Parts of a set are whole or not there.
    let parts = std::fs::read_dir(&set).expect("begun").map(|entry| entry.expect("readable").path());
    for part in
        parts.filter(|part| part.is_dir() && !part.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.')))
    {
        assert_eq!(std::fs::read_dir(part.join("rgb")).expect("pictures").count(), 20, "{}", part.display());
    }
}

#[test]
fn a_second_signal_ends_at_once_and_commands_without_a_record_too() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let set = dir.path().join("set");
    let args = ["synth", "--parts", "500", "--views", "20", "--seed", "1", "--out", set.to_str().expect("UTF-8")];
    let child = start(&args);
    while !set.exists() {
        std::thread::sleep(Duration::from_millis(10));
    }
    signal(child.id(), "-TERM");
    let begin = Instant::now();
    assert_eq!(ended(child).code(), Some(143));
    assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
}

/// An agent, and the lines that it says.
fn served(args: &[&str]) -> (Child, std::io::Lines<BufReader<std::process::ChildStderr>>) {
    let mut child = start(&[args, &["--port", "0"]].concat());
    let lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    (child, lines)
}

#[test]
fn a_server_ends_with_0_if_nothing_was_cut_off_and_with_the_signal_otherwise() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    for (name, source, word, expected, stated) in [
        ("done", MOTOR, "written to", 0, Outcome::Finished),
        ("cut", "virtual:starter-motor?seed=3&views=200&size=64x48&cell=4", "listening", 143, Outcome::Stopped),
    ] {
        let out = path(name);
        let (child, mut lines) = served(&["serve", "--source", source, "--pace", "0.2", "--out", &out]);
        assert!(lines.any(|line| line.is_ok_and(|line| line.contains(word))), "{name}: it never said {word}");
        // It listens before its source is open; the record is there when the inspection begins.
        while outcome(Path::new(&out)).is_none() {
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(Duration::from_millis(500));
        signal(child.id(), "-TERM");
        assert_eq!(ended(child).code(), Some(expected), "{name}");
        assert_eq!(outcome(Path::new(&out)), Some(stated), "{name}");
    }
    let (child, mut lines) = served(&["serve", &path("done")]);
    assert!(lines.any(|line| line.is_ok_and(|line| line.contains("points"))));
    signal(child.id(), "-INT");
    assert_eq!(ended(child).code(), Some(0));
}

#[test]
fn process_1_of_a_container_obeys_too() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("out");
    let source = "virtual:starter-motor?seed=3&views=200&size=64x48&cell=4";
    let unshare = ["--pid", "--fork", "--kill-child", env!("CARGO_BIN_EXE_semascan")];
    if !Command::new("unshare").args(["--pid", "--fork", "true"]).status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: this user may make no process namespaces");
        return;
    }
    let child = Command::new("unshare")
        .args(unshare)
        .args(["inspect", source, "--pace", "0.2", "--out", out.to_str().expect("UTF-8")])
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let begin = Instant::now();
    while outcome(&out).is_none() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no record");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(1500));
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let first: u32 = std::fs::read_to_string(children).expect("Linux").trim().parse().expect("one child");
    signal(first, "-TERM");
    assert_eq!(ended(child).code(), Some(143));
    assert_eq!(outcome(&out), Some(Outcome::Stopped));
}
