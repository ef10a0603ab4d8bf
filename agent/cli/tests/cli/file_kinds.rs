//! What a path may lead to beside the file or folder that is meant: a pipe, a device, a socket. Every command says what it
//! found, with the code of a wrong call, and neither waits for a writer nor reads without end.
#![cfg(unix)]

use crate::ended;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A cell whose inspection takes a moment.
const CELL: &str = "virtual:starter-motor?seed=3&views=2&size=96x72&cell=4";
/// What is no file takes no time.
const LONGEST: Duration = Duration::from_secs(20);

/// Runs the binary in `folder`; its exit code and what it says.
fn run(folder: &Path, args: &[&str], library: Option<&str>) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(args).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    if let Some(library) = library {
        command.env("ORT_DYLIB_PATH", folder.join(library));
    }
    let output = ended(command.spawn().expect("starts"), LONGEST);
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// `path` in a call is what leads to no file; the rest is in order.
const WHERE_A_FILE_IS_MEANT: &[&[&str]] = &[
    &["evaluate", "path.ply", "good.obj"],
    &["evaluate", "good.obj", "path.ply"],
    &["evaluate", "good.obj", "path.json"],
    &["evaluate", "--photometric", "good.json", CELL, "--poses", "path"],
    &["export", "path.ply", "--format", "obj", "--out", "new"],
    &["inspect", CELL, "--out", "new", "--config", "path"],
    &["inspect", "virtual:mesh?path=path.ply", "--out", "new"],
    &["serve", "--port", "0", "--config", "path"],
    &["config", "path"],
    &["doctor", "--config", "path"],
    &["tables", "P0", "--quick", "--out", "path"],
];

const WHERE_A_FOLDER_IS_MEANT: &[&[&str]] = &[
    &["evaluate", "--photometric", "path", CELL],
    &["export", "path", "--format", "obj", "--out", "new"],
    &["export", "good.ply", "--format", "obj", "--out", "path"],
    &["inspect", "path", "--out", "new"],
    &["inspect", CELL, "--out", "path"],
    &["serve", "path", "--port", "0"],
    &["serve", "--port", "0", "--source", "path"],
    &["serve", "--port", "0", "--source", CELL, "--out", "path"],
    &["serve", "--port", "0", "--web-dir", "path"],
    &["models", "--models", "path"],
    &["models", "calibrate", "models/one", "--views", "path"],
    &["models", "calibrate", "models/one", "--views", CELL, "--outside", "path"],
    &["tables", "P0", "--quick", "--models", "path"],
    &["tables", "P1", "--quick", "--table", "3", "--ycb", "path"],
    &["synth", "--out", "path", "--parts", "1", "--views", "1", "--seed", "1"],
    &["synth", "--turntable", "can", "--out", "path", "--parts", "1", "--views", "2", "--seed", "1"],
];

#[test]
fn pipes_devices_and_sockets_are_named_by_every_command() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("good.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
    std::fs::write(at("good.ply"), ply).expect("written");
    std::fs::write(at("good.json"), "{\"views\": []}").expect("written");
    std::fs::create_dir_all(at("models/one")).expect("made");
    std::fs::write(at("models/one/model.toml"), "").expect("written");
    let mut sockets = Vec::new();
    for extension in ["", ".ply", ".json"] {
        assert!(Command::new("mkfifo").arg(at(&format!("pipe{extension}"))).status().expect("mkfifo").success());
        symlink("/dev/zero", at(&format!("device{extension}"))).expect("linked");
        sockets.push(UnixListener::bind(at(&format!("socket{extension}"))).expect("bound"));
        std::fs::create_dir(at(&format!("folder{extension}"))).expect("made");
    }
    let refused = |kind: &str, word: &str, call: &[&str]| {
        let args: Vec<String> = call.iter().map(|arg| arg.replace("path.", &format!("{kind}."))).collect();
        let args: Vec<&str> = args.iter().map(|arg| if *arg == "path" { kind } else { arg.as_str() }).collect();
        let (code, said) = run(dir.path(), &args, None);
        assert_eq!(code, Some(2), "{args:?}: {said}");
        let errors: Vec<&str> = said.lines().filter(|line| line.contains("ERROR")).collect();
        assert!(errors.len() == 1 && errors[0].contains(kind), "{args:?} is said by its name, once: {said}");
        assert!(errors[0].contains(word) || errors[0].contains("folder, and this is none"), "{args:?}: {said}");
    };
    for (kind, word) in [("pipe", "named pipe"), ("device", "device"), ("socket", "socket")] {
        for call in WHERE_A_FILE_IS_MEANT {
            refused(kind, word, call);
        }
        for call in WHERE_A_FOLDER_IS_MEANT {
            // What is to be written into is only said not to be a folder.
            let out = call.windows(2).any(|pair| pair == ["--out", "path"]) && call[0] != "synth";
            refused(kind, if out { "no folder" } else { word }, call);
        }
        let (code, said) = run(dir.path(), &["doctor"], Some(kind));
        assert!(code == Some(1) && said.contains(word), "{kind} as ONNX Runtime: {said}");
    }
    for call in WHERE_A_FILE_IS_MEANT.iter().filter(|call| call[0] != "export" && !call.contains(&"--poses")) {
        refused("folder", "is a folder", call);
    }
    for call in WHERE_A_FOLDER_IS_MEANT.iter().filter(|call| call[0] == "synth" || call.contains(&"--models")) {
        refused("good.obj", "is a file and not a folder", call);
    }
    assert!(!at("new").exists(), "nothing was made");
}
