//! What keeps a result from being written: a full disk, a folder that cannot be written, few file descriptors. The full disk
//! is a limit on the size of files, which the system sets for one process.
#![cfg(target_os = "linux")]

use crate::{MOTOR, semascan, stderr};
use semascan_model::record::{InspectionRecord, Outcome};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn record(folder: &Path) -> InspectionRecord {
    let text = std::fs::read_to_string(folder.join("inspection.json")).expect("a record");
    InspectionRecord::from_json(&text).expect("a whole record")
}

/// The command in a shell that runs `limits` first; the signal of a file that is too large is ignored, so that writing fails
/// as it does on a full disk.
fn limited(limits: &str, args: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("trap '' XFSZ; {limits}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_semascan")]);
    command.args(args);
    command
}

#[test]
fn a_full_disk_is_a_failure_that_leaves_no_half_set() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("out");
    // 64 kB hold the record, and no cloud.
    let full = limited("ulimit -S -f 128", &["inspect", MOTOR, "--out", out.to_str().expect("UTF-8")]).output();
    let full: Output = full.expect("a shell");
    assert_eq!(full.status.code(), Some(1), "{}", stderr(&full));
    let text = stderr(&full);
    assert!(text.contains("could not be saved") && text.contains("cloud.ply") && text.contains("next try"), "{text}");
    let said = record(&out);
    assert!(matches!(&said.outcome, Outcome::Failed { reason } if reason.contains("saved")), "{:?}", said.outcome);
    assert_eq!(said.points, 0);
    let names = |folder: &Path| std::fs::read_dir(folder).expect("reads").count();
    assert_eq!((names(&out), names(dir.path())), (1, 1), "the record alone, and nothing beside the folder");
    let export = ["export", out.to_str().expect("UTF-8"), "--format", "obj"];
    assert_eq!(semascan(&export).status.code(), Some(2), "there is no model");
}

#[test]
fn a_server_keeps_the_model_and_saves_it_when_there_is_room_again() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("out");
    let args = ["serve", "--source", MOTOR, "--port", "0", "--out", out.to_str().expect("UTF-8")];
    let mut child = limited("ulimit -S -f 128", &args).stderr(Stdio::piped()).spawn().expect("a shell");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    let kept = lines.by_ref().find(|line| line.contains("could not be saved")).expect("said");
    assert!(kept.contains("kept in memory"), "{kept}");
    assert_eq!(record(&out).outcome, Outcome::Running);
    let room = Command::new("prlimit").args(["--pid", &child.id().to_string(), "--fsize=unlimited"]).status();
    assert!(room.is_ok_and(|status| status.success()), "prlimit is there");
    let begin = Instant::now();
    assert!(lines.any(|line| line.contains("written to")), "it was never saved");
    eprintln!("saved {:.1} s after there was room", begin.elapsed().as_secs_f64());
    assert_eq!(record(&out).outcome, Outcome::Finished);
    assert!(out.join("cloud.ply").is_file());
    assert!(Command::new("kill").arg(child.id().to_string()).status().expect("kill is there").success());
    assert_eq!(child.wait().expect("ends").code(), Some(0));
}

#[test]
fn sixty_four_file_descriptors_are_enough() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("out");
    let args = ["inspect", MOTOR, "--view-clouds", "--out", out.to_str().expect("UTF-8")];
    let few = limited("ulimit -n 64", &args).output().expect("a shell");
    assert_eq!(few.status.code(), Some(0), "{}", stderr(&few));
    assert_eq!(record(&out).outcome, Outcome::Finished);
}

#[test]
fn a_folder_that_cannot_be_written_is_noticed_before_the_work() {
    /// A user without rights: root may write everywhere.
    const NOBODY: u32 = 65534;
    let dir = tempfile::tempdir().expect("temporary folder");
    let mode = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    let (locked, program) = (dir.path().join("locked"), dir.path().join("semascan"));
    std::fs::create_dir(&locked).expect("made");
    std::fs::copy(env!("CARGO_BIN_EXE_semascan"), &program).expect("copied");
    mode(dir.path(), 0o755).expect("set");
    mode(&locked, 0o555).expect("set");
    // Long enough that it would show if it were inspected first.
    let source = "virtual:starter-motor?seed=3&views=200&size=640x480&cell=2.5";
    for out in [locked.clone(), locked.join("new")] {
        let mut command = Command::new(&program);
        command.args(["inspect", source, "--out", out.to_str().expect("UTF-8")]).current_dir("/");
        if std::fs::File::create(locked.join("test")).is_ok() {
            std::fs::remove_file(locked.join("test")).expect("removed");
            command.uid(NOBODY);
        }
        let begin = Instant::now();
        let refused = command.output().expect("starts");
        assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
        assert!(stderr(&refused).contains("locked"), "{}", stderr(&refused));
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    }
    assert_eq!(std::fs::read_dir(&locked).expect("reads").count(), 0);
    // The test's folder is removed by who made it.
    mode(&locked, 0o755).expect("set");
}
