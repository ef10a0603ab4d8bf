//! From a source's URI or path to the source: what this binary was built with.

use clap::ValueEnum;
use semascan_formats::unit::Unit;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::CameraMask;
#[cfg(feature = "demo")]
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// A unit of length as the command line takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LengthUnit {
    /// Millimetres
    Mm,
    /// Centimetres
    Cm,
    /// Metres
    M,
    /// Inches
    Inch,
}

impl LengthUnit {
    fn unit(self) -> Unit {
        match self {
            Self::Mm => Unit::Millimetres,
            Self::Cm => Unit::Centimetres,
            Self::M => Unit::Metres,
            Self::Inch => Unit::Inches,
        }
    }

    /// One of it in metres.
    #[cfg(feature = "demo")]
    pub(crate) fn in_metres(self) -> f64 {
        self.unit().in_metres()
    }

    /// The source `uri` with its key `unit` set to this.
    pub(crate) fn of_source(self, uri: &str) -> String {
        let separator = if uri.contains('?') { '&' } else { '?' };
        format!("{uri}{separator}unit={}", self.unit().name())
    }
}

/// Opens what `uri` names: `virtual:...`, or what [`semascan_sources::open`] knows.
///
/// # Errors
/// [`SourceError`] if the source is unknown or cannot be opened.
pub(crate) fn open(uri: &str, mask: &CameraMask) -> Result<Box<dyn Source>, SourceError> {
    #[cfg(feature = "demo")]
    if uri.starts_with("virtual:") {
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(uri)?)?));
    }
    semascan_sources::open(uri, mask)
}
