//! From a source's URI or path to the source.

use crate::bop::BopSource;
use crate::pcd::PcdSource;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::CameraMask;
use std::path::Path;

/// Opens what `uri` names: a BOP scene folder, or organized clouds in a PCD file or a folder of them.
///
/// # Errors
/// [`SourceError`] if the source is unknown or cannot be opened.
pub fn open(uri: &str, mask: &CameraMask) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: &str| SourceError::Uri { uri: uri.into(), reason: reason.into() };
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
