//! The log costs nobody the work, and a bad setting is named.

use crate::{MOTOR, semascan, stderr};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn inspect(out: &std::path::Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(["inspect", MOTOR, "--overwrite", "--out"]).arg(out).env("RUST_LOG", "debug").stdin(Stdio::null());
    command
}

#[cfg(unix)]
#[test]
fn closed_full_and_unread_logs_stop_nothing() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let model = folder.path().join("cloud.ply");
    // Closed: nobody reads what is written any more.
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let status = inspect(folder.path()).stderr(writer).status().expect("starts");
    assert_eq!(status.code(), Some(0), "closed");
    assert!(std::fs::remove_file(&model).is_ok());
    // Full: every write fails.
    if let Ok(full) = std::fs::File::options().write(true).open("/dev/full") {
        let status = inspect(folder.path()).stderr(full).status().expect("starts");
        assert_eq!(status.code(), Some(0), "full");
        assert!(std::fs::remove_file(&model).is_ok());
    }
    // Unread: a write to a pipe that is full already would wait for ever.
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    let capacity = 64 << 10;
    std::io::Write::write_all(&mut writer, &vec![b'x'; capacity]).expect("what a pipe holds");
    let mut child = inspect(folder.path()).stderr(writer).spawn().expect("starts");
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("waits") {
            break Some(status);
        }
        if begun.elapsed() > Duration::from_secs(100) {
            child.kill().expect("ends it");
            child.wait().expect("waits");
            break None;
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    drop(reader);
    assert_eq!(status.and_then(|s| s.code()), Some(0), "unread");
    assert!(model.exists());
}

#[test]
fn lines_have_time_stamps_and_no_colours_into_a_file() {
    let output = semascan(&["inspect", "virtual:nothing", "--out", "/nonexistent/out"]);
    let text = stderr(&output);
    let line = text.lines().find(|line| line.contains("ERROR")).expect("an error");
    let stamp = line.split_whitespace().next().unwrap_or_default();
    assert!(stamp.len() > 20 && stamp.starts_with("20") && stamp.contains('T') && stamp.ends_with('Z'), "{line}");
    assert!(!text.contains('\u{1b}'), "{text:?}");
}

#[test]
fn settings_of_the_server_that_cannot_be_kept_are_named() {
    for (arguments, word) in [
        (["--web-dir", "/nonexistent/web"], "/nonexistent/web"),
        (["--web-dir", "/dev/null"], "/dev/null"),
        (["--slow-time", "-1"], "-1"),
        (["--slow-time", "nan"], "slow_s"),
        (["--max-connections", "0"], "connections"),
        (["--max-message", "99999999"], "message_bytes"),
        (["--allow-origin", "office"], "office"),
        (["--allow-agent", "http://office"], "http://office"),
    ] {
        let output = semascan(&["serve", "--port", "0", arguments[0], arguments[1]]);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(word), "{arguments:?}: {}", stderr(&output));
    }
}
