//! RealSense cameras (D400, L515) without ROS: `realsense:`, or `realsense:SERIAL` where several are plugged in.
//!
//! librealsense2 is loaded when such a camera is opened, so that nobody else needs it. Colour and depth come as the camera takes
//! them; what is a view of them is the business of [`CameraSource`], as of every camera.
//!
//! | file | what |
//! |---|---|
//! | `library/` | the functions of librealsense2, and objects that are safe to use: the one place with unsafe code |
//! | `streams.rs` | which of a camera's streams are taken |
//! | `camera.rs` | the camera |
//! | `options.rs` | what stands behind the `?` |

mod camera;
pub mod library;
mod options;
mod streams;

pub use camera::RealsenseCamera;
pub use options::{KEYS, RealsenseOptions};

use library::{Context, Devices, Library};
use semascan_inspection::source::{Source, SourceError};
use semascan_sources::OpenOptions;
use semascan_sources::camera::CameraSource;
use std::sync::Arc;

/// What an address of such a camera begins with.
const SCHEME: &str = "realsense:";

/// Whether `uri` is the address of one.
pub fn is_address(uri: &str) -> bool {
    uri.starts_with(SCHEME)
}

/// Opens the camera at `uri`, as `realsense:`, `realsense:SERIAL`, `realsense://SERIAL?exposure_us=8000`.
///
/// # Errors
/// [`SourceError::Uri`] if librealsense2 is not installed, the camera is not plugged in or an option cannot be used.
pub fn open(uri: &str, options: impl Into<OpenOptions>) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: uri.to_owned(), reason };
    let wanted = RealsenseOptions::read(uri.trim_start_matches(SCHEME)).map_err(refuse)?;
    let library = Library::find().map_err(|error| refuse(error.to_string()))?;
    let context = Context::new(&library).map_err(|error| refuse(error.to_string()))?;
    Ok(Box::new(open_in(Arc::new(context), uri, &wanted, &options.into())?))
}

/// Opens a camera among `devices`.
///
/// # Errors
/// As [`open`].
pub fn open_in(
    devices: Arc<dyn Devices>,
    uri: &str,
    wanted: &RealsenseOptions,
    options: &OpenOptions,
) -> Result<CameraSource, SourceError> {
    if options.intrinsics.is_some() {
        let reason = "the camera says itself what its lenses are: no others can be given".to_owned();
        return Err(SourceError::Uri { uri: uri.to_owned(), reason });
    }
    let own = wanted.clone();
    let connect = move || Ok(Box::new(RealsenseCamera::connect(&devices, &own)?) as _);
    CameraSource::open(uri, wanted.timing.clone(), options, connect)
}
