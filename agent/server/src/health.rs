//! `/healthz`: whether the work proceeds. That a socket answers says nothing about it. `/readyz`: whether there could be work.
//!
//! Both answer everybody; who has no login where one is needed is told the state and no more.

use super::limits::seconds;
use super::server::Shared;
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
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
    #[serde(skip_serializing_if = "Option::is_none")]
    views_done: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    views_rejected: Option<u32>,
    /// Absent where it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    views_expected: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    viewers: Option<usize>,
    /// Why it failed, or what there is to say.
    #[serde(skip_serializing_if = "String::is_empty")]
    message: String,
}

impl Health {
    /// What everybody may know of it.
    fn for_everybody(self) -> Self {
        Self {
            inspection: String::new(),
            seconds_since_progress: None,
            views_done: None,
            views_rejected: None,
            views_expected: None,
            points: None,
            viewers: None,
            message: String::new(),
            ..self
        }
    }
}

/// 200 where the inspection proceeds, is over, or none was begun; 503 where it failed or has stopped moving.
pub(super) async fn health(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    let (progress, inspection, still) = shared.live.standing();
    let stall = seconds(shared.limits.stall_s);
    let health = Health { inspection, viewers: Some(shared.connections.viewers()), ..judge(progress, still, stall) };
    let status = if health.healthy { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    let health = if shared.entry.identify(&headers).await.is_ok() { health } else { health.for_everybody() };
    (status, [(header::CACHE_CONTROL, "no-store")], Json(health)).into_response()
}

/// What `/readyz` answers.
#[derive(Debug, Serialize)]
struct Readiness {
    ready: bool,
    /// Why not.
    #[serde(skip_serializing_if = "String::is_empty")]
    reason: String,
}

/// 200 where the agent could work; 503 while it starts or ends, and where what it keeps cannot be written.
pub(super) async fn readiness(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    let unready = shared.unready().await;
    let status = if unready.is_none() { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    let is_known = shared.entry.identify(&headers).await.is_ok();
    let readiness = Readiness { ready: unready.is_none(), reason: unready.filter(|_| is_known).unwrap_or_default() };
    (status, [(header::CACHE_CONTROL, "no-store")], Json(readiness)).into_response()
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
        views_done: Some(progress.views_done),
        views_rejected: Some(progress.views_rejected),
        views_expected: Some(progress.views_expected).filter(|n| *n > 0),
        points: Some(progress.points),
        viewers: None,
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
