//! GenICam cameras, over GigE Vision and USB3 Vision, by aravis: `genicam:NAME`, a name as `arv-tool` lists it.
//!
//! A 3D camera sends colours and range as components of one frame; or a second camera measures depth beside the first
//! (`genicam:COLOR?depth=DEPTH&cameras=FOLDER`). Only with the feature `aravis` are there cameras: without it, everything else is
//! built and tested all the same.
//!
//! | file | what |
//! |---|---|
//! | `options.rs` | what stands behind the `?` |
//! | `pixels.rs` | pixel formats: colours and range out of their bytes |
//! | `camera.rs` | the camera (feature `aravis`) |

#[cfg(feature = "aravis")]
mod camera;
mod options;
mod pixels;

#[cfg(feature = "aravis")]
pub use camera::GenicamCamera;
pub use options::{GenicamOptions, KEYS};
pub use pixels::{PixelFormat, Range};

use semascan_inspection::source::{Source, SourceError};
use semascan_sources::OpenOptions;

/// What an address of such a camera begins with.
const SCHEME: &str = "genicam:";

/// Whether `uri` is the address of one.
pub fn is_address(uri: &str) -> bool {
    uri.starts_with(SCHEME)
}

/// Opens the camera at `uri`, as `genicam:Basler-22334455?exposure_us=8000`.
///
/// # Errors
/// [`SourceError::Uri`] if this build has no aravis, the camera does not answer, or an option cannot be used.
pub fn open(uri: &str, options: impl Into<OpenOptions>) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: uri.to_owned(), reason };
    let wanted = GenicamOptions::read(uri.trim_start_matches(SCHEME)).map_err(refuse)?;
    connect(uri, wanted, &options.into())
}

#[cfg(feature = "aravis")]
fn connect(uri: &str, wanted: GenicamOptions, options: &OpenOptions) -> Result<Box<dyn Source>, SourceError> {
    use semascan_sources::camera::{CameraSource, read_calibration};
    let calibration = wanted.cameras.as_deref().map(read_calibration).transpose()?;
    let timing = wanted.timing.clone();
    let intrinsics = options.intrinsics;
    let connect = move || Ok(Box::new(GenicamCamera::connect(&wanted, calibration.as_ref(), intrinsics)?) as _);
    Ok(Box::new(CameraSource::open(uri, timing, options, connect)?))
}

#[cfg(not(feature = "aravis"))]
fn connect(uri: &str, _: GenicamOptions, _: &OpenOptions) -> Result<Box<dyn Source>, SourceError> {
    let reason = "this build has no GenICam cameras: build it with `--features genicam`, where aravis is installed \
                  (Debian: libaravis-dev, libusb-1.0-0-dev)";
    Err(SourceError::Uri { uri: uri.to_owned(), reason: reason.to_owned() })
}
