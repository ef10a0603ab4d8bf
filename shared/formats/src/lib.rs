//! File formats, read and written without a file system, natively and for wasm32.

pub mod export;
pub mod import;
