//! The server: the viewer's files, the stream at `/ws`, the same for Foxglove at `/foxglove`, the API below `/api/v1` and the other routes of `access/routes.rs`, over
//! HTTP or, with a certificate, HTTPS.

use super::access::{Access, CALLBACK, Entry, Identity, OpenError, ProviderSettingError, login, sign_in};
use super::api;
use super::client;
use super::client_log::{ClientLog, Excerpt, Kind};
use super::connections::{Connection, Connections, Place};
use super::foxglove;
use super::guard::{AccessRule, guard};
use super::health::{health, readiness};
use super::limits::{LimitError, Limits, seconds};
use super::live::LiveModel;
use super::metrics::{self, metrics};
use super::past::Past;
use super::plain_answer::{plain_answer, reason_of, say_and_close};
use super::replay::{Pace, Replays};
use super::request_rate::RequestRate;
use super::tls::Tls;
use super::transport::{Open, Transport};
use super::web::WebFiles;
use super::wire::{Wire, notice_vanished_peers};
use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Extension, Query, State};
use axum::http::{HeaderMap, Request, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use axum::{Router, middleware};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use semascan_foxglove::protocol::SUBPROTOCOLS;
use semascan_inspection::ports::PortError;
use semascan_model::InspectionId;
use semascan_protocol::{Phase, Pointer, ReviewChange, SUBPROTOCOL};
use std::collections::HashMap;
use std::future::Future;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::timeout;
use tower_service::Service;

/// Kernel buffer of a connection: what a slow client has in it cannot be replaced by newer revisions any more.
const SEND_BUFFER: u32 = 128 << 10;
/// Bytes that the head of a request may have, and that are held for it.
const REQUEST_HEAD: usize = 16 << 10;
/// Bytes read at once from a WebSocket; clients say little.
const READ_BUFFER: usize = 4 << 10;
/// How often connections are looked through for those that have to end.
const SWEEP: Duration = Duration::from_millis(500);
/// Pause after the system had no connection to give.
const EXHAUSTED: Duration = Duration::from_millis(100);
/// Time in which connections end in order when the server does: answers are finished, viewers told. A part of the 5 s in which
/// the process ends.
const DRAIN: Duration = Duration::from_secs(2);
/// Connections without a place that are told so at once; with more the answer may be lost.
const REFUSALS: usize = 16;
/// What is said to who does not speak TLS.
pub(super) const HTTPS_ONLY: &str = "this agent speaks HTTPS only: its address begins with https://";
/// What a TLS connection begins with: a record of a handshake (RFC 8446, section 5.1).
const HANDSHAKE: u8 = 22;
/// File descriptors that connections leave for everything else.
#[cfg(unix)]
const OTHER_FILES: u64 = 64;

/// How the agent is reached.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Address to listen on; port 0 picks a free one.
    pub address: SocketAddr,
    /// From which hosts and pages it may be talked to.
    pub access: AccessRule,
    /// Who is let in.
    pub entry: Entry,
    /// The certificate for HTTPS; without one it speaks plain HTTP.
    pub tls: Option<Arc<Tls>>,
    /// The viewer's files.
    pub files: WebFiles,
    /// How much of it clients may take.
    pub limits: Limits,
    /// A second address, at which `/metrics` alone is answered, to everybody who reaches it, without TLS.
    pub metrics: Option<SocketAddr>,
}

/// Why the server cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address cannot be had.
    #[error("cannot listen on {address}: {source}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// The underlying I/O error.
        source: std::io::Error,
    },
    /// The folder of the viewer's files is not one.
    #[error("{folder}: {reason}")]
    Files {
        /// The folder.
        folder: PathBuf,
        /// Why not.
        reason: String,
    },
    /// Others could reach it who must not, or nobody could.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Nobody would come back from the identity provider.
    #[error(transparent)]
    Provider(#[from] ProviderSettingError),
    /// The users cannot be read.
    #[error(transparent)]
    Accounts(#[from] PortError),
    /// A limit cannot be kept.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// An origin that is let in is none.
    #[error("{origin}: {reason}")]
    Origin {
        /// What was given.
        origin: String,
        /// Why it is none.
        reason: &'static str,
    },
}

/// A bound server.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    router: Router,
    shared: Shared,
    tls: Option<Arc<Tls>>,
    refusals: Arc<Semaphore>,
    metrics: Option<TcpListener>,
}

/// Marks a request that came without TLS to an agent that speaks it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposed;

/// What all requests share.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    pub(super) live: Arc<LiveModel>,
    pub(super) limits: Arc<Limits>,
    pub(super) log: Arc<ClientLog>,
    pub(super) connections: Arc<Connections>,
    pub(super) rate: Arc<RequestRate>,
    pub(super) access: Arc<AccessRule>,
    pub(super) entry: Arc<Access>,
    /// Whether all connections are encrypted.
    pub(super) secure: bool,
    /// What is kept of inspections; absent where the agent keeps nothing.
    pub(super) past: Option<Arc<Past>>,
    /// Past inspections that are streamed.
    pub(super) replays: Arc<Replays>,
    /// Turns of requests that read what is kept.
    pub(super) readers: Arc<Semaphore>,
    /// Turns of commands.
    pub(super) commands: Arc<Semaphore>,
    /// Places of clients of Foxglove's protocol.
    pub(super) foxglove: Arc<Semaphore>,
    files: Arc<WebFiles>,
}

impl Shared {
    /// What requests share that a test asks without a socket.
    #[cfg(test)]
    pub(super) fn for_tests(
        live: LiveModel,
        limits: Limits,
        connections: Arc<Connections>,
        entry: Access,
        secure: bool,
    ) -> Self {
        Self {
            live: Arc::new(live),
            rate: Arc::new(RequestRate::new(&limits)),
            limits: Arc::new(limits),
            log: Arc::default(),
            connections,
            access: Arc::default(),
            entry: Arc::new(entry),
            secure,
            past: None,
            replays: Arc::default(),
            readers: Arc::new(Semaphore::new(api::READERS)),
            commands: Arc::new(Semaphore::new(api::COMMANDS)),
            foxglove: Arc::new(Semaphore::new(foxglove::MOST_CLIENTS)),
            files: Arc::new(WebFiles::Embedded(|_| None)),
        }
    }

    /// Why the agent is not ready for work.
    pub(super) async fn unready(&self) -> Option<String> {
        if self.connections.is_ending() {
            return Some("the agent ends".to_owned());
        }
        let mut reason = self.live.unready();
        if reason.is_empty()
            && let Some(past) = self.past.clone()
        {
            let tried = tokio::task::spawn_blocking(move || past.obstacle()).await;
            reason = tried.unwrap_or_else(|error| format!("it cannot be said whether more can be kept: {error}"));
        }
        Some(reason).filter(|reason| !reason.is_empty())
    }

    /// Tells all viewers what somebody decided.
    pub(super) fn tell_review(&self, change: &ReviewChange) {
        self.live.review(change.clone());
        self.replays.tell_review(change);
    }

    /// Tells all who look at an inspection where somebody points on it; how many they are.
    pub(super) fn tell_pointer(&self, inspection: &str, pointer: &Pointer) -> u32 {
        self.live.point(inspection, pointer) + self.replays.tell_pointer(inspection, pointer)
    }
}

impl Server {
    /// Binds; nothing is answered before [`Server::run`].
    ///
    /// # Errors
    /// [`ServeError`] if the address is taken or not this machine's, a setting cannot be kept, or other machines could do what
    /// only users may.
    pub fn bind(config: &ServerConfig, live: Arc<LiveModel>) -> Result<Self, ServeError> {
        Self::bind_with_past(config, live, None)
    }

    /// As [`bind`](Self::bind), with the API to what is kept of inspections.
    ///
    /// # Errors
    /// As [`bind`](Self::bind).
    pub fn bind_with_past(
        config: &ServerConfig,
        live: Arc<LiveModel>,
        past: Option<Arc<Past>>,
    ) -> Result<Self, ServeError> {
        let ServerConfig { address, access, entry, tls, files, limits, metrics: scraped } = config.clone();
        limits.check()?;
        access.check_origins()?;
        files.check()?;
        entry.check(address, tls.is_some())?;
        if let Entry::Accounts { provider: Some(provider), .. } = &entry {
            provider.check(&access, tls.is_some())?;
        }
        let most = most_connections();
        if most < limits.connections {
            tracing::warn!("the limit of open files leaves {most} connections of {}", limits.connections);
        }
        let bind = |source| ServeError::Bind { address, source };
        let listener = listen(address).map_err(bind)?;
        let port = listener.local_addr().map_err(bind)?.port();
        let listen_to = |address| listen(address).map_err(|source| ServeError::Bind { address, source });
        let scraped = scraped.map(listen_to).transpose()?;
        let secure = tls.is_some();
        let shared = Shared {
            live,
            connections: Arc::new(Connections::new(&limits, most)),
            rate: Arc::new(RequestRate::new(&limits)),
            entry: Arc::new(Access::new(entry, &limits, secure, port)?),
            secure,
            limits: Arc::new(limits),
            log: Arc::default(),
            access: Arc::new(access),
            past,
            replays: Arc::default(),
            readers: Arc::new(Semaphore::new(api::READERS)),
            commands: Arc::new(Semaphore::new(api::COMMANDS)),
            foxglove: Arc::new(Semaphore::new(foxglove::MOST_CLIENTS)),
            files: Arc::new(files),
        };
        let refusals = Arc::new(Semaphore::new(REFUSALS));
        Ok(Self { listener, router: router(&shared), shared, tls, refusals, metrics: scraped })
    }

    /// The address that was bound.
    ///
    /// # Errors
    /// The underlying I/O error.
    pub fn local_address(&self) -> std::io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// The address at which metrics alone are answered, where there is one.
    ///
    /// # Errors
    /// The underlying I/O error.
    pub fn metrics_address(&self) -> std::io::Result<Option<SocketAddr>> {
        self.metrics.as_ref().map(TcpListener::local_addr).transpose()
    }

    /// Answers until `shutdown` completes. Then no connection is taken any more, answers are finished, and viewers are sent a
    /// Close frame (1001, going away); what has not ended 2 s later is cut off.
    pub async fn run(mut self, shutdown: impl Future<Output = ()> + Send + 'static) {
        let scraped = self.metrics.take();
        let scraped = async {
            match scraped {
                Some(listener) => metrics::listen(listener, self.shared.clone()).await,
                None => std::future::pending().await,
            }
        };
        let sweep = async {
            loop {
                tokio::time::sleep(SWEEP).await;
                self.shared.connections.sweep();
                self.shared.log.say_what_was_left_out();
                self.shared.entry.note_counts(false).await;
            }
        };
        let accept = async {
            loop {
                match self.listener.accept().await {
                    Ok((stream, peer)) => self.take(stream, peer.ip()),
                    // The peer went while it waited.
                    Err(error) if is_of_connection(error.kind()) => {}
                    Err(error) => {
                        self.shared
                            .log
                            .warn(Kind::ConnectionFailed, || format!("no connection could be taken: {error}"));
                        self.shared.connections.end_one();
                        tokio::time::sleep(EXHAUSTED).await;
                    }
                }
            }
        };
        tokio::select! {
            () = sweep => {}
            () = accept => {}
            () = scraped => {}
            () = shutdown => {}
        }
        drop(self.listener);
        self.shared.entry.note_counts(true).await;
        if timeout(DRAIN, self.shared.connections.end_in_order()).await.is_err() {
            tracing::debug!("connections are cut off: they did not end within {} s", DRAIN.as_secs());
        }
        self.shared.connections.end_all();
    }

    /// Serves a new connection on a task of its own, if there is a place.
    fn take(&self, stream: TcpStream, peer: IpAddr) {
        match self.shared.connections.admit(peer) {
            Ok(place) => {
                let (tls, router, shared) = (self.tls.clone(), self.router.clone(), self.shared.clone());
                tokio::spawn(converse(stream, place, tls, router, shared));
            }
            Err(reason) => {
                self.shared.log.warn(Kind::ConnectionRefused, || format!("connection of {peer} refused: {reason}"));
                let answer = plain_answer(StatusCode::SERVICE_UNAVAILABLE, reason);
                match Arc::clone(&self.refusals).try_acquire_owned() {
                    Ok(permit) => {
                        tokio::spawn(async move {
                            say_and_close(stream, &answer).await;
                            drop(permit);
                        });
                    }
                    // The buffer of a new connection takes it; what the client has sent by then may undo that.
                    Err(_) => drop(stream.try_write(answer.as_bytes())),
                }
            }
        }
    }
}

/// All routes; `access/routes.rs` says who may use them.
pub(super) fn router(shared: &Shared) -> Router {
    Router::new()
        .route("/ws", any(stream))
        .route("/foxglove", any(foxglove_stream))
        .route("/healthz", get(health))
        .route("/readyz", get(readiness))
        .route("/metrics", get(metrics))
        .route("/api/v1/login", get(sign_in::routes::ways).post(login::log_in))
        .route("/api/v1/oidc", post(sign_in::routes::begin))
        .route(CALLBACK, get(sign_in::routes::callback))
        .route("/api/v1/logout", post(login::log_out))
        .route("/api/v1/me", get(login::me))
        .merge(api::router())
        .fallback(file)
        .layer(middleware::from_fn_with_state(shared.clone(), guard))
        .with_state(shared.clone())
}

/// Answers the requests of one connection until it ends or becomes a WebSocket. What was no request is answered last.
async fn converse(stream: TcpStream, mut place: Place, tls: Option<Arc<Tls>>, router: Router, shared: Shared) {
    let connection = Arc::clone(&place.connection);
    if notice_vanished_peers(&stream).is_err() {
        return;
    }
    let wire = match &tls {
        None => stream.into(),
        Some(tls) => match shake_hands(stream, &mut place, tls, &shared).await {
            Some(wire) => wire,
            None => return,
        },
    };
    let is_exposed = tls.is_some() && matches!(wire, Wire::Plain(_));
    let (transport, remains) = Transport::new(wire, place);
    let Err(error) = answer(transport, Arc::clone(&connection), is_exposed, router, &shared).await else { return };
    tracing::debug!("a connection ended: {error}");
    let (open, kept_back) = remains.take();
    let late = error.is_timeout() && connection.has_begun_to_ask();
    let Some(status) = kept_back.or(late.then_some(StatusCode::REQUEST_TIMEOUT)) else { return };
    let reason = reason_of(status);
    shared.log.warn(Kind::RequestRefused, || format!("request refused: {reason}"));
    let Some(Open { wire, mut place }) = open else { return };
    let answer = plain_answer(status, reason);
    tokio::select! {
        () = say_and_close(wire, &answer) => {}
        () = std::future::poll_fn(|context| place.poll_ended(context)) => {}
    }
}

/// Does the handshake of TLS with who connected, in the time that a request has; `None` where it comes to nothing. Until it is
/// done the connection has moved nothing, so that it is among the first to be ended for others. Who asks on loopback without TLS is
/// let pass: the guard answers [`Exposed`] requests for health only.
async fn shake_hands(stream: TcpStream, place: &mut Place, tls: &Tls, shared: &Shared) -> Option<Wire> {
    let patience = seconds(shared.limits.request_s);
    let address = place.connection.address();
    let refused = |reason: &str| {
        shared.log.warn(Kind::ConnectionFailed, || format!("no TLS with {address}: {}", Excerpt(reason)))
    };
    let handshake = async {
        let mut first = [0];
        if stream.peek(&mut first).await? == 0 {
            return Ok(None);
        }
        if first == [HANDSHAKE] {
            return tls.acceptor().accept(stream).await.map(|stream| Some(Wire::from(stream)));
        }
        if stream.peer_addr()?.ip().to_canonical().is_loopback() {
            return Ok(Some(stream.into()));
        }
        say_and_close(stream, &plain_answer(StatusCode::BAD_REQUEST, HTTPS_ONLY)).await;
        Err(std::io::Error::new(ErrorKind::InvalidData, "the client does not speak TLS"))
    };
    let done = timeout(patience, handshake);
    let done = tokio::select! {
        done = done => done,
        () = std::future::poll_fn(|context| place.poll_ended(context)) => return None,
        () = shared.connections.ending() => return None,
    };
    match done {
        Ok(Ok(wire)) => wire,
        Ok(Err(error)) => {
            refused(&error.to_string());
            None
        }
        Err(_) => {
            refused("the handshake did not end in time");
            None
        }
    }
}

/// Answers requests that come over `transport`; where the server ends, the one that is being answered is the last.
async fn answer(
    transport: Transport,
    connection: Arc<Connection>,
    is_exposed: bool,
    router: Router,
    shared: &Shared,
) -> Result<(), hyper::Error> {
    let service = service_fn(move |mut request: Request<Incoming>| {
        connection.asked();
        request.extensions_mut().insert(Arc::clone(&connection));
        if is_exposed {
            request.extensions_mut().insert(Exposed);
        }
        router.clone().call(request.map(Body::new))
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(seconds(shared.limits.request_s))
        .max_buf_size(REQUEST_HEAD)
        .serve_connection(TokioIo::new(transport), service)
        .with_upgrades();
    let mut served = pin!(served);
    tokio::select! {
        result = served.as_mut() => return result,
        () = shared.connections.ending() => served.as_mut().graceful_shutdown(),
    }
    served.await
}

fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    socket.set_reuseaddr(true)?;
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.set_nodelay(true)?;
    socket.bind(address)?;
    socket.listen(1024)
}

/// Connections that the process's limit of open files leaves room for.
#[cfg(unix)]
fn most_connections() -> usize {
    let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
    // Half of them at least: with very few open files nothing works anyway.
    limit.map_or(usize::MAX, |n| n.saturating_sub(OTHER_FILES).max(n / 2).max(1) as usize)
}

#[cfg(not(unix))]
fn most_connections() -> usize {
    usize::MAX
}

/// Whether an error of `accept` concerns the one connection only.
fn is_of_connection(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::ConnectionAborted
            | ErrorKind::ConnectionReset
            | ErrorKind::ConnectionRefused
            | ErrorKind::Interrupted
    )
}

async fn stream(
    State(shared): State<Shared>,
    Extension(connection): Extension<Arc<Connection>>,
    Extension(identity): Extension<Identity>,
    Query(query): Query<HashMap<String, String>>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, (StatusCode, String)> {
    let shared = asked_for(shared, &query).await?;
    let upgrade = accepted(upgrade, &shared.limits, &[SUBPROTOCOL])?;
    Ok(upgrade.on_upgrade(move |socket| client::serve(socket, shared, connection, identity)))
}

async fn foxglove_stream(
    State(shared): State<Shared>,
    Extension(connection): Extension<Arc<Connection>>,
    Extension(identity): Extension<Identity>,
    Query(query): Query<HashMap<String, String>>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, (StatusCode, String)> {
    let shared = asked_for(shared, &query).await?;
    let upgrade = accepted(upgrade, &shared.limits, &SUBPROTOCOLS)?;
    Ok(upgrade.on_upgrade(move |socket| foxglove::serve(socket, shared, connection, identity)))
}

/// A WebSocket with the bounds of `limits`, if its client speaks one of `protocols`.
fn accepted(
    upgrade: WebSocketUpgrade,
    limits: &Limits,
    protocols: &'static [&'static str],
) -> Result<WebSocketUpgrade, (StatusCode, String)> {
    let upgrade = upgrade
        .protocols(protocols.iter().copied())
        .max_message_size(limits.message_bytes)
        .max_frame_size(limits.message_bytes)
        .read_buffer_size(READ_BUFFER)
        // Every message goes to the socket at once, so that nothing stale waits in between.
        .write_buffer_size(0);
    if upgrade.selected_protocol().is_some() {
        return Ok(upgrade);
    }
    let spoken = protocols.join(" or ");
    Err((StatusCode::BAD_REQUEST, format!("here this agent speaks {spoken} only: update the viewer or the agent")))
}

/// What a viewer follows: what is live, or the inspection that it asks for.
async fn asked_for(shared: Shared, query: &HashMap<String, String>) -> Result<Shared, (StatusCode, String)> {
    match query.get("inspection") {
        None => Ok(shared),
        Some(inspection) => past_inspection(shared, inspection, query).await,
    }
}

/// What a viewer follows that asks for an inspection: a past one as it was, or the one that is live.
async fn past_inspection(
    shared: Shared,
    inspection: &str,
    query: &HashMap<String, String>,
) -> Result<Shared, (StatusCode, String)> {
    let refused = |status: StatusCode, reason: String| Err((status, reason));
    let Ok(id) = inspection.parse::<InspectionId>() else {
        return refused(StatusCode::BAD_REQUEST, format!("inspection: {} is no UUID", Excerpt(inspection)));
    };
    let pace = match Pace::of(query) {
        Ok(pace) => pace,
        Err(reason) => return refused(StatusCode::BAD_REQUEST, reason),
    };
    let (progress, live, _) = shared.live.standing();
    if live == id.to_string() && matches!(progress.phase(), Phase::Waiting | Phase::Running) {
        return Ok(shared);
    }
    let Some(past) = shared.past.clone() else {
        let reason = "this agent keeps no inspections: `semascan serve --data DIR` does";
        return refused(StatusCode::NOT_FOUND, reason.into());
    };
    let rows = Arc::clone(&past);
    match tokio::task::spawn_blocking(move || rows.catalogue.inspection(id)).await {
        Ok(Ok(Some(_))) => {}
        Ok(Ok(None)) => return refused(StatusCode::NOT_FOUND, format!("there is no inspection {id}")),
        Ok(Err(error)) => return refused(StatusCode::SERVICE_UNAVAILABLE, error.reason),
        Err(error) => return refused(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()),
    }
    match shared.replays.begin(&past, id, pace) {
        Some(live) => Ok(Shared { live, ..shared }),
        None => refused(StatusCode::SERVICE_UNAVAILABLE, "too many past inspections are shown at once".into()),
    }
}

async fn file(State(shared): State<Shared>, uri: Uri, headers: HeaderMap) -> Response {
    // Files of a folder are read from disk, which may block.
    let read = tokio::task::spawn_blocking(move || shared.files.serve(uri.path(), &headers)).await;
    read.unwrap_or_else(|error| {
        tracing::error!("a file could not be read: {}", Excerpt(&error.to_string()));
        (StatusCode::INTERNAL_SERVER_ERROR, "the file could not be read").into_response()
    })
}
