//! Hostile and broken clients: each is told why and closed, and the others go on.

use anyhow::Result;
use futures_util::{SinkExt, StreamExt};
use prost::Message as _;
use semascan_protocol::server_message::Body;
use semascan_protocol::{ClientMessage, Hello, MAX_CLIENT_MESSAGE, SUBPROTOCOL, client_message};
use semascan_tests::client::{Client, Holdings, next_body, open_socket};
use semascan_tests::served::{SMALL_MOTOR, Served};
use std::time::Duration;
use tokio_tungstenite::tungstenite::Message;

/// Sends `message` as the first one; what the agent says before it closes.
async fn reply_to(served: &Served, message: Message) -> Result<String> {
    let mut socket = open_socket(served.address, SUBPROTOCOL, None).await?;
    socket.send(message).await?;
    match next_body(&mut socket).await?.0 {
        Body::Refused(refused) => Ok(refused.reason),
        other => anyhow::bail!("not refused: {other:?}"),
    }
}

fn hello() -> Vec<u8> {
    let hello = Hello { client: "test".into(), ..Hello::default() };
    ClientMessage { body: Some(client_message::Body::Hello(hello)) }.encode_to_vec()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bad_messages_are_refused_with_a_reason_and_others_go_on() {
    let served = Served::start().expect("serves");
    let mut holdings = Holdings::default();
    let mut good = Client::connect(served.address, &mut holdings).await.expect("connects");

    let mut truncated = hello();
    truncated.truncate(truncated.len() - 1);
    let random: Vec<u8> = (0..200_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for (name, bytes, expected) in [
        ("truncated", truncated, "not a semascan.v1 message"),
        ("random", random, "not a semascan.v1 message"),
        ("empty", Vec::new(), "without a body"),
    ] {
        let reason = reply_to(&served, Message::Binary(bytes.into())).await.expect(name);
        assert!(reason.contains(expected), "{name}: {reason}");
    }
    let reason = reply_to(&served, Message::Text("hello".into())).await.expect("text");
    assert!(reason.contains("binary"), "{reason}");

    // A second Hello breaks the protocol too.
    let mut socket = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
    for _ in 0..2 {
        socket.send(Message::Binary(hello().into())).await.expect("sends");
    }
    let reason = loop {
        match next_body(&mut socket).await.expect("refusal").0 {
            Body::Refused(refused) => break refused.reason,
            _ => continue,
        }
    };
    assert!(reason.contains("second Hello"), "{reason}");

    served.inspect(SMALL_MOTOR).expect("begins");
    good.finish(&mut holdings).await.expect("the good client goes on");
    assert_eq!(holdings.hash(), served.live.hash());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_oversized_message_ends_its_connection_only() {
    let served = Served::start().expect("serves");
    let mut socket = open_socket(served.address, SUBPROTOCOL, None).await.expect("opens");
    // The agent may close while this is still being written: either way the connection ends.
    let _ = socket.send(Message::Binary(vec![0; MAX_CLIENT_MESSAGE + 1].into())).await;
    let ended = loop {
        match tokio::time::timeout(Duration::from_secs(20), socket.next()).await {
            Ok(None | Some(Err(_)) | Some(Ok(Message::Close(_)))) => break true,
            Ok(Some(Ok(_))) => {}
            Err(_) => break false,
        }
    };
    assert!(ended);
    assert!(Client::connect(served.address, &mut Holdings::default()).await.is_ok());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn other_versions_and_foreign_pages_cannot_open_the_stream() {
    let served = Served::start().expect("serves");
    let error = open_socket(served.address, "semascan.v9", None).await.expect_err("other version");
    assert!(error.to_string().contains("400"), "{error}");
    let error = open_socket(served.address, SUBPROTOCOL, Some("http://evil.example")).await.expect_err("foreign page");
    assert!(error.to_string().contains("403"), "{error}");
    let own = format!("http://{}", served.address);
    assert!(open_socket(served.address, SUBPROTOCOL, Some(&own)).await.is_ok());
}
