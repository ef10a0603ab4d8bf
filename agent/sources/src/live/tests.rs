//! A server of the test's own streams pictures; views come of it as from a recording of the same messages.

use super::*;
use futures_util::{SinkExt, StreamExt};
use prost::Message as _;
use prost_types::Timestamp;
use semascan_foxglove::protocol::message_frame;
use semascan_foxglove::schema::{
    CAMERA_CALIBRATION, CameraCalibration, FRAME_TRANSFORM, FrameTransform, Quaternion, RAW_IMAGE, RawImage, Schema,
    Vector3,
};
use semascan_perception::view::PoseEvidence;
use serde_json::json;
use std::net::TcpListener;
use std::sync::mpsc;
use std::thread;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response};
use tokio_tungstenite::tungstenite::{Message, http::HeaderValue};

const TOPICS: [(&str, Schema); 4] = [
    ("/camera/color/image", RAW_IMAGE),
    ("/camera/depth/image", RAW_IMAGE),
    ("/camera/color/camera_info", CAMERA_CALIBRATION),
    ("/tf", FRAME_TRANSFORM),
];

/// What the test's server does next.
enum Step {
    /// Sends a message on a topic, at a time in milliseconds.
    Send(u32, i64, Vec<u8>),
    /// Cuts the connection and takes the next one.
    Cut,
    /// Waits in real time.
    Pause(u64),
}

fn time(ms: i64) -> Option<Timestamp> {
    Some(Timestamp { seconds: 1000 + ms.div_euclid(1000), nanos: (ms.rem_euclid(1000) * 1_000_000) as i32 })
}

fn image(ms: i64, encoding: &str, pixel: &[u8]) -> Vec<u8> {
    let (width, height) = (8, 6);
    let step = width * pixel.len() as u32;
    let data = pixel.repeat((width * height) as usize);
    let frame_id = "camera".to_owned();
    RawImage { timestamp: time(ms), frame_id, width, height, encoding: encoding.to_owned(), step, data }.encode_to_vec()
}

/// A pair of pictures at a time: their red and their millimetres say which one it is.
fn pair(ms: i64, number: u8) -> [Step; 2] {
    let depth = (500 + u16::from(number)).to_le_bytes();
    [Step::Send(0, ms, image(ms, "rgb8", &[number, 0, 0])), Step::Send(1, ms + 3, image(ms + 3, "16UC1", &depth))]
}

fn calibration() -> Step {
    let info = CameraCalibration {
        timestamp: time(0),
        frame_id: "camera".into(),
        width: 8,
        height: 6,
        k: vec![10.0, 0.0, 3.5, 0.0, 10.0, 2.5, 0.0, 0.0, 1.0],
        p: vec![10.0, 0.0, 3.5, 0.0, 0.0, 10.0, 2.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraCalibration::default()
    };
    Step::Send(2, 0, info.encode_to_vec())
}

fn transform(ms: i64, x: f64) -> Step {
    let transform = FrameTransform {
        timestamp: time(ms),
        parent_frame_id: "table".into(),
        child_frame_id: "camera".into(),
        translation: Some(Vector3 { x, y: 0.0, z: 0.4 }),
        rotation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    };
    Step::Send(3, ms, transform.encode_to_vec())
}

/// Serves the steps; the address. The end of the steps ends the last connection.
fn server(steps: Vec<Step>) -> String {
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
                let channels: Vec<_> = TOPICS
                    .iter()
                    .enumerate()
                    .map(|(id, (topic, schema))| {
                        json!({ "id": id, "topic": topic, "encoding": "protobuf", "schemaName": schema.name, "schema": "" })
                    })
                    .collect();
                let advertised = json!({ "op": "advertise", "channels": channels }).to_string();
                socket.send(Message::text(advertised)).await.expect("sent");
                socket.next().await.expect("a subscription").expect("a message");
                let mut is_over = true;
                for step in steps.by_ref() {
                    match step {
                        Step::Send(topic, ms, message) => {
                            let nanoseconds = ((1_000_000 + ms) * 1_000_000) as u64;
                            let frame = message_frame(topic, nanoseconds, &message);
                            socket.send(Message::binary(frame)).await.expect("sent");
                        }
                        Step::Pause(ms) => tokio::time::sleep(Duration::from_millis(ms)).await,
                        Step::Cut => {
                            is_over = false;
                            break;
                        }
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

/// Red, depth and x of a view, millimetres.
type Seen = (u8, u32, Option<i32>);

/// What each view shows, and what the source says of itself in the end.
fn views(uri: &str) -> (Vec<Seen>, Vec<(String, String)>) {
    let mut source = crate::open(uri, OpenOptions::default()).expect("a server");
    let mut found = Vec::new();
    while let Some(view) = source.next_view() {
        let view = view.expect("a view");
        let x = match view.pose {
            PoseEvidence::World { table_from_camera, .. } => {
                Some((table_from_camera.translation.x * 1e3).round() as i32)
            }
            _ => None,
        };
        found.push((view.rgb.get_pixel(0, 0).0[0], (view.depth.metres[0] * 1e3).round() as u32, x));
    }
    (found, source.info().settings.clone())
}

#[test]
fn pairs_become_views_with_the_poses_of_their_times_though_connections_are_cut() {
    let mut steps = vec![calibration()];
    for number in 0..8_u8 {
        let ms = i64::from(number) * 100;
        // The transform of a picture's time comes after it.
        steps.extend(pair(ms, number));
        steps.push(transform(ms, 0.01 * f64::from(number)));
        steps.push(transform(ms + 50, 0.01 * f64::from(number)));
        if number == 4 {
            steps.push(Step::Pause(1800));
            steps.push(Step::Cut);
            steps.push(calibration());
        }
    }
    let (found, settings) = views(&format!("{}?silence_s=2", server(steps)));
    let expected: Vec<_> = (0..8).map(|n| (n, 500 + u32::from(n), Some(10 * i32::from(n)))).collect();
    assert_eq!(found, expected);
    let stream = settings.iter().find(|(name, _)| name == "stream").map(|(_, text)| text.clone()).expect("said");
    assert!(stream.starts_with("8 pairs came, 0 were passed over, 0 had no pose; 0 messages were dropped"), "{stream}");
    assert!(stream.contains("2 connections"), "{stream}");
}

#[test]
fn a_view_is_taken_where_the_camera_rests_and_the_stream_ends_with_their_number() {
    let mut steps = vec![calibration()];
    // Half a second at each of three places, and a way of 0.2 s between them.
    for frame in 0..60_u8 {
        let ms = i64::from(frame) * 33;
        let place = f64::from(frame) * 0.033 / 0.7;
        let x = place.floor() * 0.05 + ((place.fract() - 0.714).max(0.0) / 0.286) * 0.05;
        steps.push(transform(ms - 1, x));
        steps.push(transform(ms + 5, x));
        steps.extend(pair(ms, frame));
    }
    steps.push(transform(2000, 0.15));
    let (found, settings) = views(&format!("{}?trigger=still&views=2&still_ms=200&silence_s=3", server(steps)));
    assert_eq!(found.iter().map(|(_, _, x)| *x).collect::<Vec<_>>(), [Some(0), Some(50)], "{settings:?}");
    assert!(found.iter().all(|(red, mm, _)| u32::from(*red) + 500 == *mm), "{found:?}");
}

#[test]
fn what_streams_no_pictures_and_who_does_not_answer_are_named() {
    let error = crate::open("ws://127.0.0.1:9/", OpenOptions::default()).err().expect("nobody").to_string();
    assert!(error.contains("ws://127.0.0.1:9/"), "{error}");
    let error = crate::open("ws://127.0.0.1:9/?colour=/c", OpenOptions::default()).err().expect("no key").to_string();
    assert!(error.contains("trigger") && error.contains("depth"), "{error}");
    let mut source =
        crate::open(&format!("{}?silence_s=1", server(vec![calibration()])), OpenOptions::default()).expect("one");
    let error = source.next_view().expect("why").expect_err("no pictures").to_string();
    assert!(error.contains("no topic has depth pictures") && error.contains("1 s"), "{error}");
    assert!(source.next_view().is_none());
}

#[test]
fn colours_without_depth_are_an_error_though_they_go_on() {
    let colors = (0..40).flat_map(|n| [Step::Send(0, 100 * n, image(100 * n, "rgb8", &[1, 2, 3])), Step::Pause(100)]);
    let steps = [calibration()].into_iter().chain(colors).collect();
    let mut source = crate::open(&format!("{}?silence_s=2", server(steps)), OpenOptions::default()).expect("one");
    let error = source.next_view().expect("why").expect_err("no depth").to_string();
    assert!(error.contains("no topic has depth pictures") && error.contains("/camera/color/image (colour)"), "{error}");
    assert!(source.next_view().is_none());
}

#[test]
fn a_clock_that_is_set_back_loses_what_waits_and_nothing_else() {
    let mut steps = vec![calibration()];
    for (number, ms) in [(0, 5000), (1, 5100), (2, 100), (3, 200)] {
        steps.push(transform(ms - 1, 0.001 * f64::from(number)));
        steps.push(transform(ms + 5, 0.001 * f64::from(number)));
        steps.extend(pair(ms, number));
        steps.push(Step::Pause(900));
    }
    let (found, settings) = views(&format!("{}?silence_s=2", server(steps)));
    assert_eq!(found.iter().map(|(red, ..)| *red).collect::<Vec<_>>(), [0, 1, 2, 3], "{settings:?}");
    assert!(settings.iter().any(|(_, text)| text.contains("the clock was set 1 times")), "{settings:?}");
}

#[test]
fn what_is_recorded_is_inspected_like_the_stream() {
    let mut steps = vec![calibration()];
    for number in 0..5_u8 {
        let ms = i64::from(number) * 100;
        steps.push(transform(ms - 1, 0.01 * f64::from(number)));
        steps.push(transform(ms + 5, 0.01 * f64::from(number)));
        steps.extend(pair(ms, number));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cell.mcap");
    let address = LiveAddress::read(&format!("{}?silence_s=1", server(steps))).expect("an address");
    let recorded = record(&address, &path, None, || false).expect("recorded");
    assert_eq!(recorded.messages["/camera/color/image"], 5, "{recorded:?}");
    assert!(recorded.end.contains("1 s"), "{recorded:?}");
    assert!(record(&address, &path, None, || false).is_err(), "no file is replaced");
    let (found, _) = views(&path.display().to_string());
    assert_eq!(found, (0..5).map(|n| (n, 500 + u32::from(n), Some(10 * i32::from(n)))).collect::<Vec<_>>());
}
