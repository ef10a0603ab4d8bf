//! How much of the agent its clients may take, as arguments; `[serve.limits]` of `cell.toml` says the same.

use clap::Args;
use semascan_server::Limits;

/// Limits that differ from those of `cell.toml`, which differ from the defaults.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Limits for clients")]
pub(crate) struct LimitArgs {
    /// Connections at once; past that an idle one gives way, or the new one is refused [default: 1024]
    #[arg(long, value_name = "N")]
    max_connections: Option<usize>,
    /// Connections at once from one address [default: 512]
    #[arg(long, value_name = "N")]
    max_connections_per_address: Option<usize>,
    /// Connections at once that have opened the stream and not said what they want [default: 256]
    #[arg(long, value_name = "N")]
    max_hellos: Option<usize>,
    /// Requests that one address may make at once [default: 5000]
    #[arg(long, value_name = "N")]
    request_burst: Option<usize>,
    /// Requests a second that one address may make after that [default: 500]
    #[arg(long, value_name = "N")]
    request_rate: Option<f64>,
    /// Largest message from a viewer [default: 524288]
    #[arg(long, value_name = "BYTES")]
    max_message: Option<usize>,
    /// Time for a viewer to say what it wants [default: 10]
    #[arg(long, value_name = "SECONDS")]
    hello_time: Option<f64>,
    /// Time for the head of a request, and for an idle connection [default: 10]
    #[arg(long, value_name = "SECONDS")]
    request_time: Option<f64>,
    /// Time to take a piece of a file; the whole within 15 times that [default: 20]
    #[arg(long, value_name = "SECONDS")]
    answer_time: Option<f64>,
    /// Time between two pings to a viewer [default: 20]
    #[arg(long, value_name = "SECONDS")]
    ping_time: Option<f64>,
    /// Time for a viewer to answer a ping [default: 30]
    #[arg(long, value_name = "SECONDS")]
    pong_time: Option<f64>,
    /// Time for a viewer to take a message; a slower one is closed and told so [default: 30]
    #[arg(long, value_name = "SECONDS")]
    slow_time: Option<f64>,
    /// Time without a request after which a login ends; a page that is open counts as one [default: 3600]
    #[arg(long, value_name = "SECONDS")]
    session_idle_time: Option<f64>,
    /// Time after which a login ends in any case [default: 43200]
    #[arg(long, value_name = "SECONDS")]
    session_time: Option<f64>,
    /// Time that a login at an identity provider may take [default: 600]
    #[arg(long, value_name = "SECONDS")]
    sign_in_time: Option<f64>,
    /// Time without progress after which /healthz says that the inspection is dead [default: 300]
    #[arg(long, value_name = "SECONDS")]
    stall_time: Option<f64>,
}

impl LimitArgs {
    /// `limits`, and what was given.
    pub(super) fn apply(&self, limits: Limits) -> Limits {
        Limits {
            connections: self.max_connections.unwrap_or(limits.connections),
            connections_per_address: self.max_connections_per_address.unwrap_or(limits.connections_per_address),
            hellos: self.max_hellos.unwrap_or(limits.hellos),
            request_burst: self.request_burst.unwrap_or(limits.request_burst),
            requests_per_s: self.request_rate.unwrap_or(limits.requests_per_s),
            message_bytes: self.max_message.unwrap_or(limits.message_bytes),
            hello_s: self.hello_time.unwrap_or(limits.hello_s),
            request_s: self.request_time.unwrap_or(limits.request_s),
            answer_s: self.answer_time.unwrap_or(limits.answer_s),
            ping_s: self.ping_time.unwrap_or(limits.ping_s),
            pong_s: self.pong_time.unwrap_or(limits.pong_s),
            slow_s: self.slow_time.unwrap_or(limits.slow_s),
            session_idle_s: self.session_idle_time.unwrap_or(limits.session_idle_s),
            session_s: self.session_time.unwrap_or(limits.session_s),
            sign_in_s: self.sign_in_time.unwrap_or(limits.sign_in_s),
            stall_s: self.stall_time.unwrap_or(limits.stall_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, FromArgMatches, Parser};

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        limits: LimitArgs,
    }

    #[test]
    fn arguments_win_over_the_file_and_the_help_says_the_defaults() {
        let of_file = Limits { slow_s: 5.0, hellos: 7, ..Limits::default() };
        let matches = Cli::command().get_matches_from(["x", "--slow-time", "2", "--max-connections", "9"]);
        let limits = Cli::from_arg_matches(&matches).expect("parses").limits.apply(of_file.clone());
        assert_eq!(limits, Limits { slow_s: 2.0, connections: 9, ..of_file });
        let help = Cli::command().render_long_help().to_string();
        let defaults = Limits::default();
        for (flag, value) in [
            ("--max-connections <", defaults.connections as f64),
            ("--max-connections-per-address", defaults.connections_per_address as f64),
            ("--max-hellos", defaults.hellos as f64),
            ("--request-burst", defaults.request_burst as f64),
            ("--request-rate", defaults.requests_per_s),
            ("--max-message", defaults.message_bytes as f64),
            ("--hello-time", defaults.hello_s),
            ("--request-time", defaults.request_s),
            ("--answer-time", defaults.answer_s),
            ("--ping-time", defaults.ping_s),
            ("--pong-time", defaults.pong_s),
            ("--slow-time", defaults.slow_s),
            ("--session-idle-time", defaults.session_idle_s),
            ("--session-time", defaults.session_s),
            ("--sign-in-time", defaults.sign_in_s),
            ("--stall-time", defaults.stall_s),
        ] {
            let described = help.split("\n\n").find(|paragraph| paragraph.contains(flag)).expect(flag);
            assert!(described.contains(&format!("[default: {value}]")), "{described}");
        }
    }
}
