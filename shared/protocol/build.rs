//! Compiles the public wire contract (`proto/*.proto`) with a pure-Rust compiler: no protoc needed.

use std::io::Error;

fn main() -> Result<(), Error> {
    println!("cargo:rerun-if-changed=proto");
    let descriptors = protox::compile(["semascan.proto"], ["proto"]).map_err(Error::other)?;
    prost_build::Config::new().bytes([".semascan.v1.ChunkUpdate.columns"]).compile_fds(descriptors)
}
