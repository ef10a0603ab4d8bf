//! TLS and logins over real sockets: slow, broken and fragmented handshakes hold nobody up, the stream needs a login and ends
//! with it, and what is said in between is bounded.

use anyhow::{Context, Result, ensure};
use futures_util::{SinkExt, StreamExt};
use jiff::Timestamp;
use prost::Message as _;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use semascan_inspection::ports::{Accounts, UserRow};
use semascan_model::Role;
use semascan_model::account_log::Actor;
use semascan_protocol::{ClientMessage, Hello, SUBPROTOCOL, client_message};
use semascan_server::{
    AccessRule, Entry, Limits, ServerConfig, Tls, TlsFiles, WebFiles, hash_password, own_certificate,
};
use semascan_store::data::{DataFolder, SqliteAccounts};
use semascan_tests::served::Served;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Poll, ready};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_rustls::TlsConnector;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::{Error, Message};

const PASSWORD: &str = "correct horse";
const PATIENCE: Duration = Duration::from_secs(20);

/// An agent with TLS and users.
struct Secured {
    served: Served,
    accounts: Arc<SqliteAccounts>,
    tls: Arc<Tls>,
    files: TlsFiles,
    root: tempfile::TempDir,
}

impl Secured {
    fn start(limits: Limits) -> Result<Self> {
        let root = tempfile::tempdir()?;
        drop(DataFolder::open(root.path())?);
        let accounts = Arc::new(SqliteAccounts::open(root.path())?);
        let now = Timestamp::now();
        let password = hash_password("anna", PASSWORD)?;
        let anna = UserRow {
            name: "anna".into(),
            role: Role::Viewer,
            password,
            created: now,
            password_set: now,
            removed: None,
            identity: None,
        };
        ensure!(accounts.add_user(&anna, &Actor::Agent)?);
        let files = own_certificate(&root.path().join("tls"), &[], &[])?;
        let tls = Arc::new(Tls::open(files.clone())?);
        let served = Served::start_as(ServerConfig {
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            access: AccessRule::default(),
            entry: Entry::Accounts { accounts: accounts.clone(), provider: None },
            tls: Some(Arc::clone(&tls)),
            files: WebFiles::Embedded(|_| None),
            limits,
            metrics: None,
        })?;
        Ok(Self { served, accounts, tls, files, root })
    }

    fn address(&self) -> SocketAddr {
        self.served.address
    }

    async fn tcp(&self) -> Result<TcpStream> {
        Ok(TcpStream::connect(self.address()).await?)
    }

    /// TLS on `stream`, believing the certificate of the agent and no other.
    async fn tls_on<S: AsyncRead + AsyncWrite + Unpin>(&self, stream: S) -> Result<tokio_rustls::client::TlsStream<S>> {
        connector(&self.files.certificate)?.connect(ServerName::try_from("127.0.0.1")?, stream).await.context("no TLS")
    }

    /// The whole answer to `request` over a connection of its own.
    async fn ask(&self, request: &str) -> Result<String> {
        let stream = self.tls_on(self.tcp().await?).await?;
        answer(stream, request).await
    }

    /// Logs anna in: the cookie to send.
    async fn log_in(&self) -> Result<String> {
        let body = format!(r#"{{"name":"anna","password":"{PASSWORD}"}}"#);
        let request = format!(
            "POST /api/v1/login HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Type: application/json\r\n\
             X-Semascan-Request: 1\r\nContent-Length: {}\r\n\r\n{body}",
            self.address(),
            body.len()
        );
        let answer = self.ask(&request).await?;
        ensure!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        let (_, cookie) = answer.split_once("set-cookie: ").context("no cookie")?;
        Ok(cookie.split(';').next().context("empty")?.to_owned())
    }

    /// Opens the stream with these headers.
    async fn open_stream(&self, headers: &[(&'static str, &str)]) -> Result<Stream> {
        let mut request = format!("wss://{}/ws", self.address()).into_client_request()?;
        request.headers_mut().insert("sec-websocket-protocol", HeaderValue::from_static(SUBPROTOCOL));
        for (name, value) in headers {
            request.headers_mut().insert(*name, HeaderValue::from_str(value)?);
        }
        let stream = self.tls_on(self.tcp().await?).await?;
        Ok(tokio_tungstenite::client_async(request, stream).await?.0)
    }
}

type Stream = tokio_tungstenite::WebSocketStream<tokio_rustls::client::TlsStream<TcpStream>>;

fn connector(certificate: &Path) -> Result<TlsConnector> {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(certificate)?)?;
    let config = ClientConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()))
        .with_safe_default_protocol_versions()?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(Arc::new(config).into())
}

async fn answer(mut stream: impl AsyncRead + AsyncWrite + Unpin, request: &str) -> Result<String> {
    stream.write_all(request.as_bytes()).await?;
    stream.flush().await?;
    let mut bytes = Vec::new();
    // Some end without saying so in TLS; what came counts.
    let _ = timeout(PATIENCE, stream.read_to_end(&mut bytes)).await.context("the connection stays open")?;
    Ok(String::from_utf8(bytes)?)
}

fn get(path: &str, address: SocketAddr) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")
}

/// The status with which the agent refused to open the stream.
fn refused_with(opened: Result<Stream>) -> u16 {
    match opened.map(drop).expect_err("refused").downcast::<Error>() {
        Ok(Error::Http(answer)) => answer.status().as_u16(),
        other => panic!("not refused by HTTP: {other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tls_is_spoken_with_the_certificate_that_was_named_and_nothing_else() {
    let agent = Secured::start(Limits::default()).expect("serves");
    let health = agent.ask(&get("/healthz", agent.address())).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 200") && health.contains(r#""state":"waiting""#), "{health}");
    // Who speaks plain HTTP is told so, and sends nothing secret again.
    let plain = answer(agent.tcp().await.expect("connects"), &get("/", agent.address())).await.expect("answers");
    assert!(plain.starts_with("HTTP/1.1 400") && plain.contains("https://"), "{plain}");
    let cookie = agent.log_in().await.expect("logs in");
    let head = format!("GET /api/v1/me HTTP/1.1\r\nHost: {}\r\nCookie: {cookie}\r\n\r\n", agent.address());
    let plain = answer(agent.tcp().await.expect("connects"), &head).await.expect("answers");
    assert!(plain.starts_with("HTTP/1.1 400") && !plain.contains("anna"), "{plain}");
    // But a program on this machine may ask whether it works.
    let health = answer(agent.tcp().await.expect("connects"), &get("/healthz", agent.address())).await;
    assert!(health.expect("answers").ends_with(r#"{"healthy":true,"state":"waiting"}"#));
    // A certificate that was exchanged holds from the next connection on.
    let before = agent.tls.fingerprint();
    let old = std::fs::read(&agent.files.certificate).expect("reads");
    let other = own_certificate(&agent.root.path().join("other"), &[], &[]).expect("made");
    std::fs::copy(&other.certificate, &agent.files.certificate).expect("copied");
    std::fs::copy(&other.key, &agent.files.key).expect("copied");
    agent.tls.reload().expect("read again");
    assert_ne!(agent.tls.fingerprint(), before);
    assert!(agent.ask(&get("/healthz", agent.address())).await.is_ok());
    std::fs::write(&agent.files.certificate, old).expect("written");
    let error = agent.ask(&get("/healthz", agent.address())).await.expect_err("the old one is not shown any more");
    assert!(format!("{error:#}").contains("certificate"), "{error:#}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_handshakes_hold_no_place_for_ever() {
    let limits = Limits { connections: 20, connections_per_address: 20, request_s: 1.5, ..Limits::default() };
    let agent = Secured::start(limits).expect("serves");
    // Mute, and one that says a byte of a handshake every now and then.
    let mut mute = Vec::new();
    for _ in 0..20 {
        mute.push(agent.tcp().await.expect("the kernel takes it"));
    }
    for (place, stream) in mute.iter_mut().enumerate().take(10) {
        // The head of a record with a ClientHello of 256 bytes, which never comes.
        let head = [22, 3, 1, 1, 4, 1, 0, 1, 0];
        stream.write_all(&head[..1 + place % head.len()]).await.expect("sends");
    }
    let begun = Instant::now();
    tokio::time::sleep(Duration::from_millis(700)).await;
    // All places are taken, and the stillest gives way.
    let health = agent.ask(&get("/healthz", agent.address())).await.expect("a viewer gets in");
    assert!(health.starts_with("HTTP/1.1 200"), "{health}");
    let mut dripping = agent.tcp().await.expect("connects");
    for _ in 0..40 {
        // Ended meanwhile, which is what is waited for.
        if dripping.write_all(&[22]).await.is_err() {
            break;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    for stream in mute.iter_mut().chain([&mut dripping]) {
        let ended = timeout(Duration::from_secs(3), stream.read_to_end(&mut Vec::new())).await;
        assert!(ended.is_ok(), "a connection stays open {} s after it began", begun.elapsed().as_secs());
    }
    let health = agent.ask(&get("/healthz", agent.address())).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 200"));
}

/// Sends one byte at a time.
struct Fragmented<S>(S);

impl<S: AsyncRead + Unpin> AsyncRead for Fragmented<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut std::task::Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let mut one = [0];
        let mut single = ReadBuf::new(&mut one);
        ready!(Pin::new(&mut self.0).poll_read(cx, &mut single))?;
        buffer.put_slice(single.filled());
        Poll::Ready(Ok(()))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Fragmented<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut std::task::Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(cx, bytes.get(..1).unwrap_or(bytes))
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut std::task::Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut std::task::Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(cx)
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn fragments_are_put_together_and_nonsense_is_refused() {
    let agent = Secured::start(Limits { request_s: 2.0, ..Limits::default() }).expect("serves");
    let tcp = agent.tcp().await.expect("connects");
    tcp.set_nodelay(true).expect("set");
    let stream = agent.tls_on(Fragmented(tcp)).await.expect("a handshake byte by byte");
    let health = answer(stream, &get("/healthz", agent.address())).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 200"), "{health}");
    // Nonsense that begins as a handshake, a record that is too large, and a handshake that is cut off.
    let random: Vec<u8> = (0..4000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 11) as u8).collect();
    for bytes in
        [[&[22, 3, 3, 0, 200], &random[..200]].concat(), [&[22, 3, 3, 255, 255], &random[..]].concat(), vec![22]]
    {
        let mut stream = agent.tcp().await.expect("connects");
        stream.write_all(&bytes).await.expect("sends");
        let mut said = Vec::new();
        let _ = timeout(Duration::from_secs(5), stream.read_to_end(&mut said)).await.expect("it is ended");
        assert!(said.len() < 64, "an alert at most");
    }
    // What is no request inside of TLS is answered as outside of it.
    let nonsense = agent.ask("nonsense\r\n\r\n").await.expect("answers");
    assert!(nonsense.starts_with("HTTP/1.1 400") && nonsense.contains("x-content-type-options"), "{nonsense}");
    let long = format!("GET / HTTP/1.1\r\nHost: {}\r\nX: {}\r\n\r\n", agent.address(), "x".repeat(40_000));
    assert!(agent.ask(&long).await.expect("answers").starts_with("HTTP/1.1 431"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_stream_needs_a_login_and_ends_with_it() {
    let limits = Limits { ping_s: 0.2, ..Limits::default() };
    let agent = Secured::start(limits).expect("serves");
    assert_eq!(refused_with(agent.open_stream(&[]).await), 401);
    let cookie = agent.log_in().await.expect("logs in");
    assert!(cookie.starts_with("__Host-semascan-"), "{cookie}");
    assert_eq!(refused_with(agent.open_stream(&[("cookie", &cookie), ("origin", "https://evil.example")]).await), 403);
    let own = format!("https://{}", agent.address());
    let mut stream = agent.open_stream(&[("cookie", &cookie), ("origin", &own)]).await.expect("opens");
    let hello = Hello { client: "test".into(), ..Hello::default() };
    let hello = ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec();
    stream.send(Message::Binary(hello.into())).await.expect("sends");
    assert!(matches!(stream.next().await, Some(Ok(Message::Binary(_)))), "welcome");
    // It goes on past many pings ...
    let quiet = timeout(Duration::from_millis(900), async {
        while let Some(Ok(message)) = stream.next().await {
            assert!(!message.is_close(), "{message:?}");
        }
    });
    assert!(quiet.await.is_err(), "the stream ended by itself");
    // ... until the user is removed.
    assert_eq!(agent.accounts.remove_user("anna", Timestamp::now(), &Actor::Agent), Ok(true));
    let reason = timeout(PATIENCE, async {
        loop {
            if let Some(Ok(Message::Close(frame))) = stream.next().await {
                break frame.map(|frame| frame.reason.to_string());
            }
        }
    });
    assert_eq!(reason.await.expect("it is closed").as_deref(), Some("the login has ended: log in again"));
    assert_eq!(refused_with(agent.open_stream(&[("cookie", &cookie)]).await), 401, "the same cookie again");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_login_that_does_not_come_is_not_waited_for() {
    let agent = Secured::start(Limits { request_s: 0.5, ..Limits::default() }).expect("serves");
    let head = format!(
        "POST /api/v1/login HTTP/1.1\r\nHost: {}\r\nContent-Type: application/json\r\nX-Semascan-Request: 1\r\n",
        agent.address()
    );
    let begun = Instant::now();
    let slow = agent.ask(&format!("{head}Content-Length: 100\r\n\r\n{{\"name\":")).await.expect("answers");
    assert!(slow.starts_with("HTTP/1.1 408") && begun.elapsed() < Duration::from_secs(5), "{slow}");
    let large = agent.ask(&format!("{head}Content-Length: 9999999999\r\n\r\n{}", "x".repeat(9000))).await;
    assert!(large.expect("answers").starts_with("HTTP/1.1 413"));
    // Two requests in one: what follows a body that was announced twice is nobody's request.
    let smuggled = format!(
        "{head}Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n{}",
        get("/metrics", agent.address())
    );
    let answer = agent.ask(&smuggled).await.expect("answers");
    assert!(!answer.contains("semascan_views"), "{answer}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn paths_lead_nowhere_else() {
    let agent = Secured::start(Limits::default()).expect("serves");
    for path in [
        "/../semascan.db",
        "/..%2fsemascan.db",
        "/%2e%2e/%2e%2e/etc/passwd",
        "//etc/passwd",
        "/./tls/key.pem",
        "/tls/key.pem",
        "/api/v1/../../semascan.db",
        "/api/v1/me/..",
        "/%00",
        "/metrics/",
        "/METRICS",
        "//metrics",
        "/healthz/../metrics",
    ] {
        let answer = agent.ask(&get(path, agent.address())).await.expect("answers");
        let refused = ["HTTP/1.1 404", "HTTP/1.1 401", "HTTP/1.1 400"].iter().any(|status| answer.starts_with(status));
        assert!(refused, "{path}: {answer}");
        assert!(
            !answer.contains("PRIVATE") && !answer.contains("root:") && !answer.contains("semascan_views"),
            "{path}"
        );
    }
}
