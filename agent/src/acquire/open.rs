//! From a source's URI or path to the source.

use super::bop::{BopSource, CameraMask};
use super::virtual_cell::{VirtualCell, VirtualCellSpec};
use super::{AcquireError, Source};
use std::path::Path;

/// Opens what `uri` names: `virtual:...` or a BOP scene folder.
///
/// # Errors
/// [`AcquireError`] if the source is unknown or cannot be opened.
pub fn open(uri: &str, mask: &CameraMask) -> Result<Box<dyn Source>, AcquireError> {
    let refuse = |reason: &str| AcquireError::Uri { uri: uri.into(), reason: reason.into() };
    if uri.starts_with("virtual:") {
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(uri)?)?));
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        return Err(refuse(&format!("no source speaks {scheme}://")));
    }
    let path = Path::new(uri);
    if !path.exists() {
        return Err(refuse("no such file or folder"));
    }
    if BopSource::is_scene(path) {
        return Ok(Box::new(BopSource::open(path, mask)?));
    }
    Err(refuse("not a BOP scene folder (no scene_camera.json in it)"))
}
