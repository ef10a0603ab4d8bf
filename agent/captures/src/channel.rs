//! Topics of a capture and the schemas of their messages.

use semascan_foxglove::schema::{CAMERA_CALIBRATION, FRAME_TRANSFORM, RAW_IMAGE, Schema};

/// A topic and what its messages are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Topic {
    /// Its name.
    pub(crate) name: &'static str,
    /// Full name of the message type.
    pub(crate) schema: &'static str,
    /// The `FileDescriptorSet` that defines it.
    pub(crate) descriptors: &'static [u8],
}

const CAPTURE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/capture.bin"));

/// A topic with messages of a schema of Foxglove's.
const fn foxglove(name: &'static str, schema: Schema) -> Topic {
    Topic { name, schema: schema.name, descriptors: schema.descriptors }
}

/// Colour pictures.
pub(crate) const COLOR: Topic = foxglove("/camera/color", RAW_IMAGE);
/// Depth pictures.
pub(crate) const DEPTH: Topic = foxglove("/camera/depth", RAW_IMAGE);
/// The camera, for colour and depth alike.
pub(crate) const CALIBRATION: Topic = foxglove("/camera/calibration", CAMERA_CALIBRATION);
/// Poses between the frames.
pub(crate) const TRANSFORM: Topic = foxglove("/tf", FRAME_TRANSFORM);
/// Labels that came with the views.
pub(crate) const LABELS: Topic = Topic { name: "/labels", schema: "semascan.capture.v1.Labels", descriptors: CAPTURE };
/// The end of each view.
pub(crate) const VIEW: Topic = Topic { name: "/view", schema: "semascan.capture.v1.View", descriptors: CAPTURE };
/// Labels and uncertainty that the inspection gave the pixels.
pub(crate) const SEGMENTATION: Topic =
    Topic { name: "/segmentation", schema: "semascan.capture.v1.Segmentation", descriptors: CAPTURE };
/// The true surface.
pub(crate) const TRUTH: Topic = Topic { name: "/truth", schema: "semascan.capture.v1.Truth", descriptors: CAPTURE };

/// Every topic.
pub(crate) const TOPICS: [Topic; 8] = [COLOR, DEPTH, CALIBRATION, TRANSFORM, LABELS, VIEW, SEGMENTATION, TRUTH];
