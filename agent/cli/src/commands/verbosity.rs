//! How much a command says on stderr, and how: `-q` and `-v`, else `RUST_LOG`; `--log-format`.

use clap::{ArgAction, Args, ValueEnum};
use tracing_subscriber::filter::{LevelFilter, Targets};

/// How much is said.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct Verbosity {
    /// Say less: warnings and errors only, no progress and no summary; -qq errors only
    #[arg(short, long, action = ArgAction::Count, global = true, conflicts_with = "verbose")]
    quiet: u8,
    /// Say more: what is looked for where, and every view; -vv everything
    #[arg(short, long, action = ArgAction::Count, global = true)]
    verbose: u8,
    /// How the log is written on stderr
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t, global = true)]
    log_format: LogFormat,
}

/// How the log is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LogFormat {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object a line, with the inspection that it belongs to.
    Json,
}

impl Verbosity {
    /// Whether progress and summaries are left out. What a command was asked for is said all the same.
    pub(crate) fn is_quiet(self) -> bool {
        self.quiet > 0
    }

    /// Whether the log is JSON.
    pub(crate) fn is_json(self) -> bool {
        self.log_format == LogFormat::Json
    }

    /// What is logged; where nothing is said, as `variable` has it (`RUST_LOG`: `info`, or `semascan_server=debug,warn`), and
    /// `info` where that is unset or cannot be read.
    pub(crate) fn log_levels(self, variable: Option<&str>) -> Targets {
        let all = |level| Targets::new().with_default(level);
        match (self.quiet, self.verbose) {
            (0, 0) => variable.and_then(|levels| levels.parse().ok()).unwrap_or_else(|| all(LevelFilter::INFO)),
            (0, 1) => all(LevelFilter::INFO).with_target("semascan", LevelFilter::DEBUG),
            (0, _) => all(LevelFilter::DEBUG).with_target("semascan", LevelFilter::TRACE),
            (1, _) => all(LevelFilter::WARN),
            _ => all(LevelFilter::ERROR),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::filter::LevelFilter as Level;

    #[test]
    fn arguments_win_over_the_variable() {
        let largest = |quiet, verbose, variable| {
            let levels = Verbosity { quiet, verbose, ..Verbosity::default() }.log_levels(variable);
            [Level::ERROR, Level::WARN, Level::INFO, Level::DEBUG, Level::TRACE]
                .into_iter()
                .rfind(|level| level.into_level().is_some_and(|level| levels.would_enable("semascan_cli", &level)))
        };
        assert_eq!(largest(0, 0, None), Some(Level::INFO));
        assert_eq!(largest(0, 0, Some("debug")), Some(Level::DEBUG));
        assert_eq!(largest(0, 0, Some("semascan=loudly")), Some(Level::INFO));
        assert_eq!(largest(1, 0, Some("debug")), Some(Level::WARN));
        assert_eq!(largest(3, 0, None), Some(Level::ERROR));
        assert_eq!(largest(0, 1, Some("error")), Some(Level::DEBUG));
        assert_eq!(largest(0, 2, None), Some(Level::TRACE));
    }
}
