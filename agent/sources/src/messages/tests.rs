//! Decoders of messages against arbitrary and damaged bytes: they refuse or decode, and what they give is bounded.

use super::*;
use proptest::prelude::*;

/// A packed message being written; CDR's alignment is followed where asked for.
struct Written {
    bytes: Vec<u8>,
    aligned: bool,
}

impl Written {
    fn new(aligned: bool) -> Self {
        Self { bytes: Vec::new(), aligned }
    }

    fn number(mut self, bytes: &[u8]) -> Self {
        while self.aligned && !self.bytes.len().is_multiple_of(bytes.len()) {
            self.bytes.push(0);
        }
        self.bytes.extend(bytes);
        self
    }

    fn u32(self, value: u32) -> Self {
        self.number(&value.to_le_bytes())
    }

    fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |written, value| written.number(&value.to_le_bytes()))
    }

    fn text(self, text: &str) -> Self {
        let terminated = if self.aligned { format!("{text}\0") } else { text.to_owned() };
        self.blob(terminated.as_bytes())
    }

    fn blob(self, bytes: &[u8]) -> Self {
        let mut written = self.u32(bytes.len() as u32);
        written.bytes.extend(bytes);
        written
    }

    fn header(self) -> Self {
        let written = if self.aligned { self } else { self.u32(9) };
        written.u32(12).u32(500_000_000).text("camera")
    }

    fn finish(self) -> (Encoding, Vec<u8>) {
        if self.aligned {
            return (Encoding::Cdr, [&[0, 1, 0, 0][..], &self.bytes].concat());
        }
        (Encoding::Ros1, self.bytes)
    }
}

/// A valid message of each kind in both encodings of ROS, and some of Foxglove.
fn valid() -> Vec<(Kind, Encoding, Vec<u8>)> {
    let mut messages = Vec::new();
    for aligned in [false, true] {
        let new = || Written::new(aligned).header();
        let pose = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0];
        let transform = |written: Written| written.header().text("tool").f64s(&pose);
        let written = [
            (Kind::Image, new().u32(2).u32(2).text("rgb8").number(&[0]).u32(6).blob(&[7; 12])),
            (Kind::CompressedImage, new().text("16UC1; compressedDepth png").blob(&[1; 40])),
            (
                Kind::Calibration,
                new().u32(2).u32(2).text("plumb_bob").u32(2).f64s(&[0.1, 0.2]).f64s(&[1.0; 9]).f64s(&[1.0; 21]),
            ),
            (Kind::Transform, transform(Written::new(aligned))),
            (Kind::Transforms, transform(transform(Written::new(aligned).u32(2)))),
            (Kind::JointStates, new().u32(1).text("table").u32(1).f64s(&[1.5]).u32(0).u32(0)),
            (
                Kind::PointCloud,
                ["x", "y", "z"]
                    .iter()
                    .enumerate()
                    .fold(new().u32(1).u32(2).u32(3), |written, (i, name)| {
                        written.text(name).u32(4 * i as u32).number(&[7]).u32(1)
                    })
                    .number(&[0])
                    .u32(12)
                    .u32(24)
                    .blob(&[0; 24]),
            ),
            (Kind::Text, Written::new(aligned).text("depth_units=0.001;")),
        ];
        messages.extend(written.into_iter().map(|(kind, written)| {
            let (encoding, bytes) = written.finish();
            (kind, encoding, bytes)
        }));
    }
    let json = |kind, text: &str| (kind, Encoding::Json, text.as_bytes().to_vec());
    messages.push(json(
        Kind::Image,
        r#"{"timestamp":{"sec":12,"nsec":500000000},"frame_id":"camera","width":2,"height":2,"encoding":"mono8",
            "step":2,"data":"AQIDBA=="}"#,
    ));
    messages.push(json(
        Kind::Transform,
        r#"{"parent_frame_id":"a","child_frame_id":"b","translation":{"x":1,"y":2,"z":3},
            "rotation":{"x":0,"y":0,"z":0,"w":1}}"#,
    ));
    messages
        .push(json(Kind::Calibration, r#"{"frame_id":"camera","width":2,"height":2,"K":[1,0,1,0,1,1,0,0,1],"D":[]}"#));
    messages
}

/// Bytes that a message takes once it is decoded.
fn size(message: &Message) -> usize {
    match message {
        Message::Color(picture) => picture.rgb.as_raw().len(),
        Message::Depth(picture) => 4 * picture.width as usize * picture.height as usize,
        Message::Cloud(cloud) => 15 * cloud.positions.len(),
        Message::Calibration(calibration) => 8 * calibration.distortion.len() + calibration.distortion_model.len(),
        Message::Transforms(transforms) => size_of::<StampedTransform>() * transforms.len(),
        Message::Joints(joints) => 32 * joints.positions.len(),
        Message::Text(text) => text.len(),
    }
}

#[test]
fn valid_messages_are_decoded_alike_in_every_encoding() {
    for (kind, encoding, bytes) in valid() {
        if kind == Kind::CompressedImage {
            continue;
        }
        let message = decode(kind, encoding, &bytes).unwrap_or_else(|error| panic!("{kind:?} {encoding:?}: {error}"));
        match message {
            Message::Color(picture) => {
                assert_eq!(
                    (picture.header.stamp, picture.header.frame.as_str()),
                    (Stamp::new(12, 500_000_000), "camera")
                );
            }
            Message::Calibration(calibration) => assert_eq!((calibration.width, calibration.k[0]), (2, 1.0)),
            Message::Transforms(transforms) => {
                assert!((transforms[0].parent_from_child.translation.vector.norm() > 0.3));
            }
            Message::Joints(joints) => assert_eq!(joints.positions, [("table".to_owned(), 1.5)]),
            Message::Cloud(cloud) => assert_eq!(cloud.positions, [[0.0; 3]; 2]),
            Message::Text(text) => assert!(text.starts_with("depth_units")),
            Message::Depth(_) => panic!("no depth among them"),
        }
    }
}

#[test]
fn types_are_known_by_their_names() {
    assert_eq!(of_channel("sensor_msgs/msg/Image", "cdr"), Some((Kind::Image, Encoding::Cdr)));
    assert_eq!(of_channel("sensor_msgs/Image", "ros1"), Some((Kind::Image, Encoding::Ros1)));
    assert_eq!(of_channel("foxglove.FrameTransforms", "protobuf"), Some((Kind::Transforms, Encoding::Protobuf)));
    assert_eq!(of_channel("foxglove.RawImage", "json"), Some((Kind::Image, Encoding::Json)));
    assert_eq!(of_channel("foxglove.RawImage", "cdr"), None);
    assert_eq!(of_channel("std_msgs/msg/Float64", "cdr"), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn any_bytes_are_decoded_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400), cdr in any::<bool>()) {
        let message = if cdr { [&[0, 1, 0, 0][..], &bytes].concat() } else { bytes };
        for kind in Kind::ALL {
            for encoding in Encoding::ALL {
                if let Ok(decoded) = decode(kind, encoding, &message) {
                    prop_assert!(size(&decoded) <= 100 * message.len(), "{kind:?} {encoding:?}");
                }
            }
        }
    }

    #[test]
    fn damaged_messages_are_decoded_or_refused(
        which in any::<prop::sample::Index>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let valid = valid();
        let (kind, encoding, mut bytes) = valid[which.index(valid.len())].clone();
        for (at, byte) in damage {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        if let Ok(decoded) = decode(kind, encoding, &bytes) {
            prop_assert!(size(&decoded) <= 100 * bytes.len(), "{kind:?} {encoding:?}");
        }
    }
}
