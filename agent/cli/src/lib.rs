//! The command line of the edge agent: see `semascan --help`.
//!
//! Exit codes: 0 done, 1 the work failed, 2 the call was wrong, 130 and 143 it was cut off by SIGINT or SIGTERM. People's text goes to stderr, `--json` to stdout.
//!
//! The viewer's files come with the binary, so that tests and benches do not wait for the viewer.

mod commands;
mod stderr;
mod stdout;

use clap::Parser;
use semascan_server::EmbeddedFiles;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Mutex;
use stderr::Stderr;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::fmt;
use tracing_subscriber::layer::{Layer, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

/// Does what the command line says; `viewer` holds the viewer's files.
pub fn run(viewer: EmbeddedFiles) -> ExitCode {
    let cli = match commands::Cli::try_parse() {
        Ok(cli) => cli,
        Err(answer) => return say(&answer),
    };
    let text = || {
        fmt::layer()
            .with_writer(Mutex::new(Stderr::default()))
            .with_ansi(colored())
            .with_target(false)
            .log_internal_errors(false)
            // Which inspection a line belongs to is for machines: people watch one.
            .with_filter(filter_fn(|metadata| metadata.is_event()))
    };
    let json = || {
        fmt::layer()
            .json()
            .flatten_event(true)
            .with_span_list(false)
            .with_writer(Mutex::new(Stderr::default()))
            .log_internal_errors(false)
    };
    let is_json = cli.verbosity.is_json();
    tracing_subscriber::registry()
        .with(is_json.then(json))
        .with((!is_json).then(text))
        .with(cli.verbosity.log_levels(std::env::var("RUST_LOG").ok().as_deref()))
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

/// Prints help, version, or what is wrong with the call. Help that could not be printed is no success.
fn say(answer: &clap::Error) -> ExitCode {
    let printed = answer.print().and_then(|()| std::io::stdout().flush());
    let code = u8::try_from(answer.exit_code()).unwrap_or(2);
    ExitCode::from(if printed.is_err() { code.max(1) } else { code })
}

/// Whether the log has colours: on a terminal, and where nobody asked for none (`NO_COLOR`).
fn colored() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
