//! The binary as a script sees it: files, exit codes, messages.

mod access;
mod dataset;
mod evaluate;
mod export;
mod file_kinds;
mod first_steps;
mod full_disk;
#[cfg(target_os = "linux")]
mod hindered;
mod inspect;
mod judge;
mod kept;
mod kills;
mod log;
mod mutated;
mod outcome;
mod past;
mod report;
mod serving;
mod signals;
mod stdout;
mod synth;
mod tables;
mod texture;

use std::process::{Command, Output};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";

fn semascan(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_semascan")).args(args).output().expect("the binary starts")
}

/// The bytes of a PLY file without the line that is another one in every run.
fn without_generation(mut bytes: Vec<u8>) -> Vec<u8> {
    let key = b"comment generation ";
    let at = bytes.windows(key.len()).position(|w| w == key).expect("a generation");
    let end = at + bytes[at..].iter().position(|b| *b == b'\n').expect("a line");
    bytes.drain(at..=end);
    bytes
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
