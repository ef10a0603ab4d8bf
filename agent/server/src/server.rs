//! The HTTP server: viewer files, the stream at `/ws`, liveness at `/healthz`.

use super::client;
use super::guard::{AccessRule, guard};
use super::live::LiveModel;
use super::web::WebFiles;
use axum::Router;
use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use semascan_protocol::{MAX_CLIENT_MESSAGE, SUBPROTOCOL};
use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::{TcpListener, TcpSocket};

/// Kernel buffer of a connection: what a slow client has in it cannot be replaced by newer revisions any more.
const SEND_BUFFER: u32 = 128 << 10;

/// How the agent is reached.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Address to listen on; port 0 picks a free one.
    pub address: SocketAddr,
    /// Who may talk to it.
    pub access: AccessRule,
    /// The viewer's files.
    pub files: WebFiles,
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
    /// The server stopped.
    #[error("server stopped: {0}")]
    Io(#[from] std::io::Error),
}

/// A bound server.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    router: Router,
}

#[derive(Clone, Debug)]
struct Shared {
    live: Arc<LiveModel>,
    files: Arc<WebFiles>,
}

impl Server {
    /// Binds; nothing is answered before [`Server::run`].
    ///
    /// # Errors
    /// [`ServeError::Bind`] if the address is taken or not this machine's.
    pub fn bind(config: &ServerConfig, live: Arc<LiveModel>) -> Result<Self, ServeError> {
        let address = config.address;
        let listener = listen(address).map_err(|source| ServeError::Bind { address, source })?;
        let shared = Shared { live, files: Arc::new(config.files.clone()) };
        let router = Router::new()
            .route("/ws", any(stream))
            .route("/healthz", get(|| async { "ok" }))
            .fallback(file)
            .layer(axum::middleware::from_fn_with_state(Arc::new(config.access.clone()), guard))
            .with_state(shared);
        Ok(Self { listener, router })
    }

    /// The address that was bound.
    ///
    /// # Errors
    /// The underlying I/O error.
    pub fn local_address(&self) -> std::io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until `shutdown` completes.
    ///
    /// # Errors
    /// [`ServeError::Io`] if the listener fails.
    pub async fn run(self, shutdown: impl Future<Output = ()> + Send + 'static) -> Result<(), ServeError> {
        // Live connections do not end by themselves, so they are dropped rather than waited for.
        tokio::select! {
            served = async { axum::serve(self.listener, self.router).await } => Ok(served?),
            () = shutdown => Ok(()),
        }
    }
}

fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    socket.set_reuseaddr(true)?;
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.set_nodelay(true)?;
    socket.bind(address)?;
    socket.listen(1024)
}

async fn stream(State(shared): State<Shared>, upgrade: WebSocketUpgrade) -> Response {
    let upgrade = upgrade
        .protocols([SUBPROTOCOL])
        .max_message_size(MAX_CLIENT_MESSAGE)
        .max_frame_size(MAX_CLIENT_MESSAGE)
        // Every message goes to the socket at once, so that nothing stale waits in between.
        .write_buffer_size(0);
    if upgrade.selected_protocol().is_none() {
        let reason = format!("this agent speaks {SUBPROTOCOL} only: update the viewer or the agent");
        return (StatusCode::BAD_REQUEST, reason).into_response();
    }
    upgrade.on_upgrade(move |socket| client::serve(socket, shared.live))
}

async fn file(State(shared): State<Shared>, uri: Uri, headers: HeaderMap) -> Response {
    // Files of a folder are read from disk, which may block.
    let read = tokio::task::spawn_blocking(move || shared.files.serve(uri.path(), &headers)).await;
    read.unwrap_or_else(|_| StatusCode::INTERNAL_SERVER_ERROR.into_response())
}
