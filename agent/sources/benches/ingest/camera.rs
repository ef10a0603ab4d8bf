//! The camera's process: a server of Foxglove's protocol that streams the virtual cell at 30 Hz.

use anyhow::{Context, Result};
use futures_util::{SinkExt, StreamExt};
use image::codecs::jpeg::JpegEncoder;
use nalgebra::Isometry3;
use prost::Message as _;
use prost_types::Timestamp;
use semascan_foxglove::protocol::message_frame;
use semascan_foxglove::schema::{
    CAMERA_CALIBRATION, COMPRESSED_IMAGE, CameraCalibration, CompressedImage, FRAME_TRANSFORM, FrameTransform,
    Quaternion, RAW_IMAGE, RawImage, Vector3,
};
use semascan_inspection::source::Source;
use semascan_perception::view::View;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde_json::json;
use std::collections::BTreeMap;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response};
use tokio_tungstenite::tungstenite::http::HeaderValue;

/// The argument that makes this the camera.
pub(crate) const ARGUMENT: &str = "--camera";
/// What it sees: 12 views around the part, each for a second.
const SOURCE: &str = "virtual:starter-motor?seed=7&views=12&size=640x480";
const FRAMES_A_SECOND: u32 = 30;
/// Transforms and joints a second.
const STATES_A_SECOND: u32 = 100;
const JOINTS: usize = 7;

/// Topics by the numbers of their channels, with type, encoding, and how the type is written.
const CHANNELS: [(&str, &str, &str); 6] = [
    ("/camera/color/image_raw/compressed", COMPRESSED_IMAGE.name, "protobuf"),
    ("/camera/aligned_depth_to_color/image_raw", RAW_IMAGE.name, "protobuf"),
    ("/camera/color/camera_info", CAMERA_CALIBRATION.name, "protobuf"),
    ("/camera/aligned_depth_to_color/camera_info", CAMERA_CALIBRATION.name, "protobuf"),
    ("/tf", FRAME_TRANSFORM.name, "protobuf"),
    ("/joint_states", "sensor_msgs/msg/JointState", "cdr"),
];
const COLOR: u32 = 0;
const DEPTH: u32 = 1;
const COLOR_INFO: u32 = 2;
const DEPTH_INFO: u32 = 3;
const TRANSFORM: u32 = 4;
const JOINT_STATES: u32 = 5;

/// A view as it is streamed.
struct Seen {
    jpeg: Vec<u8>,
    /// Millimetres, little endian.
    depth: Vec<u8>,
    view: View,
    table_from_camera: Isometry3<f64>,
}

/// Streams for so many seconds to the one client that comes; says the port, and in the end what was sent.
pub(crate) fn stream(seconds: u64) -> Result<()> {
    let mut source = VirtualCell::open(&VirtualCellSpec::parse(SOURCE)?)?;
    let mut seen = Vec::new();
    while let Some(view) = source.next_view() {
        let view = view?;
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, 85).encode_image(&*view.rgb)?;
        let depth = view.depth.metres.iter().flat_map(|z| ((z * 1e3).round() as u16).to_le_bytes()).collect();
        let table_from_camera = view.pose.table_from_camera().context("the cell knows its poses")?;
        seen.push(Seen { jpeg, depth, view, table_from_camera });
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (messages, worst) = runtime.block_on(serve(&seen, Duration::from_secs(seconds)))?;
    println!("{}", json!({ "messages": messages, "worst_lag_ms": worst.as_secs_f64() * 1e3 }));
    Ok(())
}

async fn serve(seen: &[Seen], length: Duration) -> Result<(BTreeMap<&'static str, u64>, Duration)> {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
    println!("{}", listener.local_addr()?.port());
    let (stream, _) = listener.accept().await?;
    stream.set_nodelay(true)?;
    #[allow(clippy::result_large_err)]
    let choose = |_: &Request, mut response: Response| {
        let chosen = HeaderValue::from_static("foxglove.sdk.v1");
        response.headers_mut().insert("sec-websocket-protocol", chosen);
        Ok(response)
    };
    let mut socket = tokio_tungstenite::accept_hdr_async(stream, choose).await?;
    socket.send(Message::text(json!({ "op": "serverInfo", "name": "camera", "capabilities": [] }).to_string())).await?;
    let channels: Vec<_> = (0..)
        .zip(CHANNELS)
        .map(|(id, (topic, schema, encoding))| {
            json!({ "id": id, "topic": topic, "encoding": encoding, "schemaName": schema, "schema": "" })
        })
        .collect();
    socket.send(Message::text(json!({ "op": "advertise", "channels": channels }).to_string())).await?;
    socket.next().await.context("the client went")??;

    // Frames and states, each when it is due.
    let began = Instant::now();
    let (mut frames, mut states) = (0_u32, 0_u32);
    let (mut sent, mut worst) = (BTreeMap::<&'static str, u64>::new(), Duration::ZERO);
    loop {
        let (frame_due, state_due) =
            (Duration::from_secs(1) * frames / FRAMES_A_SECOND, Duration::from_secs(1) * states / STATES_A_SECOND);
        let due = frame_due.min(state_due);
        if due >= length {
            break;
        }
        tokio::time::sleep(due.saturating_sub(began.elapsed())).await;
        let now = SystemTime::now().duration_since(UNIX_EPOCH)?;
        let picture = &seen[(frame_due.as_secs() as usize) % seen.len()];
        let messages = if state_due <= frame_due {
            states += 1;
            vec![(TRANSFORM, transform(now, &picture.table_from_camera)), (JOINT_STATES, joints(now))]
        } else {
            frames += 1;
            pictures(now, picture)
        };
        for (channel, message) in messages {
            let frame = message_frame(channel, now.as_nanos() as u64, &message);
            socket.send(Message::binary(frame)).await?;
            *sent.entry(CHANNELS[channel as usize].0).or_default() += 1;
        }
        worst = worst.max(began.elapsed().saturating_sub(due));
    }
    // The client goes when it has heard nothing for a while.
    while let Some(Ok(_)) = socket.next().await {}
    Ok((sent, worst))
}

fn timestamp(now: Duration) -> Option<Timestamp> {
    Some(Timestamp { seconds: now.as_secs() as i64, nanos: now.subsec_nanos() as i32 })
}

fn pictures(now: Duration, seen: &Seen) -> Vec<(u32, Vec<u8>)> {
    let (timestamp, frame_id) = (timestamp(now), "camera".to_owned());
    let intrinsics = seen.view.intrinsics;
    let (width, height) = (intrinsics.width, intrinsics.height);
    let [fx, fy, cx, cy] = [intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy];
    let info = CameraCalibration {
        timestamp,
        frame_id: frame_id.clone(),
        width,
        height,
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraCalibration::default()
    };
    let info = info.encode_to_vec();
    let color =
        CompressedImage { timestamp, frame_id: frame_id.clone(), data: seen.jpeg.clone(), format: "jpeg".to_owned() };
    let (encoding, step, data) = ("16UC1".to_owned(), 2 * width, seen.depth.clone());
    let depth = RawImage { timestamp, frame_id, width, height, encoding, step, data };
    vec![(COLOR_INFO, info.clone()), (DEPTH_INFO, info), (COLOR, color.encode_to_vec()), (DEPTH, depth.encode_to_vec())]
}

fn transform(now: Duration, table_from_camera: &Isometry3<f64>) -> Vec<u8> {
    let (t, q) = (table_from_camera.translation, table_from_camera.rotation);
    FrameTransform {
        timestamp: timestamp(now),
        parent_frame_id: "table".to_owned(),
        child_frame_id: "camera".to_owned(),
        translation: Some(Vector3 { x: t.x, y: t.y, z: t.z }),
        rotation: Some(Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
    }
    .encode_to_vec()
}

/// `sensor_msgs/msg/JointState` in CDR: each number at a multiple of its size from behind the first four bytes.
fn joints(now: Duration) -> Vec<u8> {
    let mut bytes = Vec::new();
    let align = |bytes: &mut Vec<u8>, size: usize| bytes.resize(bytes.len().next_multiple_of(size), 0);
    let text = |bytes: &mut Vec<u8>, text: &str| {
        align(bytes, 4);
        bytes.extend((text.len() as u32 + 1).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.push(0);
    };
    bytes.extend((now.as_secs() as i32).to_le_bytes());
    bytes.extend(now.subsec_nanos().to_le_bytes());
    text(&mut bytes, "");
    align(&mut bytes, 4);
    bytes.extend((JOINTS as u32).to_le_bytes());
    (0..JOINTS).for_each(|joint| text(&mut bytes, &format!("joint_{joint}")));
    // Positions, velocities, efforts.
    for count in [JOINTS, 0, 0] {
        align(&mut bytes, 4);
        bytes.extend((count as u32).to_le_bytes());
        for joint in 0..count {
            align(&mut bytes, 8);
            bytes.extend((0.1 * joint as f64).to_le_bytes());
        }
    }
    [vec![0, 1, 0, 0], bytes].concat()
}
