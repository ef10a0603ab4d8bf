//! The binary `semascan`: the commands, and the viewer's files that they serve.

use rust_embed::RustEmbed;
use std::process::ExitCode;

/// What `cargo xtask web` built; a binary made before that has none and says so.
#[derive(RustEmbed)]
#[folder = "../../www/dist"]
#[allow_missing = true]
struct Viewer;

fn main() -> ExitCode {
    semascan_cli::run(|name| Viewer::get(name).map(|file| file.data))
}
