//! The command line of the edge agent: see `semascan --help`.
//!
//! Exit codes: 0 done, 1 the work failed, 2 the call was wrong. People's text goes to stderr, `--json` to stdout.
//!
//! The viewer's files come with the binary: so all of this compiles while the viewer is being built.

mod commands;

use clap::Parser;
use semascan_server::EmbeddedFiles;
use std::process::ExitCode;

/// Does what the command line says; `viewer` holds the viewer's files.
pub fn run(viewer: EmbeddedFiles) -> ExitCode {
    let cli = commands::Cli::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env()
                .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("info")),
        )
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
