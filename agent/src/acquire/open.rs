//! From a source's URI or path to the source.

use super::bop::{BopSource, CameraMask};
use super::pcd::PcdSource;
use super::virtual_cell::{VirtualCell, VirtualCellSpec};
use super::{AcquireError, Source};
use std::path::Path;

/// Opens what `uri` names: `virtual:...`, a BOP scene folder, or organized clouds in a PCD file or a folder of them.
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
    if PcdSource::is_source(path) {
        return Ok(Box::new(PcdSource::open(path)?));
    }
    Err(refuse("neither a BOP scene folder (no scene_camera.json in it) nor PCD files"))
}
