//! The binary as a script sees it: files, exit codes, messages.

mod evaluate;
mod export;
mod inspect;
mod log;
mod outcome;
mod synth;
mod tables;

use std::process::{Command, Output};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";

fn semascan(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_semascan")).args(args).output().expect("the binary starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
