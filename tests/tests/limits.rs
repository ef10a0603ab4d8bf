//! Clients that take and do not give, over real sockets: each is bounded and told why, memory stays flat, others go on.

use anyhow::{Context, Result};
use futures_util::{SinkExt, StreamExt};
use prost::Message as _;
use semascan_protocol::{
    ChunkId, ClientMessage, HeldChunk, Hello, MAX_CLIENT_MESSAGE, MAX_HELD_CHUNKS, SUBPROTOCOL, client_message,
};
use semascan_server::{Limits, WebFiles};
use semascan_tests::client::{Client, Holdings, Socket, open_socket};
use semascan_tests::process::resident_bytes;
use semascan_tests::served::{SMALL_MOTOR, Served};
use std::borrow::Cow;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;

const MEGABYTE: u64 = 1 << 20;
/// A file that is larger than the buffers of a connection.
static LARGE_FILE: [u8; 8 << 20] = [b'x'; 8 << 20];

fn no_files() -> WebFiles {
    WebFiles::Embedded(|_| None)
}

fn large_file() -> WebFiles {
    WebFiles::Embedded(|name| (name == "large.wasm").then_some(Cow::Borrowed(&LARGE_FILE[..])))
}

/// Sends `request` on a connection of its own.
async fn request(address: SocketAddr, request: &str) -> Result<TcpStream> {
    let mut stream = TcpStream::connect(address).await?;
    stream.write_all(format!("{request} HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes()).await?;
    Ok(stream)
}

/// Everything that is answered to `line`, head and body, until the connection ends or `wait` is over.
async fn answer(address: SocketAddr, line: &str, wait: Duration) -> Result<String> {
    let mut stream = request(address, line).await?;
    let mut bytes = Vec::new();
    let _ = tokio::time::timeout(wait, stream.read_to_end(&mut bytes)).await;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn hello(chunks: usize) -> Vec<u8> {
    let held = |i: usize| HeldChunk { id: Some(ChunkId { x: i as i32, y: i32::MIN, z: i32::MAX }), revision: u32::MAX };
    let held = (0..chunks).map(held).collect();
    let hello = Hello { client: "large\x1b[31m\n".repeat(100), held, ..Hello::default() };
    ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec()
}

/// Reads until the agent closes: the code and reason that it gives.
async fn close_of(socket: &mut Socket) -> Result<String> {
    loop {
        let message = tokio::time::timeout(Duration::from_secs(20), socket.next()).await.context("no Close arrives")?;
        if let Message::Close(frame) = message.context("ended without a Close")?? {
            return frame.map(|f| format!("{}: {}", u16::from(f.code), f.reason)).context("a Close without a reason");
        }
    }
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn mute_downloads_and_large_hellos_hold_no_memory_and_others_go_on() {
    let served = Served::start_with(large_file(), Limits::default()).expect("serves");
    let mut holdings = Holdings::default();
    let mut good = Client::connect(served.address, &mut holdings).await.expect("connects");
    let before = resident_bytes(std::process::id()).expect("measured");

    // 60 downloads of 8 MB that nobody reads would be 480 MB if each had a copy.
    let mut mute = Vec::new();
    for _ in 0..60 {
        mute.push(request(served.address, "GET /large.wasm").await.expect("connects"));
    }
    // 40 lists as long as they may be, of chunks that do not exist.
    let mut large = Vec::new();
    for _ in 0..40 {
        let mut socket = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
        socket.send(Message::Binary(hello(MAX_HELD_CHUNKS).into())).await.expect("sends");
        large.push(socket);
    }
    tokio::time::sleep(Duration::from_millis(500)).await;
    let after = resident_bytes(std::process::id()).expect("measured");
    let grown = after.saturating_sub(before) / MEGABYTE;
    assert!(grown < 100, "{grown} MB more with both");

    served.inspect(SMALL_MOTOR).expect("begins");
    good.finish(&mut holdings).await.expect("finishes");
    assert_eq!(holdings.hash(), served.live.hash());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hello_over_the_limit_is_refused() {
    let served = Served::start().expect("serves");
    for bytes in [vec![0; MAX_CLIENT_MESSAGE + 1], hello(MAX_HELD_CHUNKS + 1)] {
        let mut socket = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
        let _ = socket.send(Message::Binary(bytes.into())).await;
        let ended = tokio::time::timeout(Duration::from_secs(20), async {
            while let Some(Ok(message)) = socket.next().await {
                if message.is_close() {
                    break;
                }
            }
        });
        ended.await.expect("it is ended");
    }
    assert!(Client::connect(served.address, &mut Holdings::default()).await.is_ok());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn idle_connections_give_way_to_a_viewer_and_are_ended_by_themselves() {
    let limits = Limits { connections_per_address: 20, request_s: 2.0, ..Limits::default() };
    let served = Served::start_with(no_files(), limits).expect("serves");
    let mut idle = Vec::new();
    for _ in 0..60 {
        idle.push(TcpStream::connect(served.address).await.expect("the kernel takes it"));
    }
    tokio::time::sleep(Duration::from_millis(700)).await;
    let mut holdings = Holdings::default();
    let mut viewer = Client::connect(served.address, &mut holdings).await.expect("a place is made for it");
    let begun = Instant::now();
    for mut stream in idle {
        let mut rest = Vec::new();
        let read = tokio::time::timeout(Duration::from_secs(5), stream.read_to_end(&mut rest)).await;
        assert!(read.is_ok(), "an idle connection is ended");
    }
    assert!(begun.elapsed() < Duration::from_secs(5));
    served.inspect(SMALL_MOTOR).expect("begins");
    viewer.finish(&mut holdings).await.expect("and the viewer stays");
    assert_eq!(holdings.hash(), served.live.hash());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_download_that_is_not_taken_is_ended() {
    let served = Served::start_with(large_file(), Limits { answer_s: 0.5, ..Limits::default() }).expect("serves");
    let mut stream = request(served.address, "GET /large.wasm").await.expect("connects");
    tokio::time::sleep(Duration::from_secs(2)).await;
    let mut taken = Vec::new();
    let _ = stream.read_to_end(&mut taken).await;
    assert!(!taken.is_empty() && taken.len() < LARGE_FILE.len(), "{} bytes", taken.len());
    // One who reads gets the whole, head included.
    let mut reader = request(served.address, "GET /large.wasm").await.expect("connects");
    let mut piece = vec![0; 64 << 10];
    let mut read = 0;
    while read < LARGE_FILE.len() {
        let n = reader.read(&mut piece).await.expect("reads");
        assert!(n > 0, "ended after {read} bytes");
        read += n;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_viewer_that_takes_nothing_or_answers_nothing_is_closed_with_the_reason() {
    let limits = Limits { slow_s: 0.5, ..Limits::default() };
    let served = Served::start_with(no_files(), limits).expect("serves");
    let mut slow = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
    slow.send(Message::Binary(hello(0).into())).await.expect("sends");
    // A message that no buffer takes as a whole.
    served.live.fail(&"x".repeat(7 << 20));
    tokio::time::sleep(Duration::from_secs(2)).await;
    let reason = close_of(&mut slow).await.expect("a Close");
    assert!(reason.contains("too slow") && reason.contains("0.5 s"), "{reason}");

    let limits = Limits { ping_s: 0.2, pong_s: 0.4, hello_s: 0.4, ..Limits::default() };
    let served = Served::start_with(no_files(), limits).expect("serves");
    // One that reads answers pings, and stays.
    let mut holdings = Holdings::default();
    let mut good = Client::connect(served.address, &mut holdings).await.expect("connects");
    let stays = tokio::spawn(async move {
        let follows = async { while good.step(&mut holdings).await.is_ok() {} };
        tokio::time::timeout(Duration::from_millis(2500), follows).await
    });
    let mut deaf = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
    deaf.send(Message::Binary(hello(0).into())).await.expect("sends");
    let mut silent = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
    tokio::time::sleep(Duration::from_secs(2)).await;
    let reason = close_of(&mut deaf).await.expect("a Close");
    assert!(reason.contains("no answer to a ping"), "{reason}");
    let reason = close_of(&mut silent).await.expect("a Close");
    assert!(reason.contains("no Hello"), "{reason}");
    assert!(stays.await.expect("no panic").is_err(), "it was still followed when the time was over");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn health_is_about_the_work_and_every_answer_is_bounded_for_browsers() {
    let limits = Limits { request_s: 0.5, ..Limits::default() };
    let served = Served::start_with(large_file(), limits).expect("serves");
    let wait = Duration::from_secs(5);
    let health = answer(served.address, "GET /healthz", wait).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 200") && health.contains(r#""state":"waiting""#), "{health}");
    served.inspect(SMALL_MOTOR).expect("begins").wait().expect("inspects");
    let health = answer(served.address, "GET /healthz", wait).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 200") && health.contains(r#""state":"finished""#), "{health}");
    assert!(health.contains(r#""views_done":5"#), "{health}");
    served.live.fail("the camera broke");
    let health = answer(served.address, "GET /healthz", wait).await.expect("answers");
    assert!(health.starts_with("HTTP/1.1 503") && health.contains("the camera broke"), "{health}");

    for line in ["GET /healthz", "GET /nothing", "HEAD /large.wasm", "POST /healthz", "DELETE /large.wasm", "PUT /ws"] {
        let answer = answer(served.address, line, wait).await.expect("answers").to_ascii_lowercase();
        assert!(answer.contains("x-content-type-options: nosniff"), "{line}: {answer}");
        let connect = format!("connect-src 'self' ws://{0} wss://{0};", served.address);
        assert!(answer.contains(&connect), "{line}: {answer}");
        let safe = line.starts_with("GET") || line.starts_with("HEAD");
        assert_eq!(answer.starts_with("http/1.1 405"), !safe, "{line}: {answer}");
        assert!(answer.len() < 2000, "{line}: HEAD has no body");
    }
}

/// All that comes back for `bytes`, sent as they are; the connection must be ended by the agent.
async fn raw_answer(address: SocketAddr, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(address).await.expect("connects");
    // The agent may answer and end before it has read all.
    let _ = stream.write_all(bytes).await;
    let mut answer = Vec::new();
    let read = tokio::time::timeout(Duration::from_secs(10), stream.read_to_end(&mut answer)).await;
    read.expect("the agent ends the connection").expect("and it is not reset, so that the answer arrives");
    String::from_utf8(answer).expect("text")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_refusal_has_a_reason_in_words_and_the_headers_of_other_answers() {
    let limits = Limits { request_s: 0.5, ..Limits::default() };
    let served = Served::start_with(large_file(), limits).expect("serves");
    let host = format!("Host: {}\r\n", served.address);
    let large = format!("GET / HTTP/1.1\r\n{host}X: {}\r\n\r\n", "x".repeat(100 << 10));
    let many = format!("GET / HTTP/1.1\r\n{host}{}\r\n", "a: b\r\n".repeat(200));
    let upgrade = "Connection: upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
    let good = format!("GET /nothing HTTP/1.1\r\n{host}\r\n");
    for (name, request, status, word) in [
        ("noise", "\x16\x03\x01\x02\0\r\n\r\n".to_owned(), "400 Bad Request", "no HTTP/1.1 request"),
        ("a name with a space", format!("GET / HTTP/1.1\r\n{host}a b: c\r\n\r\n"), "400 Bad Request", "no HTTP/1.1"),
        ("two lengths", format!("GET / HTTP/1.1\r\n{host}Content-Length: x\r\n\r\n"), "400 Bad Request", "no HTTP"),
        ("noise after a request", format!("{good}\0\0\r\n\r\n"), "400 Bad Request", "no HTTP/1.1 request"),
        ("no host", "GET / HTTP/1.1\r\n\r\n".to_owned(), "403 Forbidden", "no Host header"),
        ("no upgrade", format!("GET /ws HTTP/1.1\r\n{host}\r\n"), "400 Bad Request", "upgrade"),
        ("other protocol", format!("GET /ws HTTP/1.1\r\n{host}{upgrade}\r\n"), "400 Bad Request", "semascan.v1 only"),
        ("no file", good.clone(), "404 Not Found", "no file nothing"),
        ("method", format!("BREW / HTTP/1.1\r\n{host}\r\n"), "405 Method Not Allowed", "GET and HEAD only"),
        ("half a request", format!("GET / HTTP/1.1\r\n{host}"), "408 Request Timeout", "did not arrive in time"),
        ("content", format!("GET / HTTP/1.1\r\n{host}Content-Length: 3\r\n\r\nabc"), "413 Payload", "no content"),
        ("pieces", format!("GET / HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\n"), "413 Payload", "no content"),
        ("large head", large, "431 Request Header", "too large"),
        ("many fields", many, "431 Request Header", "too large"),
    ] {
        let answer = raw_answer(served.address, request.as_bytes()).await;
        // Of several answers the last one is looked at.
        let last = answer.rfind("HTTP/1.1 4").map(|at| &answer[at..]).unwrap_or_default();
        let (head, body) = last.split_once("\r\n\r\n").unwrap_or_default();
        let head = head.to_ascii_lowercase();
        assert!(last.starts_with(&format!("HTTP/1.1 {status}")) && body.contains(word), "{name}: {answer}");
        assert!(head.contains("x-content-type-options: nosniff"), "{name}: {answer}");
        assert!(head.contains("content-type: text/plain; charset=utf-8"), "{name}: {answer}");
        assert!(head.contains("content-security-policy: default-src"), "{name}: {answer}");
        assert!(head.contains(&format!("content-length: {}", body.len())), "{name}: {answer}");
    }
    // An idle connection asked for nothing, and is told nothing.
    assert_eq!(raw_answer(served.address, b"").await, "");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_connection_without_a_place_is_told_so() {
    let limits = Limits { connections: 1, ..Limits::default() };
    let served = Served::start_with(no_files(), limits).expect("serves");
    let _viewer = Client::connect(served.address, &mut Holdings::default()).await.expect("connects");
    for request in ["", "GET / HTTP/1.1\r\n\r\n", &"x".repeat(50 << 10)] {
        let mut stream = TcpStream::connect(served.address).await.expect("the kernel takes it");
        let _ = stream.write_all(request.as_bytes()).await;
        let _ = stream.shutdown().await;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.expect("it is not reset");
        assert!(answer.starts_with("HTTP/1.1 503 Service Unavailable\r\n"), "{answer}");
        assert!(answer.contains("nosniff") && answer.ends_with("\r\n\r\ntoo many connections"), "{answer}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn when_the_agent_ends_viewers_are_told_and_downloads_finished() {
    let served = Served::start_with(large_file(), Limits::default()).expect("serves");
    let address = served.address;
    let mut viewer = open_socket(address, SUBPROTOCOL, None).await.expect("opens");
    viewer.send(Message::Binary(hello(0).into())).await.expect("sends");
    // One that has not said Hello, one that takes a large message slowly, one that downloads, one that only sits there.
    let mut silent = open_socket(address, SUBPROTOCOL, None).await.expect("opens");
    let mut download = request(address, "GET /large.wasm").await.expect("connects");
    let mut half = TcpStream::connect(address).await.expect("connects");
    half.write_all(b"GET / HT").await.expect("sends");
    let first = tokio::time::timeout(Duration::from_secs(5), viewer.next()).await;
    assert!(matches!(first, Ok(Some(Ok(Message::Binary(_))))), "{first:?}");
    let mut piece = [0; 1000];
    download.read_exact(&mut piece).await.expect("begins");

    let begun = Instant::now();
    let ends = tokio::spawn(served.end());
    for socket in [&mut viewer, &mut silent] {
        let reason = close_of(socket).await.expect("a Close");
        assert_eq!(reason, "1001: the agent ends");
    }
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    let mut rest = Vec::new();
    download.read_to_end(&mut rest).await.expect("reads");
    assert!(rest.len() + piece.len() > LARGE_FILE.len(), "{} bytes", rest.len());
    ends.await.expect("no panic").expect("the server ends");
    assert!(begun.elapsed() < Duration::from_secs(4), "{:?}", begun.elapsed());
    let mut nothing = Vec::new();
    let cut = tokio::time::timeout(Duration::from_secs(1), half.read_to_end(&mut nothing)).await;
    assert!(cut.is_ok(), "what does not end is cut off");
    assert!(TcpStream::connect(address).await.is_err(), "nobody listens any more");
}
