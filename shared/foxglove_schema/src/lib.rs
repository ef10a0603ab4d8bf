//! Messages of Foxglove's schemas (<https://docs.foxglove.dev/docs/sdk/schemas>), as prost generates them from `proto/`, and the
//! `FileDescriptorSet` of each, by which any reader can decode them.

pub use generated::*;

#[allow(missing_docs, unreachable_pub, clippy::all)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}

/// A message type by its full name, with the descriptors that define it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Its full name.
    pub name: &'static str,
    /// The `FileDescriptorSet` that defines it, imports included.
    pub descriptors: &'static [u8],
}

macro_rules! schema {
    ($constant:ident, $name:literal) => {
        #[doc = concat!("`foxglove.", $name, "`.")]
        pub const $constant: Schema = Schema {
            name: concat!("foxglove.", $name),
            descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".bin")),
        };
    };
}

schema!(CAMERA_CALIBRATION, "CameraCalibration");
schema!(COMPRESSED_IMAGE, "CompressedImage");
schema!(FRAME_TRANSFORM, "FrameTransform");
schema!(FRAME_TRANSFORMS, "FrameTransforms");
schema!(LOG, "Log");
schema!(POINT_CLOUD, "PointCloud");
schema!(RAW_IMAGE, "RawImage");
schema!(SCENE_UPDATE, "SceneUpdate");
