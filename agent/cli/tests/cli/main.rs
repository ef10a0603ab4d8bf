//! The binary as a script sees it: files, exit codes, messages.

mod access;
mod calibrate;
mod convert;
mod dataset;
mod doctor;
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
mod live;
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

use std::io::Read;
use std::process::{Child, Command, Output, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=160x120&cell=2.5";

/// No command of these tests works as long, on whatever machine: one that does hangs.
const LONGEST: Duration = Duration::from_secs(300);

fn semascan(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ended(command.spawn().expect("the binary starts"), LONGEST)
}

/// What `child` has written once it ends by itself.
///
/// # Panics
/// If it does not within `longest`; it is killed then.
fn ended(mut child: Child, longest: Duration) -> Output {
    let (stdout, stderr) = (read_all(child.stdout.take()), read_all(child.stderr.take()));
    let begun = Instant::now();
    let mut killed = false;
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        if begun.elapsed() > longest && !killed {
            child.kill().expect("ended");
            killed = true;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let [stdout, stderr] = [stdout, stderr].map(|read| read.join().expect("what it wrote"));
    let output = Output { status, stdout, stderr };
    assert!(!killed, "it did not end within {longest:?} and said: {}", self::stderr(&output));
    output
}

/// Reads a pipe to its end beside whatever else is done: a full one would stop its writer.
fn read_all(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            pipe.read_to_end(&mut bytes).expect("a pipe");
        }
        bytes
    })
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
