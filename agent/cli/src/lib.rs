//! The command line of the edge agent: see `semascan --help`.
//!
//! Exit codes: 0 done, 1 the work failed, 2 the call was wrong, 130 and 143 it was cut off by SIGINT or SIGTERM. People's text goes to stderr, `--json` to stdout.
//!
//! The viewer's files come with the binary, so that tests and benches do not wait for the viewer.

mod commands;

use clap::Parser;
use semascan_server::EmbeddedFiles;
use std::process::ExitCode;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Does what the command line says; `viewer` holds the viewer's files.
pub fn run(viewer: EmbeddedFiles) -> ExitCode {
    let cli = commands::Cli::parse();
    tracing_subscriber::registry()
        .with(tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_target(false).without_time())
        .with(log_levels())
        .init();
    match cli.run(viewer) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let (code, error) = failure.into_parts();
            tracing::error!("{}", commands::format_error(&error));
            ExitCode::from(code)
        }
    }
}

/// `RUST_LOG` as in `info` or `semascan_server=debug,warn`; `info` where it is unset or cannot be read.
fn log_levels() -> Targets {
    let info = Targets::new().with_default(LevelFilter::INFO);
    std::env::var("RUST_LOG").ok().and_then(|levels| levels.parse().ok()).unwrap_or(info)
}
