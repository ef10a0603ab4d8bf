//! Requests to the identity provider: over HTTPS, on loopback also without, each on a connection of its own, within a time and with
//! an answer of a bounded size. Redirections are not followed: what a provider says is where its endpoints are is where they are.

use crate::guard::is_loopback;
use http_body_util::{BodyExt, Full, LengthLimitError, Limited};
use hyper::body::Bytes;
use hyper::client::conn::http1;
use hyper::header::{self, HeaderValue};
use hyper_util::rt::TokioIo;
use openidconnect::{AsyncHttpClient, HttpRequest, HttpResponse};
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_rustls::TlsConnector;

/// Most bytes of an answer. The keys and metadata of large providers have some 10 kB.
const LARGEST: usize = 512 << 10;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub(super) enum RequestError {
    #[error("{0} is neither https nor on loopback")]
    Open(String),
    #[error("{0} does not answer in time")]
    Late(String),
    #[error("{host} cannot be reached: {source}")]
    Unreached { host: String, source: std::io::Error },
    #[error("{host} does not speak HTTP: {source}")]
    Nonsense { host: String, source: hyper::Error },
    #[error("the answer of {0} is larger than {LARGEST} bytes")]
    Large(String),
    #[error("the answer of {0} breaks off")]
    Cut(String),
}

/// What speaks to a provider.
pub(super) struct HttpClient {
    tls: TlsConnector,
    patience: Duration,
}

impl HttpClient {
    /// Believes the certificate authorities of the system and those in `further`; waits for an answer for `patience`.
    ///
    /// # Errors
    /// [`rustls::Error`] where a certificate in `further` is none.
    pub(super) fn new(further: Vec<CertificateDer<'static>>, patience: Duration) -> Result<Self, rustls::Error> {
        let found = rustls_native_certs::load_native_certs();
        for error in &found.errors {
            tracing::debug!("certificate authorities of the system: {error}");
        }
        let mut roots = RootCertStore::empty();
        roots.add_parsable_certificates(found.certs);
        for certificate in further {
            roots.add(certificate)?;
        }
        let config = ClientConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()))
            .with_safe_default_protocol_versions()?
            .with_root_certificates(roots)
            .with_no_client_auth();
        Ok(Self { tls: Arc::new(config).into(), patience })
    }

    /// The answer to `request`.
    async fn ask(&self, request: HttpRequest) -> Result<HttpResponse, RequestError> {
        let host = request.uri().authority().map_or_else(String::new, ToString::to_string);
        match timeout(self.patience, self.exchange(request, &host)).await {
            Ok(done) => done,
            Err(_) => Err(RequestError::Late(host)),
        }
    }

    async fn exchange(&self, request: HttpRequest, host: &str) -> Result<HttpResponse, RequestError> {
        let unreached = |source| RequestError::Unreached { host: host.to_owned(), source };
        let uri = request.uri().clone();
        let name = uri.host().unwrap_or_default();
        let bare = name.trim_start_matches('[').trim_end_matches(']').to_owned();
        match uri.scheme_str() {
            Some("https") => {
                let stream =
                    TcpStream::connect((bare.as_str(), uri.port_u16().unwrap_or(443))).await.map_err(unreached)?;
                let name = ServerName::try_from(bare).map_err(|error| unreached(std::io::Error::other(error)))?;
                converse(self.tls.connect(name, stream).await.map_err(unreached)?, request, host).await
            }
            Some("http") if is_loopback(name) => {
                let stream =
                    TcpStream::connect((bare.as_str(), uri.port_u16().unwrap_or(80))).await.map_err(unreached)?;
                converse(stream, request, host).await
            }
            _ => Err(RequestError::Open(host.to_owned())),
        }
    }
}

impl<'c> AsyncHttpClient<'c> for HttpClient {
    type Error = RequestError;
    type Future = Pin<Box<dyn Future<Output = Result<HttpResponse, RequestError>> + Send + 'c>>;

    fn call(&'c self, request: HttpRequest) -> Self::Future {
        Box::pin(self.ask(request))
    }
}

/// Sends `request` over `stream`; the whole answer.
async fn converse(
    stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static,
    request: HttpRequest,
    host: &str,
) -> Result<HttpResponse, RequestError> {
    let nonsense = |source| RequestError::Nonsense { host: host.to_owned(), source };
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await.map_err(nonsense)?;
    // It ends when the answer is there or nobody waits for it any more.
    let connection = tokio::spawn(connection);
    let _ends = AbortOnDrop(connection.abort_handle());
    let answer = sender.send_request(of_origin(request, host)).await.map_err(nonsense)?;
    let (head, body) = answer.into_parts();
    let body = Limited::new(body, LARGEST).collect().await.map_err(|error| {
        let is_large = error.is::<LengthLimitError>();
        if is_large { RequestError::Large(host.to_owned()) } else { RequestError::Cut(host.to_owned()) }
    })?;
    Ok(HttpResponse::from_parts(head, body.to_bytes().to_vec()))
}

/// `request` as it is sent to the server of `host` itself (RFC 9112, section 3.2.1).
fn of_origin(request: HttpRequest, host: &str) -> hyper::Request<Full<Bytes>> {
    let (mut head, body) = request.into_parts();
    let path = head.uri.path_and_query().map_or("/", |path| path.as_str());
    head.uri = path.parse().unwrap_or_default();
    if let Ok(host) = HeaderValue::from_str(host) {
        head.headers.insert(header::HOST, host);
    }
    head.headers.insert(header::CONNECTION, HeaderValue::from_static("close"));
    hyper::Request::from_parts(head, Full::from(body))
}

/// Ends a task with its owner.
struct AbortOnDrop(tokio::task::AbortHandle);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}
