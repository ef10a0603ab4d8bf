//! PCD (Point Cloud Library, *The PCD file format*, version 0.7): point clouds, ascii, binary and binary_compressed,
//! organized or not. Read only.

mod header;
mod lzf;
mod read;

pub use header::Viewpoint;
#[cfg(not(target_arch = "wasm32"))]
pub use read::read_file;
pub use read::{PcdCloud, read};

#[cfg(test)]
mod tests;
