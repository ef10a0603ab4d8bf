//! Captured views in MCAP files (<https://mcap.dev>), so that an inspection can be done again, continued after a crash, and
//! looked at in Foxglove.
//!
//! Colour (`rgb8`), depth (`32FC1`, metres), calibration and transforms are messages of Foxglove's schemas; what these
//! cannot say (exact pose evidence, labels, uncertainty, truth) has schemas of our own, `proto/capture.proto`. Views come
//! back bit for bit.
//!
//! | file | what |
//! |---|---|
//! | `info.rs` | what the source of the views is: the file's metadata |
//! | `encode.rs`, `decode.rs` | a view to messages and back |
//! | `channel.rs` | topics and their schemas |
//! | `writer.rs` | a capture that is written, on the disk after each view |
//! | `reader.rs` | a capture that is read, to its last whole view; one view of it |

mod channel;
mod decode;
mod encode;
mod info;
mod reader;
mod writer;

pub use info::CaptureInfo;
pub use reader::{CaptureEnd, CaptureError, CaptureReader, RecordedView, Wanted};
pub use writer::CaptureWriter;

/// Messages of the schemas in `proto/`, as prost generates them.
#[allow(missing_docs, unreachable_pub, clippy::all)]
pub mod schema {
    /// Ours.
    pub mod capture {
        include!(concat!(env!("OUT_DIR"), "/semascan.capture.v1.rs"));
    }
}
