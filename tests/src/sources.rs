//! Sources by their URI, as the command line opens them.

use anyhow::Result;
use semascan_inspection::source::Source;
use semascan_inspection::spec::CameraMask;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// Opens `uri`: a source of the virtual cell, or a recorded one whose camera mask is found.
///
/// # Errors
/// If there is no such source.
pub fn open(uri: &str) -> Result<Box<dyn Source>> {
    if uri.starts_with("virtual:") {
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(uri)?)?));
    }
    Ok(semascan_sources::open(uri, &CameraMask::Auto)?)
}
