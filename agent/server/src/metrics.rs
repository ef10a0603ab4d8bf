//! `/metrics`: what the agent has done and what it holds, in the text format of OpenMetrics, which Prometheus reads.
//!
//! Counters count from the start of the process. What is known elsewhere (connections, how the inspection stands) is read when
//! it is asked for.
//!
//! The agent's own address answers it to who may read it; a listener of its own, where one is asked for, to everybody who reaches
//! that: scrapers need no token then.

use super::client_log::Kind;
use super::connections::Doing;
use super::server::Shared;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderValue, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Router, middleware};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::{ConstGauge, Gauge};
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};
use semascan_inspection::event::{EventKind, StageStatus};
use semascan_model::record::Outcome;
use semascan_protocol::Phase;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tower_service::Service;

/// Connections to the listener of metrics at once; more are ended at once.
const SCRAPERS: usize = 8;
/// Time for one of them.
const SCRAPE: Duration = Duration::from_secs(10);
/// Bytes that the head of a request may have.
const HEAD: usize = 8 << 10;
/// Pause after the system had no connection to give.
const EXHAUSTED: Duration = Duration::from_millis(100);

/// What `/metrics` answers.
const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// Upper bounds of the times of stages in seconds.
const STAGE_SECONDS: [f64; 12] = [0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0];

const ACCEPTED: &str = "accepted";
const LEFT_OUT: &str = "left_out";
const FINISHED: &str = "finished";
const STOPPED: &str = "stopped";
const FAILED: &str = "failed";

/// One label and its value.
type Label = [(&'static str, String); 1];

/// What is counted while it happens. Clones are the same.
#[derive(Clone, Debug)]
pub(super) struct Metrics {
    /// Views that are through, by what became of them.
    views: Family<Label, Counter>,
    /// Inspections that are over, by how they ended.
    inspections: Family<Label, Counter>,
    /// Times of stages.
    stages: Family<Label, Histogram>,
    /// Revisions of chunks that a viewer was not sent, because newer ones came first.
    superseded: Counter,
    /// Requests that were answered, by the status of the answer.
    requests: Family<Label, Counter>,
}

impl Default for Metrics {
    fn default() -> Self {
        let metrics = Self {
            views: Family::default(),
            inspections: Family::default(),
            stages: Family::new_with_constructor(|| Histogram::new(STAGE_SECONDS)),
            superseded: Counter::default(),
            requests: Family::default(),
        };
        // What has not happened yet is 0, not unknown.
        for result in [ACCEPTED, LEFT_OUT] {
            drop(metrics.views.get_or_create(&[("result", result.to_owned())]));
        }
        for outcome in [FINISHED, STOPPED, FAILED] {
            drop(metrics.inspections.get_or_create(&[("outcome", outcome.to_owned())]));
        }
        metrics
    }
}

impl Metrics {
    /// Something happened in the inspection.
    pub(super) fn happened(&self, kind: &EventKind) {
        match kind {
            EventKind::Stage { stage, status: StageStatus::Finished { seconds }, .. } => {
                self.stages.get_or_create(&[("stage", stage.name().to_owned())]).observe(*seconds);
            }
            EventKind::ViewFinished { record, .. } => {
                let result = if record.accepted { ACCEPTED } else { LEFT_OUT };
                self.views.get_or_create(&[("result", result.to_owned())]).inc();
            }
            EventKind::Ended { outcome } => {
                let outcome = match outcome {
                    // One that ended does not run.
                    Outcome::Running => return,
                    Outcome::Finished => FINISHED,
                    Outcome::Stopped => STOPPED,
                    Outcome::Failed { .. } => FAILED,
                };
                self.inspections.get_or_create(&[("outcome", outcome.to_owned())]).inc();
            }
            _ => {}
        }
    }

    /// `revisions` of chunks were replaced before a viewer was sent them.
    pub(super) fn superseded(&self, revisions: u64) {
        self.superseded.inc_by(revisions);
    }

    #[cfg(test)]
    pub(super) fn superseded_so_far(&self) -> u64 {
        self.superseded.get()
    }

    /// A request was answered with `status`.
    pub(super) fn answered(&self, status: StatusCode) {
        self.requests.get_or_create(&[("status", status.as_str().to_owned())]).inc();
    }
}

/// `GET /metrics`.
pub(super) async fn metrics(State(shared): State<Shared>) -> Response {
    let mut text = String::new();
    match encode(&mut text, &registry(&shared, shared.unready().await.is_none())) {
        Ok(()) => ([(header::CONTENT_TYPE, CONTENT_TYPE), (header::CACHE_CONTROL, "no-store")], text).into_response(),
        Err(error) => {
            tracing::error!("metrics could not be written: {error}");
            StatusCode::INTERNAL_SERVER_ERROR.into_response()
        }
    }
}

/// Answers `/metrics` and nothing else on `listener`, whoever asks.
pub(super) async fn listen(listener: TcpListener, shared: Shared) {
    let places = Arc::new(Semaphore::new(SCRAPERS));
    let unsniffed = |mut response: Response| async move {
        response.headers_mut().insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
        response
    };
    let router =
        Router::new().route("/metrics", get(metrics)).layer(middleware::map_response(unsniffed)).with_state(shared);
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(EXHAUSTED).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else { continue };
        let router = router.clone();
        tokio::spawn(async move {
            let service = service_fn(move |request: Request<Incoming>| router.clone().call(request.map(Body::new)));
            let served = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(SCRAPE)
                .max_buf_size(HEAD)
                .serve_connection(TokioIo::new(stream), service);
            // Who is late, or speaks no HTTP, is ended.
            let _ = timeout(SCRAPE, served).await;
            drop(place);
        });
    }
}

/// Everything that is known at this moment.
fn registry(shared: &Shared, is_ready: bool) -> Registry {
    let Metrics { views, inspections, stages, superseded, requests } = shared.live.metrics().clone();
    let mut registry = Registry::with_prefix("semascan");
    registry.register("build", "The program", Info::new([("version", env!("CARGO_PKG_VERSION"))]));
    registry.register("views", "Views that are through, by what became of them", views);
    registry.register("inspections", "Inspections that are over, by how they ended", inspections);
    registry.register_with_unit("stage", "Times of the stages of views", Unit::Seconds, stages);
    registry.register(
        "superseded_revisions",
        "Revisions of chunks that a viewer was not sent, because newer ones came first",
        superseded,
    );
    registry.register("requests", "Requests that were answered, by status", requests);

    let connections = Family::<Label, Gauge>::default();
    for doing in Doing::ALL {
        let count = i64::try_from(shared.connections.count(doing)).unwrap_or(i64::MAX);
        connections.get_or_create(&[("doing", doing.name().to_owned())]).set(count);
    }
    registry.register("connections", "Connections by what they are doing; viewing are viewers", connections);
    let refusals = Family::<Label, Counter>::default();
    for kind in Kind::REFUSALS {
        refusals.get_or_create(&[("of", kind.name().to_owned())]).inc_by(shared.log.count(kind));
    }
    registry.register("refusals", "What was refused", refusals);
    let traffic = shared.connections.traffic();
    let bytes = |count: &std::sync::atomic::AtomicU64| ConstCounter::new(count.load(Ordering::Relaxed));
    registry.register_with_unit("received", "Received from clients", Unit::Bytes, bytes(&traffic.received));
    registry.register_with_unit("sent", "Sent to clients", Unit::Bytes, bytes(&traffic.sent));

    let (progress, _, still) = shared.live.standing();
    let runs = progress.phase() == Phase::Running;
    let totals = shared.live.totals();
    registry.register("running", "Whether an inspection runs", ConstGauge::new(i64::from(runs)));
    let still = if runs { still.as_secs_f64() } else { 0.0 };
    registry.register_with_unit(
        "without_progress",
        "Since the running inspection did something",
        Unit::Seconds,
        ConstGauge::new(still),
    );
    registry.register("ready", "Whether /readyz answers 200", ConstGauge::new(i64::from(is_ready)));
    registry.register(
        "model_points",
        "Points of the model that is shown",
        ConstGauge::new(i64::try_from(totals.points).unwrap_or(i64::MAX)),
    );
    registry.register_with_unit(
        "model",
        "Size of the model that is shown, as it is sent",
        Unit::Bytes,
        ConstGauge::new(i64::try_from(totals.snapshot_bytes).unwrap_or(i64::MAX)),
    );
    registry
}
