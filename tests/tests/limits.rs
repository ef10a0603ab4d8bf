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
