//! `/healthz`: whether the work proceeds. That a socket answers says nothing about it.

use super::limits::seconds;
use super::server::Shared;
use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use semascan_protocol::{Phase, Progress};
use serde::Serialize;
use std::time::Duration;

/// What is answered.
#[derive(Debug, PartialEq, Serialize)]
struct Health {
    healthy: bool,
    /// `waiting`, `running`, `stalled`, `finished` or `failed`.
    state: &'static str,
    /// The inspection; absent while there is none.
    #[serde(skip_serializing_if = "String::is_empty")]
    inspection: String,
    /// Seconds since it did something; absent while nothing runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds_since_progress: Option<f64>,
    views_done: u32,
    views_rejected: u32,
    /// Absent where it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    views_expected: Option<u32>,
    points: u64,
    viewers: usize,
    /// Why it failed, or what there is to say.
    #[serde(skip_serializing_if = "String::is_empty")]
    message: String,
}

/// 200 where the inspection proceeds, is over, or none was begun; 503 where it failed or has stopped moving.
pub(super) async fn health(State(shared): State<Shared>) -> Response {
    let (progress, inspection, still) = shared.live.standing();
    let stall = seconds(shared.limits.stall_s);
    let health = Health { inspection, viewers: shared.connections.viewers(), ..judge(progress, still, stall) };
    let status = if health.healthy { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, [(header::CACHE_CONTROL, "no-store")], Json(health)).into_response()
}

/// What is to be said of an inspection that stands at `progress` and did nothing for `still`.
fn judge(progress: Progress, still: Duration, stall: Duration) -> Health {
    let (healthy, state) = match progress.phase() {
        Phase::Unspecified | Phase::Waiting => (true, "waiting"),
        Phase::Running if still > stall => (false, "stalled"),
        Phase::Running => (true, "running"),
        Phase::Finished => (true, "finished"),
        Phase::Failed => (false, "failed"),
    };
    let runs = progress.phase() == Phase::Running;
    Health {
        healthy,
        state,
        inspection: String::new(),
        seconds_since_progress: runs.then(|| (still.as_secs_f64() * 10.0).round() / 10.0),
        views_done: progress.views_done,
        views_rejected: progress.views_rejected,
        views_expected: Some(progress.views_expected).filter(|n| *n > 0),
        points: progress.points,
        viewers: 0,
        message: progress.message,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_and_a_dead_inspection_are_not_healthy() {
        let at = |phase: Phase, still: u64| {
            let progress = Progress { phase: phase.into(), message: "why".into(), ..Progress::default() };
            let health = judge(progress, Duration::from_secs(still), Duration::from_secs(60));
            (health.healthy, health.state, health.seconds_since_progress)
        };
        assert_eq!(at(Phase::Waiting, 1000), (true, "waiting", None));
        assert_eq!(at(Phase::Running, 59), (true, "running", Some(59.0)));
        assert_eq!(at(Phase::Running, 61), (false, "stalled", Some(61.0)));
        assert_eq!(at(Phase::Finished, 1000), (true, "finished", None));
        assert_eq!(at(Phase::Failed, 0), (false, "failed", None));
    }
}
