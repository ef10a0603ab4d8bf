//! Compiles Foxglove's schemas (`proto/`) with a pure-Rust compiler, and writes the descriptors by which any reader can decode a
//! message.

use prost::Message;
use std::io::Error;
use std::path::Path;

/// The schemas of whole messages; what they are made of is imported by them.
const FILES: [&str; 8] = [
    "foxglove/CameraCalibration.proto",
    "foxglove/CompressedImage.proto",
    "foxglove/FrameTransform.proto",
    "foxglove/FrameTransforms.proto",
    "foxglove/Log.proto",
    "foxglove/PointCloud.proto",
    "foxglove/RawImage.proto",
    "foxglove/SceneUpdate.proto",
];

fn main() -> Result<(), Error> {
    println!("cargo:rerun-if-changed=proto");
    let out = std::env::var_os("OUT_DIR").ok_or_else(|| Error::other("cargo names no OUT_DIR"))?;
    for file in FILES {
        let mut compiler = protox::Compiler::new(["proto"]).map_err(Error::other)?;
        compiler.include_source_info(false).include_imports(true).open_file(file).map_err(Error::other)?;
        let name = Path::new(file).with_extension("bin");
        let name = name.file_name().unwrap_or_default();
        std::fs::write(Path::new(&out).join(name), compiler.file_descriptor_set().encode_to_vec())?;
    }
    let descriptors = protox::compile(FILES, ["proto"]).map_err(Error::other)?;
    prost_build::Config::new().compile_fds(descriptors)
}
