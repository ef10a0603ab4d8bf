//! `semascan doctor --config cell.toml` against a camera of the test's own: a healthy cell, and one with each fault.

use crate::{semascan, stderr};
use futures_util::{SinkExt, StreamExt};
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, RgbImage};
use prost::Message as _;
use prost_types::Timestamp;
use semascan_foxglove::protocol::message_frame;
use semascan_foxglove::schema::{
    CAMERA_CALIBRATION, COMPRESSED_IMAGE, CameraCalibration, CompressedImage, FRAME_TRANSFORM, FrameTransform,
    Quaternion, RAW_IMAGE, RawImage, Vector3,
};
use serde_json::{Value, json};
use std::io::Cursor;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response};
use tokio_tungstenite::tungstenite::http::HeaderValue;

const SIZE: (u32, u32) = (160, 120);

/// What is wrong with the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wrong {
    Nothing,
    Slow,
    NoDepth,
    NoTransforms,
    ClockBehind,
    DepthInMillimetres,
    Blurred,
    BurntOut,
    NoCalibration,
}

fn file(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).expect("a picture");
    bytes.into_inner()
}

/// A board of fields of 8 pixels, or what a bad lens makes of it.
fn color(wrong: Wrong) -> Vec<u8> {
    let (blur, bright) = if wrong == Wrong::Blurred { (3_i32, 200.0) } else { (0, 200.0) };
    let bright = if wrong == Wrong::BurntOut { 255.0 } else { bright };
    let grey = |x: i32, y: i32| if (x.div_euclid(8) + y.div_euclid(8)) % 2 == 0 { bright } else { 40.0 };
    let picture = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let window = (-blur..=blur).flat_map(|v| (-blur..=blur).map(move |u| (u, v)));
        let sum: f64 = window.map(|(u, v)| grey(x as i32 + u, y as i32 + v)).sum();
        Rgb([(sum / f64::from((2 * blur + 1) * (2 * blur + 1))) as u8; 3])
    });
    file(&picture.into(), ImageFormat::Jpeg)
}

/// Streams until the process ends; the port.
fn camera(wrong: Wrong) -> u16 {
    let (say, port) = mpsc::channel();
    thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a port");
            say.send(listener.local_addr().expect("bound").port()).expect("heard");
            let (stream, _) = listener.accept().await.expect("a client");
            #[allow(clippy::result_large_err)]
            let choose = |_: &Request, mut response: Response| {
                let chosen = HeaderValue::from_static("foxglove.sdk.v1");
                response.headers_mut().insert("sec-websocket-protocol", chosen);
                Ok(response)
            };
            let mut socket = tokio_tungstenite::accept_hdr_async(stream, choose).await.expect("a WebSocket");
            let depth_schema = if wrong == Wrong::DepthInMillimetres { RAW_IMAGE } else { COMPRESSED_IMAGE };
            let topics = [
                ("/camera/color/image", COMPRESSED_IMAGE),
                ("/camera/aligned_depth/image", depth_schema),
                ("/camera/color/camera_info", CAMERA_CALIBRATION),
                ("/tf", FRAME_TRANSFORM),
            ];
            let channels: Vec<Value> = (0..)
                .zip(topics)
                .map(|(id, (topic, schema))| {
                    json!({ "id": id, "topic": topic, "encoding": "protobuf", "schemaName": schema.name, "schema": "" })
                })
                .collect();
            let info = json!({ "op": "serverInfo", "name": "camera", "capabilities": [] }).to_string();
            let advertised = json!({ "op": "advertise", "channels": channels }).to_string();
            for text in [info, advertised] {
                socket.send(Message::text(text)).await.expect("sent");
            }
            let picture = color(wrong);
            let period = Duration::from_millis(if wrong == Wrong::Slow { 250 } else { 40 });
            for frame in 0.. {
                for (channel, message) in messages(wrong, frame, &picture) {
                    if socket.send(Message::binary(message_frame(channel, 1, &message))).await.is_err() {
                        return;
                    }
                }
                // What the client says is of no interest here.
                let _ = tokio::time::timeout(period, socket.next()).await;
                tokio::time::sleep(period / 2).await;
            }
        });
    });
    port.recv().expect("a port")
}

/// What is sent of a frame.
fn messages(wrong: Wrong, frame: u32, picture: &[u8]) -> Vec<(u32, Vec<u8>)> {
    let mut now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970");
    if wrong == Wrong::ClockBehind {
        now -= Duration::from_secs(3600);
    }
    let timestamp = Some(Timestamp { seconds: now.as_secs() as i64, nanos: now.subsec_nanos() as i32 });
    let (frame_id, (width, height)) = ("camera".to_owned(), SIZE);
    let info = CameraCalibration {
        timestamp,
        frame_id: frame_id.clone(),
        width,
        height,
        k: vec![150.0, 0.0, 79.5, 0.0, 150.0, 59.5, 0.0, 0.0, 1.0],
        p: vec![150.0, 0.0, 79.5, 0.0, 0.0, 150.0, 59.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraCalibration::default()
    };
    let depth = if wrong == Wrong::DepthInMillimetres {
        let data = 500_f32.to_le_bytes().repeat((width * height) as usize);
        let (encoding, frame_id) = ("32FC1".to_owned(), frame_id.clone());
        RawImage { timestamp, frame_id, width, height, encoding, step: 4 * width, data }.encode_to_vec()
    } else {
        let data =
            file(&DynamicImage::ImageLuma16(ImageBuffer::from_pixel(width, height, Luma([500]))), ImageFormat::Png);
        CompressedImage { timestamp, frame_id: frame_id.clone(), data, format: "png".into() }.encode_to_vec()
    };
    let color = CompressedImage { timestamp, frame_id, data: picture.to_vec(), format: "jpeg".into() };
    let transform = FrameTransform {
        timestamp,
        parent_frame_id: "base".into(),
        child_frame_id: "camera".into(),
        translation: Some(Vector3 { x: 0.001 * f64::from(frame), y: 0.0, z: 0.5 }),
        rotation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    };
    let mut sent =
        vec![(0, color.encode_to_vec()), (1, depth), (2, info.encode_to_vec()), (3, transform.encode_to_vec())];
    sent.retain(|(channel, _)| {
        !(wrong == Wrong::NoDepth && *channel == 1
            || wrong == Wrong::NoCalibration && *channel == 2
            || wrong == Wrong::NoTransforms && *channel == 3)
    });
    sent
}

/// What the doctor says of a cell: exit code, and findings by name with their health and all their words.
fn examined(port: u16, more: &str) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let config = folder.path().join("cell.toml");
    let text = format!(
        "[source]\nuri = \"ws://127.0.0.1:{port}\"\n[cell]\nworking_distance = [0.3, 0.8]\ndata = \"data\"\n{more}\n\
         [cell.camera]\nrate_hz = 10.0\n[cell.frames]\nbase = \"base\"\n"
    );
    std::fs::write(&config, text).expect("written");
    let output = semascan(&["doctor", "--json", "--seconds", "1.5", "--config", config.to_str().expect("UTF-8")]);
    let report = serde_json::from_slice(&output.stdout).expect("one JSON object");
    (output.status.code(), report, stderr(&output))
}

/// Health of a finding, and what it says.
fn finding(report: &Value, what: &str) -> (String, String) {
    let found = report["findings"].as_array().expect("findings").iter().find(|finding| finding["what"] == what);
    let found = found.unwrap_or_else(|| panic!("{what}: {report:#}"));
    let text = format!("{} {}", found["text"].as_str().expect("a text"), found["mend"].as_str().expect("a text"));
    (found["health"].as_str().expect("a health").to_owned(), text)
}

#[test]
fn a_healthy_cell_is_well_and_each_fault_is_named_with_how_to_mend_it() {
    let healthy = thread::spawn(|| examined(camera(Wrong::Nothing), ""));
    let faults = [
        (Wrong::Slow, "topics", "10 Hz are expected"),
        (Wrong::NoDepth, "topics", "depth"),
        (Wrong::NoTransforms, "transforms", "robot_state_publisher"),
        (Wrong::ClockBehind, "clocks", "3600"),
        (Wrong::DepthInMillimetres, "depth", "1000 times too large"),
        (Wrong::Blurred, "focus", "focus the lens"),
        (Wrong::BurntOut, "exposure", "shorten the exposure"),
        (Wrong::NoCalibration, "topics", "calibration"),
    ];
    let examined_faults: Vec<_> = faults
        .iter()
        .map(|(wrong, ..)| {
            let wrong = *wrong;
            thread::spawn(move || examined(camera(wrong), ""))
        })
        .collect();
    let (_, report, said) = healthy.join().expect("examined");
    for what in ["network", "topics", "clocks", "transforms", "depth", "focus", "exposure", "disk"] {
        assert_eq!(finding(&report, what).0, "ok", "{what}: {said}");
    }
    for ((wrong, what, word), examined) in faults.into_iter().zip(examined_faults) {
        let (code, report, said) = examined.join().expect("examined");
        let (health, text) = finding(&report, what);
        assert_eq!((health.as_str(), code), ("failed", Some(1)), "{wrong:?}: {said}");
        assert!(text.contains(word), "{wrong:?}: {text}");
        assert!(said.contains("to mend it"), "{wrong:?}: {said}");
    }
}

#[test]
fn nobody_at_the_address_and_no_calibration_are_named() {
    let (code, report, said) = examined(9, "calibration = \"none.json\"");
    assert_eq!(code, Some(1), "{said}");
    assert!(finding(&report, "source").1.contains("foxglove_bridge"), "{said}");
    let (health, text) = finding(&report, "calibration");
    assert!(health == "failed" && text.contains("semascan calibrate") && text.contains("none.json"), "{said}");
}
