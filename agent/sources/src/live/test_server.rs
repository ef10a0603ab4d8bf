//! A server of the tests' own, which streams what a test writes down.

use futures_util::{SinkExt, StreamExt};
use prost::Message as _;
use prost_types::Timestamp;
use semascan_foxglove::protocol::message_frame;
use semascan_foxglove::schema::{
    CAMERA_CALIBRATION, COMPRESSED_IMAGE, CameraCalibration, FRAME_TRANSFORM, FrameTransform, Quaternion, RAW_IMAGE,
    RawImage, Schema, Vector3,
};
use serde_json::json;
use std::net::TcpListener;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response};
use tokio_tungstenite::tungstenite::{Message, http::HeaderValue};

/// Channels of a server by their numbers: topic and schema.
pub(super) type Channels = Vec<(u32, &'static str, Schema)>;

/// Pictures as they are in memory.
pub(super) fn raw_channels() -> Channels {
    vec![
        (0, "/camera/color/image", RAW_IMAGE),
        (1, "/camera/depth/image", RAW_IMAGE),
        (2, "/camera/color/camera_info", CAMERA_CALIBRATION),
        (3, "/tf", FRAME_TRANSFORM),
        (4, "/cell/capture", FRAME_TRANSFORM),
    ]
}

/// Pictures as JPEG and PNG.
pub(super) fn compressed_channels() -> Channels {
    vec![
        (0, "/camera/color/image", COMPRESSED_IMAGE),
        (1, "/camera/depth/image", COMPRESSED_IMAGE),
        (2, "/camera/color/camera_info", CAMERA_CALIBRATION),
        (3, "/tf", FRAME_TRANSFORM),
    ]
}

/// What the test's server does next.
pub(super) enum Step {
    /// Sends a message on a channel, at a time in milliseconds.
    Send(u32, i64, Vec<u8>),
    /// Sends a text that is not of the protocol, or is.
    Text(String),
    /// Withdraws a channel and offers it under another number.
    Renumber(u32, u32),
    /// Cuts the connection and takes the next one.
    Cut,
    /// Waits in real time.
    Pause(u64),
}

pub(super) fn time(ms: i64) -> Option<Timestamp> {
    Some(Timestamp { seconds: 1000 + ms.div_euclid(1000), nanos: (ms.rem_euclid(1000) * 1_000_000) as i32 })
}

pub(super) fn image(ms: i64, encoding: &str, pixel: &[u8]) -> Vec<u8> {
    let (width, height) = (8, 6);
    let step = width * pixel.len() as u32;
    let data = pixel.repeat((width * height) as usize);
    let frame_id = "camera".to_owned();
    RawImage { timestamp: time(ms), frame_id, width, height, encoding: encoding.to_owned(), step, data }.encode_to_vec()
}

/// A pair of pictures at a time: their red and their millimetres say which one it is.
pub(super) fn pair(ms: i64, number: u8) -> [Step; 2] {
    let depth = (500 + u16::from(number)).to_le_bytes();
    [Step::Send(0, ms, image(ms, "rgb8", &[number, 0, 0])), Step::Send(1, ms + 3, image(ms + 3, "16UC1", &depth))]
}

pub(super) fn camera_info(ms: i64, (width, height): (u32, u32), fx: f64) -> Step {
    let info = CameraCalibration {
        timestamp: time(ms),
        frame_id: "camera".into(),
        width,
        height,
        k: vec![fx, 0.0, 3.5, 0.0, fx, 2.5, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, 3.5, 0.0, 0.0, fx, 2.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraCalibration::default()
    };
    Step::Send(2, ms, info.encode_to_vec())
}

pub(super) fn calibration() -> Step {
    camera_info(0, (8, 6), 10.0)
}

pub(super) fn transform_of(ms: i64, parent: &str, x: f64, w: f64) -> Step {
    let transform = FrameTransform {
        timestamp: time(ms),
        parent_frame_id: parent.into(),
        child_frame_id: "camera".into(),
        translation: Some(Vector3 { x, y: 0.0, z: 0.4 }),
        rotation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w }),
    };
    Step::Send(3, ms, transform.encode_to_vec())
}

pub(super) fn transform(ms: i64, x: f64) -> Step {
    transform_of(ms, "table", x, 1.0)
}

/// Serves the steps with raw pictures; the address. The end of the steps ends the last connection.
pub(super) fn server(steps: Vec<Step>) -> String {
    serve(raw_channels(), steps)
}

/// Serves the steps on channels; the address.
pub(super) fn serve(mut channels: Channels, steps: Vec<Step>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    listener.set_nonblocking(true).expect("set");
    let (ready, is_ready) = mpsc::channel();
    thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(listener).expect("a listener");
            ready.send(()).expect("heard");
            let mut steps = steps.into_iter();
            loop {
                let (stream, _) = listener.accept().await.expect("a client");
                #[allow(clippy::result_large_err)]
                let choose = |request: &Request, mut response: Response| {
                    let offered = request.headers()["sec-websocket-protocol"].to_str().expect("text");
                    assert!(offered.contains("foxglove.sdk.v1"), "{offered}");
                    let chosen = HeaderValue::from_static("foxglove.sdk.v1");
                    response.headers_mut().insert("sec-websocket-protocol", chosen);
                    Ok(response)
                };
                let mut socket = tokio_tungstenite::accept_hdr_async(stream, choose).await.expect("a WebSocket");
                let info = json!({ "op": "serverInfo", "name": "test", "capabilities": [] }).to_string();
                socket.send(Message::text(info)).await.expect("sent");
                socket.send(Message::text(advertised(&channels))).await.expect("sent");
                socket.next().await.expect("a subscription").expect("a message");
                let mut is_over = true;
                for step in steps.by_ref() {
                    let sent = match step {
                        Step::Send(channel, ms, message) => {
                            let nanoseconds = ((1_000_000 + ms) * 1_000_000) as u64;
                            socket.send(Message::binary(message_frame(channel, nanoseconds, &message))).await
                        }
                        Step::Text(text) => socket.send(Message::text(text)).await,
                        Step::Renumber(old, new) => {
                            let place = channels.iter().position(|(id, ..)| *id == old).expect("a channel");
                            channels[place].0 = new;
                            let gone = json!({ "op": "unadvertise", "channelIds": [old] }).to_string();
                            socket.send(Message::text(gone)).await.expect("sent");
                            socket.send(Message::text(advertised(&channels[place..=place]))).await
                        }
                        Step::Pause(ms) => {
                            tokio::time::sleep(Duration::from_millis(ms)).await;
                            Ok(())
                        }
                        Step::Cut => Err(tokio_tungstenite::tungstenite::Error::ConnectionClosed),
                    };
                    if sent.is_err() {
                        is_over = false;
                        break;
                    }
                }
                if is_over {
                    // Nothing more comes, as where a camera is switched off.
                    tokio::time::sleep(Duration::from_secs(30)).await;
                }
            }
        });
    });
    is_ready.recv().expect("a server");
    format!("ws://{address}")
}

fn advertised(channels: &[(u32, &'static str, Schema)]) -> String {
    let channels: Vec<_> = channels
        .iter()
        .map(|(id, topic, schema)| {
            json!({ "id": id, "topic": topic, "encoding": "protobuf", "schemaName": schema.name, "schema": "" })
        })
        .collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}
