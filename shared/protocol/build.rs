//! Compiles the public wire contract (`proto/*.proto`) with a pure-Rust compiler: no protoc needed.

use std::io::Error;

/// Fields whose bytes are shared with the message that they came in, not copied.
const SHARED: [&str; 3] =
    [".semascan.v1.ChunkUpdate.columns", ".semascan.v1.FileMessage.message", ".semascan.v1.FileAnswer.body"];

fn main() -> Result<(), Error> {
    println!("cargo:rerun-if-changed=proto");
    let descriptors = protox::compile(["semascan.proto", "inspection_file.proto"], ["proto"]).map_err(Error::other)?;
    prost_build::Config::new().bytes(SHARED).compile_fds(descriptors)
}
