//! From a source's URI or path to the source: what this binary was built with.

use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::InspectionSpec;
#[cfg(feature = "demo")]
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// Opens what `uri` names for an inspection as `spec` says: `virtual:...`, or what [`semascan_sources::open`] knows.
///
/// # Errors
/// [`SourceError`] if the source is unknown or cannot be opened.
pub(crate) fn open(uri: &str, spec: &InspectionSpec) -> Result<Box<dyn Source>, SourceError> {
    #[cfg(feature = "demo")]
    if uri.starts_with("virtual:") {
        // A mesh that is put on the turntable names no unit: the cell's key does.
        let unit =
            spec.source.unit.map(|unit| format!("{}unit={}", if uri.contains('?') { '&' } else { '?' }, unit.name()));
        let uri = format!("{uri}{}", unit.unwrap_or_default());
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(&uri)?)?));
    }
    semascan_sources::open(uri, spec)
}
