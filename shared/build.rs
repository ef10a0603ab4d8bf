//! Compiles the public wire contract (`src/wire/proto/*.proto`) with a pure-Rust compiler: no protoc needed.

use std::io::Error;

fn main() -> Result<(), Error> {
    println!("cargo:rerun-if-changed=src/wire/proto");
    let descriptors = protox::compile(["semascan.proto"], ["src/wire/proto"]).map_err(Error::other)?;
    prost_build::Config::new().bytes([".semascan.v1.ChunkUpdate.columns"]).compile_fds(descriptors)
}
