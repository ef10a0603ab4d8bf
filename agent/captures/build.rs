//! Compiles the schemas of the messages (`proto/`) with a pure-Rust compiler, and writes the descriptors that each capture
//! carries so that any reader of MCAP can decode it.

use prost::Message;
use std::io::Error;
use std::path::Path;

/// Our own messages; the others are Foxglove's.
const FILE: &str = "capture.proto";

fn main() -> Result<(), Error> {
    println!("cargo:rerun-if-changed=proto");
    let out = std::env::var_os("OUT_DIR").ok_or_else(|| Error::other("cargo names no OUT_DIR"))?;
    let mut compiler = protox::Compiler::new(["proto"]).map_err(Error::other)?;
    compiler.include_source_info(false).include_imports(true).open_file(FILE).map_err(Error::other)?;
    std::fs::write(Path::new(&out).join("capture.bin"), compiler.file_descriptor_set().encode_to_vec())?;
    let descriptors = protox::compile([FILE], ["proto"]).map_err(Error::other)?;
    prost_build::Config::new().compile_fds(descriptors)
}
