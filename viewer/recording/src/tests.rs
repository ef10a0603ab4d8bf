//! Recordings as programs write them, and broken ones.

use crate::{RecordingError, read};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use proptest::prelude::*;
use prost::Message;
use prost_types::Timestamp;
use semascan_formats::ply;
use semascan_foxglove_schema::packed_element_field::NumericType;
use semascan_foxglove_schema::{
    CameraCalibration, FrameTransform, ModelPrimitive, PackedElementField, PointCloud, Quaternion, RawImage,
    SceneEntity, SceneUpdate, Vector3,
};
use std::collections::BTreeMap;
use std::io::Cursor;

/// A message with its topic and schema.
type Line = (&'static str, &'static str, Vec<u8>);

fn file(lines: &[Line], compression: Option<Compression>) -> Vec<u8> {
    written(lines, WriteOptions::new().compression(compression))
}

/// Message after message, in no chunks.
fn unchunked(lines: &[Line]) -> Vec<u8> {
    written(lines, WriteOptions::new().compression(None).use_chunks(false))
}

fn written(lines: &[Line], options: WriteOptions) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = options.create(&mut out).expect("a writer");
    for (sequence, (topic, schema, data)) in lines.iter().enumerate() {
        let schema = writer.add_schema(schema, "protobuf", &[]).expect("a schema");
        let channel_id = writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).expect("a channel");
        let header = MessageHeader { channel_id, sequence: sequence as u32, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, data).expect("a message");
    }
    writer.finish().expect("written");
    drop(writer);
    out.into_inner()
}

/// A view of a wall one metre before a camera that stands at `x` (none: nobody knows where), four pixels by two.
fn view(x: Option<f64>, color: [u8; 3], second: i64) -> Vec<Line> {
    let timestamp = Some(Timestamp { seconds: second, nanos: 0 });
    let picture = |encoding: &str, step: u32, data: Vec<u8>| RawImage {
        timestamp,
        frame_id: "camera".into(),
        width: 4,
        height: 2,
        encoding: encoding.into(),
        step,
        data,
    };
    let calibration = CameraCalibration {
        timestamp,
        frame_id: "camera".into(),
        width: 4,
        height: 2,
        k: vec![100.0, 0.0, 2.0, 0.0, 100.0, 1.0, 0.0, 0.0, 1.0],
        ..CameraCalibration::default()
    };
    let mut lines = vec![
        ("/color", "foxglove.RawImage", picture("rgb8", 12, color.repeat(8)).encode_to_vec()),
        ("/depth", "foxglove.RawImage", picture("16UC1", 8, 1000_u16.to_le_bytes().repeat(8)).encode_to_vec()),
        ("/calibration", "foxglove.CameraCalibration", calibration.encode_to_vec()),
    ];
    if let Some(x) = x {
        let transform = FrameTransform {
            timestamp,
            parent_frame_id: "table".into(),
            child_frame_id: "camera".into(),
            translation: Some(Vector3 { x, y: 0.0, z: 0.0 }),
            rotation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
        };
        lines.push(("/tf", "foxglove.FrameTransform", transform.encode_to_vec()));
    }
    lines
}

fn cloud(x: f32) -> Line {
    let field = |name: &str, offset: u32, kind: NumericType| PackedElementField {
        name: name.into(),
        offset,
        r#type: kind.into(),
    };
    let data = (0..3_u8).flat_map(|n| {
        let mut point: Vec<u8> = [x, f32::from(n) * 1e-3, 0.0].iter().flat_map(|c| c.to_le_bytes()).collect();
        point.extend([10 * n, 2, 3, n]);
        point
    });
    let cloud = PointCloud {
        frame_id: "table".into(),
        point_stride: 16,
        fields: vec![
            field("x", 0, NumericType::Float32),
            field("y", 4, NumericType::Float32),
            field("z", 8, NumericType::Float32),
            field("red", 12, NumericType::Uint8),
            field("green", 13, NumericType::Uint8),
            field("blue", 14, NumericType::Uint8),
            field("component", 15, NumericType::Uint8),
        ],
        data: data.collect(),
        ..PointCloud::default()
    };
    ("/points", "foxglove.PointCloud", cloud.encode_to_vec())
}

fn mesh() -> Line {
    let model =
        ModelPrimitive { media_type: "model/gltf-binary".into(), data: vec![7; 40], ..ModelPrimitive::default() };
    let entity = SceneEntity { models: vec![model], ..SceneEntity::default() };
    ("/mesh", "foxglove.SceneUpdate", SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }.encode_to_vec())
}

#[test]
fn views_are_points_where_their_camera_stood_in_every_compression() {
    let lines = [view(Some(0.0), [200, 0, 0], 0), view(Some(0.5), [0, 100, 0], 1)].concat();
    for compression in [None, Some(Compression::Zstd)] {
        let opened = read("scan.mcap", &file(&lines, compression)).expect("views");
        assert_eq!((opened.name.as_str(), opened.remarks.len()), ("scan.ply", 1), "{:?}", opened.remarks);
        let model = ply::read("scan.ply", &opened.bytes).expect("a cloud");
        let points = model.mesh.vertices;
        assert_eq!((points.len(), points.views[0]), (16, 1));
        let (low, high) = points.positions.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[0]), h.max(p[0])));
        assert!((low + 0.02).abs() < 1e-6 && (high - 0.51).abs() < 1e-6, "{low} to {high}");
        let color = |x: f32| points.iter().find(|p| (p.position[0] - x).abs() < 1e-6).map(|p| p.color);
        assert_eq!((color(-0.02), color(0.51)), (Some([200, 0, 0]), Some([0, 100, 0])));
    }
}

#[test]
fn one_view_needs_no_place_and_several_do() {
    let alone = read("a.mcap", &file(&view(None, [1, 2, 3], 0), None)).expect("a view");
    assert_eq!(ply::read("a.ply", &alone.bytes).expect("a cloud").mesh.vertices.len(), 8);
    let two = [view(None, [1; 3], 0), view(None, [2; 3], 1)].concat();
    assert!(matches!(read("b.mcap", &file(&two, None)), Err(RecordingError::NoPoses(2))));
}

#[test]
fn a_view_before_the_first_transform_is_left_out_and_later_transforms_do_not_move_it() {
    // A transform of the second second comes before the depth picture of the third, as between two pictures of a robot that moves.
    let mut lines = [view(None, [1; 3], 0), view(Some(0.0), [2; 3], 1)].concat();
    lines.extend(view(Some(7.0), [0; 3], 2).pop());
    let opened = read("moving.mcap", &file(&lines, None)).expect("a view");
    assert!(
        opened.remarks.iter().any(|remark| remark.starts_with("1 depth pictures are left out")),
        "{:?}",
        opened.remarks
    );
    let points = ply::read("moving.ply", &opened.bytes).expect("a cloud").mesh.vertices;
    assert_eq!((points.len(), points.colors[0]), (8, [2; 3]));
    assert!(points.positions.iter().all(|p| p[0] < 0.1), "{:?}", points.positions);
}

#[test]
fn a_lens_is_said_and_pictures_without_a_calibration_are_no_views() {
    let mut lines = view(None, [1; 3], 0);
    let calibration = lines.remove(2);
    assert!(matches!(read("a.mcap", &file(&lines, None)), Err(RecordingError::Unusable(1))));
    let mut lens = CameraCalibration::decode(calibration.2.as_slice()).expect("a calibration");
    lens.d = vec![0.1, 0.0];
    lines.push((calibration.0, calibration.1, lens.encode_to_vec()));
    let opened = read("a.mcap", &file(&lines, None)).expect("a view");
    assert!(opened.remarks.iter().any(|remark| remark.contains("lens is not undone")), "{:?}", opened.remarks);
}

#[test]
fn the_last_cloud_is_shown_with_its_classes_and_a_mesh_before_it() {
    let opened = read("log.mcap", &file(&[cloud(9.0), cloud(0.25)], Some(Compression::Zstd))).expect("points");
    let model = ply::read("log.ply", &opened.bytes).expect("a cloud");
    assert!((model.voxel().expect("a spacing") - 1e-3).abs() < 1e-6);
    let points = model.mesh.vertices;
    assert_eq!(
        (points.len(), points.positions[2], points.colors[2], points.labels[2]),
        (3, [0.25, 2e-3, 0.0], [20, 2, 3], 2)
    );
    let opened = read("log.mcap", &file(&[cloud(0.0), mesh()], None)).expect("a mesh");
    assert_eq!((opened.name.as_str(), opened.bytes.len()), ("log.glb", 40));
}

#[test]
fn a_cut_file_shows_what_is_whole_and_another_one_says_what_it_holds() {
    let lines = [view(Some(0.0), [9; 3], 0), view(Some(1.0), [9; 3], 1)].concat();
    // Within the last transform: where the second view was is not known.
    let whole = unchunked(&lines);
    let end = whole.windows(12).rposition(|bytes| bytes == b"table\x1a\x06camer").expect("the last transform");
    let opened = read("c.mcap", &whole[..end]).expect("what is whole");
    assert!(opened.remarks.iter().any(|remark| remark.contains("ends in the middle")), "{:?}", opened.remarks);
    let points = ply::read("c.ply", &opened.bytes).expect("a cloud").mesh.vertices;
    assert!(points.len() == 8 && points.views.iter().all(|views| *views == 1), "{:?}", points.views);
    let foreign = [("/chat", "std_msgs.String", vec![1, 2, 3])];
    let error = read("d.mcap", &file(&foreign, None)).expect_err("nothing").to_string();
    assert!(error.contains("1 of std_msgs.String (protobuf)"), "{error}");
    assert!(matches!(read("e.mcap", b"no recording"), Err(RecordingError::Broken(_))));
    assert!(matches!(read("e.mcap", b""), Err(RecordingError::Broken(_))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn broken_bytes_are_an_error_or_a_part(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), end in any::<prop::sample::Index>()) {
        let lines = [view(Some(0.0), [1; 3], 0), vec![cloud(0.5)], view(Some(0.2), [3; 3], 1)].concat();
        for compression in [None, Some(Compression::Zstd)] {
            let mut bytes = file(&lines, compression);
            for (at, value) in &flips {
                let at = at.index(bytes.len());
                bytes[at] = *value;
            }
            let length = end.index(bytes.len());
            let _ = read("x.mcap", &bytes);
            let _ = read("x.mcap", &bytes[..length]);
        }
    }
}
