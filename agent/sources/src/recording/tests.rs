//! Recordings that are cut, damaged or arbitrary bytes: they are read to there or refused, with the file's name; nothing
//! panics, and no view is wrong in its sizes.

use super::*;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use semascan_captures::{CaptureInfo, CaptureWriter};
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibratedPose, CalibrationRecord};
use semascan_perception::view::PoseEvidence;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use std::io::Write;
use std::sync::LazyLock;

/// A packed message of ROS 1, or a record of a bag.
#[derive(Clone, Default)]
struct Packed(Vec<u8>);

impl Packed {
    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: u32) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    fn blob(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).bytes(bytes)
    }

    fn header(self, milliseconds: u32) -> Self {
        self.u32(0).u32(10).u32(milliseconds * 1_000_000).blob(b"camera")
    }

    fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |packed, value| packed.bytes(&value.to_le_bytes()))
    }

    /// A picture of 4 x 3 pixels.
    fn image(milliseconds: u32, encoding: &str, size: u32) -> Vec<u8> {
        let packed = Self::default().header(milliseconds).u32(3).u32(4).blob(encoding.as_bytes()).bytes(&[0]);
        packed.u32(4 * size).blob(&vec![1; 12 * size as usize]).0
    }

    fn calibration() -> Vec<u8> {
        let packed = Self::default().header(0).u32(3).u32(4).blob(b"").u32(0);
        packed.f64s(&[4.0, 0.0, 1.5, 0.0, 4.0, 1.0, 0.0, 0.0, 1.0]).f64s(&[0.0; 21]).bytes(&[0; 25]).0
    }

    fn joint(milliseconds: u32, position: f64) -> Vec<u8> {
        let names = Self::default().header(milliseconds).u32(2).blob(b"wrist").blob(b"table");
        names.u32(2).f64s(&[3.0, position]).u32(0).u32(0).0
    }

    fn transform(milliseconds: u32, x: f64) -> Vec<u8> {
        let packed = Self::default().u32(1).u32(0).u32(10).u32(milliseconds * 1_000_000).blob(b"map").blob(b"camera");
        packed.f64s(&[x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).0
    }
}

/// Topic, type, time in milliseconds and content of each message of a recording of three views.
fn messages() -> Vec<(&'static str, &'static str, u32, Vec<u8>)> {
    let mut messages = vec![("/camera_info", "sensor_msgs/CameraInfo", 0, Packed::calibration())];
    for view in 0..3_u32 {
        let time = 100 * view;
        messages.push(("/tf", "tf2_msgs/TFMessage", time, Packed::transform(time, 0.1 * f64::from(view))));
        let turned = Packed::joint(time, 0.5 * f64::from(view));
        messages.push(("/joint_states", "sensor_msgs/JointState", time, turned));
        messages.push(("/color", "sensor_msgs/Image", time, Packed::image(time, "rgb8", 3)));
        messages.push(("/depth", "sensor_msgs/Image", time + 3, Packed::image(time + 3, "16UC1", 2)));
    }
    messages
}

/// The recording as an MCAP file.
fn mcap(compression: Option<mcap::Compression>) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(300));
    let mut writer = options.create(&mut file).expect("a file");
    let mut channels = std::collections::BTreeMap::new();
    for (topic, kind, time, message) in messages() {
        let channel = *channels.entry(topic).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros1msg", b"").expect("a schema");
            writer.add_channel(schema, topic, "ros1", &Default::default()).expect("a channel")
        });
        let time = u64::from(time) * 1_000_000;
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &message).expect("written");
    }
    writer.finish().expect("finished");
    drop(writer);
    file.into_inner()
}

/// The recording as a ROS 1 bag with one chunk.
fn bag(compression: &str) -> Vec<u8> {
    let record = |fields: &[(&str, &[u8])], data: &[u8]| {
        let fields = fields.iter().map(|(name, value)| [name.as_bytes(), b"=", value].concat());
        let header = fields.fold(Packed::default(), |header, field| header.blob(&field));
        Packed::default().blob(&header.0).blob(data).0
    };
    let mut content = Vec::new();
    let mut topics: Vec<&str> = Vec::new();
    for (topic, kind, time, message) in messages() {
        let known = topics.iter().position(|known| *known == topic);
        let number = known.unwrap_or(topics.len());
        let connection = (number as u32).to_le_bytes();
        if known.is_none() {
            topics.push(topic);
            let about = Packed::default().blob(format!("type={kind}").as_bytes()).0;
            content.extend(record(&[("op", &[7]), ("conn", &connection), ("topic", topic.as_bytes())], &about));
        }
        let time = [10_u32.to_le_bytes(), (time * 1_000_000).to_le_bytes()].concat();
        content.extend(record(&[("op", &[2]), ("conn", &connection), ("time", &time)], &message));
    }
    let size = (content.len() as u32).to_le_bytes();
    let data = match compression {
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            encoder.write_all(&content).expect("compressed");
            encoder.finish().expect("compressed")
        }
        _ => content,
    };
    let chunk = record(&[("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)], &data);
    [b"#ROSBAG V2.0\n", record(&[("op", &[3])], &[b' '; 40]).as_slice(), &chunk].concat()
}

/// The recording as an SQLite file. Its messages are those of ROS 1, which the table of topics says.
fn database() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.db3");
    let database = rusqlite::Connection::open(&path).expect("a database");
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
        )
        .expect("tables");
    for (topic, kind, time, message) in messages() {
        database
            .execute(
                "INSERT INTO topics(name, type, serialization_format) SELECT ?1, ?2, 'ros1'
                 WHERE NOT EXISTS (SELECT 1 FROM topics WHERE name = ?1)",
                [topic, kind],
            )
            .expect("a topic");
        database
            .execute(
                "INSERT INTO messages(topic_id, timestamp, data) SELECT id, ?2, ?3 FROM topics WHERE name = ?1",
                rusqlite::params![topic, i64::from(time) * 1_000_000, message],
            )
            .expect("a message");
    }
    drop(database);
    std::fs::read(path).expect("reads")
}

static VALID: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    vec![
        ("x.mcap", mcap(None)),
        ("y.mcap", mcap(Some(mcap::Compression::Zstd))),
        ("x.bag", bag("none")),
        ("y.bag", bag("bz2")),
        ("x.db3", database()),
    ]
});

/// Every view that there is in a file of these bytes; the error is that of opening it.
fn read(name: &str, bytes: &[u8]) -> Result<Vec<Result<View, SourceError>>, SourceError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    let mut source = RecordingSource::open(&path, OpenOptions::default())?;
    Ok(std::iter::from_fn(|| source.next_view()).collect())
}

#[test]
fn every_container_gives_the_same_views() {
    for (name, bytes) in VALID.iter() {
        let views = read(name, bytes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(views.len(), 3, "{name}");
        for (number, view) in views.into_iter().enumerate() {
            let view = view.expect(name);
            let depth = view.depth.at(1, 1).expect("measured");
            assert!((depth - 0.257).abs() < 1e-6, "{name}: {depth}");
            assert_eq!(view.rgb.get_pixel(0, 0).0, [1; 3]);
            let x = view.pose.table_from_camera().expect("a pose").translation.x;
            // The last depth is 3 ms behind the last transform.
            let expected = 0.1 * (number as f64 + 0.03).min(2.0);
            assert!((x - expected).abs() < 1e-9, "{name}: {x} for {expected}");
        }
    }
}

/// A calibration as `semascan calibrate` writes it.
fn write_calibration(path: &Path, ee_from_camera: Option<Isometry3<f64>>, base_from_tablebase: Option<Isometry3<f64>>) {
    let calibrated = |pose: Isometry3<f64>| CalibratedPose {
        pose: semascan_inspection::record::pose_record(&pose),
        rotation_uncertainty_deg: 0.01,
        place_uncertainty_mm: 0.1,
    };
    let record = CalibrationRecord {
        schema: CALIBRATION_SCHEMA,
        made: None,
        valid_days: None,
        temperature_c: None,
        temperature_range_k: None,
        ee_from_camera: ee_from_camera.map(calibrated),
        base_from_tablebase: base_from_tablebase.map(calibrated),
        captures: Vec::new(),
        warnings: Vec::new(),
    };
    std::fs::write(path, serde_json::to_vec(&record).expect("JSON")).expect("written");
}

#[test]
fn the_angle_of_a_calibrated_table_is_that_of_a_joint() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, calibration) = (folder.path().join("x.mcap"), folder.path().join("calibration.json"));
    std::fs::write(&path, mcap(None)).expect("written");
    let map_from_tablebase = Isometry3::new(Vector3::new(0.3, 0.1, -0.2), Vector3::new(0.1, 0.0, 0.4));
    write_calibration(&calibration, None, Some(map_from_tablebase));
    let open = |joint: &str| {
        let query = format!("calibration={}&table_joint={joint}&base_frame=map", calibration.display());
        let recording = RecordingOptions::default().with_query(&query).expect("options");
        RecordingSource::open(&path, OpenOptions { recording, ..OpenOptions::default() })
    };
    let mut source = open("table").expect("a recording");
    for view in 0..3 {
        // The last depth is 3 ms behind the last reading.
        let at = (f64::from(view) + 0.03).min(2.0);
        let turned = map_from_tablebase * Isometry3::rotation(Vector3::z() * (0.5 * at));
        let expected = turned.inverse() * Isometry3::translation(0.1 * at, 0.0, 0.0);
        let found = source.next_view().expect("a view").expect("a view").pose.table_from_camera().expect("a pose");
        let off = found.inverse() * expected;
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9, "{off}");
    }
    let said = open("tabel").err().expect("no such joint").to_string();
    assert!(said.contains("turntable"), "{said}");
}

#[test]
fn a_capture_of_the_virtual_cell_read_as_anybodys_recording_has_the_same_pictures_and_poses() {
    let cell = "virtual:starter-motor?seed=5&views=3&size=96x72&cell=5";
    let mut cell = VirtualCell::open(&VirtualCellSpec::parse(cell).expect("a source")).expect("a cell");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cell.mcap");
    let info = CaptureInfo::new(cell.info(), None);
    let mut writer = CaptureWriter::create(&path, &info, None).expect("a capture");
    let mut views = Vec::new();
    while let Some(view) = cell.next_view() {
        writer.append(&view, &[]).expect("taken in");
        writer.sync().expect("on the disk");
        views.push(view.expect("a view"));
    }
    writer.finish().expect("finished");
    assert!(!RecordingSource::is_recording(&path), "captures have a reader of their own");
    // The robot and the turntable move, and the part stands still on the table.
    let open = |query: &str| {
        let recording = RecordingOptions::default().with_query(query).expect("options");
        RecordingSource::open(&path, OpenOptions { recording, ..OpenOptions::default() }).expect("a recording")
    };
    // A calibration of its own that has the camera 10 mm off its mount goes before the recorded one.
    let PoseEvidence::Chain { chain, .. } = &views[0].pose else { panic!("a robot's readings") };
    let off = Isometry3::translation(0.0, 0.0, 0.01);
    let calibration = folder.path().join("calibration.json");
    write_calibration(&calibration, Some(chain.ee_from_camera * off), None);
    let mut calibrated = open(&format!("fixed_frame=table&ee_frame=ee&calibration={}", calibration.display()));
    let mut source = open("fixed_frame=table");
    assert_eq!(source.info().view_count, Some(3), "{:?}", source.info().settings);
    for expected in views {
        let moved = calibrated.next_view().expect("a view").expect("a view").pose.table_from_camera().expect("a pose");
        let moved = (expected.pose.table_from_camera().expect("a pose") * off).inverse() * moved;
        assert!(moved.translation.vector.norm() < 1e-9 && moved.rotation.angle() < 1e-9, "{moved}");
        let found = source.next_view().expect("a view").expect("a view");
        assert_eq!((found.intrinsics, &found.rgb, &found.depth), (expected.intrinsics, &expected.rgb, &expected.depth));
        let expected = expected.pose.table_from_camera().expect("a pose");
        let off = found.pose.table_from_camera().expect("a pose").inverse() * expected;
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9, "{off}");
    }
}

#[test]
fn a_recording_that_was_cut_anywhere_is_read_to_there_or_refused_with_its_name() {
    for (name, bytes) in VALID.iter() {
        let mut most = 0;
        for at in (0..=60).map(|i| bytes.len() * i / 60) {
            match read(name, &bytes[..at]) {
                Ok(views) => {
                    let whole = views.into_iter().filter(Result::is_ok).count();
                    assert!(whole >= most || name.ends_with("db3"), "{name} {at}: a longer file has fewer views");
                    most = most.max(whole);
                }
                Err(error) => assert!(error.to_string().contains(name), "{name} {at}: {error}"),
            }
        }
        assert_eq!(most, 3, "{name}");
    }
}

#[test]
fn what_is_no_recording_says_so() {
    let said = |name: &str, bytes: &[u8]| read(name, bytes).expect_err("refused").to_string();
    assert!(said("a.bag", b"#ROSBAG V1.2\n").contains("a.bag"));
    assert!(said("a.db3.zstd", b"\x28\xb5\x2f\xfd").contains("zstd -d"));
    assert!(said("a.mcap", &mcap(None)[..60]).contains("no pictures at all"));
    let folder = tempfile::tempdir().expect("a folder");
    assert!(!RecordingSource::is_recording(folder.path()));
    let path = folder.path().join("x.db3");
    let database = rusqlite::Connection::open(&path).expect("a database");
    // A view in the place of the table would run whatever its maker likes.
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);
             CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n)
                 SELECT id, 1 AS topic_id, 1 AS timestamp, zeroblob(1000000) AS data FROM n;",
        )
        .expect("tables");
    drop(database);
    let said = RecordingSource::open(&path, OpenOptions::default()).err().expect("no table").to_string();
    assert!(said.contains("\"messages\""), "{said}");
}

#[test]
fn options_are_those_of_recordings_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.bag");
    std::fs::write(&path, &VALID[2].1).expect("written");
    let open = |query: &str| crate::open(&format!("{}?{query}", path.display()), OpenOptions::default());
    assert_eq!(open("shift_mm=0").expect("a recording").info().view_count, Some(3));
    let halved = OpenOptions { every: 2, ..OpenOptions::default() };
    assert_eq!(crate::open(&path.display().to_string(), halved).expect("a recording").info().view_count, Some(2));
    let said = |query: &str| open(query).err().expect("refused").to_string();
    assert!(said("shift_m=2").contains("shift_mm"));
    assert!(said("fixed_frame=table").contains("\"table\""));
    assert!(said("depth=/nothing").contains("/depth (depth)"));
    let scene = folder.path().join("scene");
    std::fs::create_dir(&scene).expect("a folder");
    std::fs::write(scene.join("scene_camera.json"), "{}").expect("written");
    let refused =
        crate::open(&format!("{}?shift_mm=2", scene.display()), OpenOptions::default()).err().expect("no options");
    assert!(refused.to_string().contains("device= alone"), "{refused}");
}

#[test]
fn the_depth_camera_that_is_named_gives_unit_and_range() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.bag");
    std::fs::write(&path, &VALID[2].1).expect("written");
    let open = |device: &str| crate::open(&format!("{}?device={device}", path.display()), OpenOptions::default());
    // Every depth is 257.
    let mut azure = open("azure-kinect").expect("a recording");
    let view = azure.next_view().expect("a view").expect("is good");
    assert!(view.depth.metres.iter().all(|z| (z - 0.257).abs() < 1e-6));
    let settings = &azure.info().settings;
    assert!(settings.iter().any(|(name, said)| name == "depth_camera" && said.contains("0.25 to 6 m")), "{settings:?}");
    assert!(azure.info().uri.ends_with("?device=azure-kinect"));
    let far = open("kinect").expect("a recording").next_view().expect("a view").expect_err("too near").to_string();
    assert!(far.contains("no depth") && far.contains("measures 0.4 to 10 m"), "{far}");
    let unknown = open("toaster").err().expect("no such camera").to_string();
    assert!(unknown.contains("device=toaster") && unknown.contains("zivid"), "{unknown}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn damaged_recordings_are_read_to_their_damage_or_refused(
        which in any::<prop::sample::Index>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let (name, bytes) = &VALID[which.index(VALID.len())];
        let mut bytes = bytes.clone();
        damage.iter().for_each(|(at, byte)| { let at = at.index(bytes.len()); bytes[at] = *byte; });
        if is_cut {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        match read(name, &bytes) {
            Ok(views) => {
                prop_assert!(views.len() <= 3);
                for view in views.into_iter().flatten() {
                    prop_assert_eq!(view.check_sizes(), Ok(()));
                }
            }
            Err(error) => prop_assert!(error.to_string().contains(name), "{error}"),
        }
    }
}
