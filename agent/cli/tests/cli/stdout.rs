//! What is printed where nobody takes it: people's text may be lost, what was asked for on stdout may not without a word.
#![cfg(unix)]

use crate::{MOTOR, semascan, stderr};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

/// As small as can be: commands are called some hundred times.
const SMALL: &str = "virtual:starter-motor?seed=3&views=2&size=96x72&cell=5";

/// Where the output of a command goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Taker {
    /// A file.
    File,
    /// A pipe that nobody reads any more.
    ClosedPipe,
    /// A disk without room.
    FullDisk,
    /// Nothing: the descriptor is closed.
    Nobody,
}

impl Taker {
    fn stdio(self) -> Stdio {
        match self {
            Self::File | Self::Nobody => tempfile::tempfile().expect("a file").into(),
            Self::ClosedPipe => std::io::pipe().expect("a pipe").1.into(),
            Self::FullDisk => File::options().write(true).open("/dev/full").expect("/dev/full").into(),
        }
    }
}

/// The exit code of the command with `out` and `err` for its stdout and stderr.
fn code(folder: &Path, args: &[&str], out: Taker, err: Taker) -> Option<i32> {
    let closed = |taker, number| if taker == Taker::Nobody { format!("exec {number}>&-; ") } else { String::new() };
    // A shell, because a descriptor that is closed cannot be handed on otherwise.
    let script = format!("{}{}exec \"$0\" \"$@\"", closed(out, 1), closed(err, 2));
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_semascan")]).args(args).current_dir(folder);
    command.stdin(Stdio::null()).stdout(out.stdio()).stderr(err.stdio());
    command.status().expect("a shell").code()
}

#[test]
fn lost_text_for_people_changes_no_exit_code_and_lost_output_is_a_failure() {
    let dir = tempfile::tempdir().expect("temporary folder");
    for (source, name) in [(SMALL, "motor"), (MOTOR, "aligned")] {
        let made = semascan(&["inspect", source, "--out", dir.path().join(name).to_str().expect("UTF-8")]);
        assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    }
    std::fs::write(dir.path().join("truth.json"), "{}").expect("written");
    std::fs::write(dir.path().join("cell.toml"), "").expect("written");
    // Each with its exit code, and whether it prints anything on stdout.
    let calls: &[(&[&str], i32, bool)] = &[
        (&["inspect", SMALL, "--out", "new", "--overwrite", "--json"], 0, true),
        (&["inspect", SMALL, "--out", "new", "--overwrite"], 0, false),
        (&["inspect", SMALL, "--out", "motor"], 2, false),
        (&["evaluate", "motor/cloud.ply", "motor/truth.ply"], 0, false),
        (&["evaluate", "motor/cloud.ply", "motor/truth.ply", "--json"], 0, true),
        (&["evaluate", "--photometric", "motor", SMALL, "--json"], 0, true),
        (&["evaluate", "motor", "truth.json", "--json"], 1, false),
        (&["export", "motor", "--format", "obj,stl,glb"], 0, false),
        (&["models", "--models", ".", "--json"], 0, true),
        (&["models", "--models", "."], 0, false),
        (&["config", "--sample"], 0, true),
        (&["config", "cell.toml"], 0, false),
        (&["completions", "bash"], 0, true),
        (&["completions", "fish"], 0, true),
        (&["schema"], 0, true),
        (
            &[
                "synth", "--out", "set", "--parts", "1", "--views", "1", "--seed", "1", "--size", "96x72", "--window",
                "64x48", "--json",
            ],
            0,
            true,
        ),
        (&["--help"], 0, true),
        (&["--version"], 0, true),
        (&["inspect", "--help"], 0, true),
        (&["inspect"], 2, false),
        (&["nonsense"], 2, false),
    ];
    for (args, expected, prints) in calls {
        assert_eq!(code(dir.path(), args, Taker::File, Taker::File), Some(*expected), "{args:?}");
        for taker in [Taker::ClosedPipe, Taker::FullDisk, Taker::Nobody] {
            let without_stderr = code(dir.path(), args, Taker::File, taker);
            assert_eq!(without_stderr, Some(*expected), "{args:?}, stderr {taker:?}");
        }
        let lost = if *prints { 1 } else { *expected };
        // A descriptor that the caller closed is one that it does not want: the system gives the bytes to nobody.
        for (out, err, expected) in [
            (Taker::ClosedPipe, Taker::File, lost),
            (Taker::FullDisk, Taker::FullDisk, lost),
            (Taker::Nobody, Taker::Nobody, *expected),
        ] {
            assert_eq!(code(dir.path(), args, out, err), Some(expected), "{args:?}, stdout {out:?}, stderr {err:?}");
        }
    }
    let aligned = ["evaluate", "aligned/cloud.ply", "aligned/truth.ply", "--align", "--samples", "20000"];
    assert_eq!(code(dir.path(), &aligned, Taker::File, Taker::ClosedPipe), Some(0));
    let mut full = Command::new(env!("CARGO_BIN_EXE_semascan"));
    let full = full.arg("schema").stdout(Taker::FullDisk.stdio()).output().expect("starts");
    assert!(stderr(&full).contains("stdout could not be written"), "{}", stderr(&full));
}
