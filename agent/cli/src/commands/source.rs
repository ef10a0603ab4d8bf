//! From a source's URI or path to the source: what this binary was built with.

use semascan_inspection::source::{AcquireError, Source};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_sources::bop::CameraMask;

/// Opens what `uri` names: `virtual:...`, or what [`semascan_sources::open`] knows.
///
/// # Errors
/// [`AcquireError`] if the source is unknown or cannot be opened.
pub(crate) fn open(uri: &str, mask: &CameraMask) -> Result<Box<dyn Source>, AcquireError> {
    if uri.starts_with("virtual:") {
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(uri)?)?));
    }
    semascan_sources::open(uri, mask)
}
