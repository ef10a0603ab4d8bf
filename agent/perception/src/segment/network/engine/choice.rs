//! Which engine runs the networks.

use super::interface::{Engine, EngineError, Provider};
use super::onnx_runtime::OnnxRuntime;
#[cfg(feature = "tract")]
use super::tract::Tract;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Which engine is to be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineChoice {
    /// ONNX Runtime where it is found, else tract where it is built in, said aloud.
    #[default]
    Auto,
    /// ONNX Runtime or none.
    OnnxRuntime,
    /// tract, which only builds with the feature `tract` have.
    Tract,
}

/// Whether this build has tract.
pub const HAS_TRACT: bool = cfg!(feature = "tract");

#[cfg(feature = "tract")]
fn tract(provider: Provider) -> Result<Box<dyn Engine>, EngineError> {
    match provider {
        Provider::Cpu => Ok(Box::new(Tract)),
        _ => Err(EngineError::Provider { provider, reason: "tract computes on the processor only".into() }),
    }
}

#[cfg(not(feature = "tract"))]
fn tract(_provider: Provider) -> Result<Box<dyn Engine>, EngineError> {
    Err(EngineError::NotBuilt("tract"))
}

/// Opens the engine that was chosen. `library` is where the configuration says ONNX Runtime lies.
///
/// # Errors
/// [`EngineError`] if it cannot be had: an explicitly named library that does not load is never passed over.
pub fn open(choice: EngineChoice, library: Option<&Path>, provider: Provider) -> Result<Box<dyn Engine>, EngineError> {
    match choice {
        EngineChoice::Tract => tract(provider),
        EngineChoice::OnnxRuntime => Ok(Box::new(OnnxRuntime::open(library, provider)?)),
        EngineChoice::Auto => match OnnxRuntime::open(library, provider) {
            Ok(runtime) => Ok(Box::new(runtime)),
            Err(error @ EngineError::NotFound { .. }) if HAS_TRACT => {
                let engine = tract(provider)?;
                tracing::warn!("{error}; networks run in tract, several times slower");
                Ok(engine)
            }
            Err(error) => Err(error),
        },
    }
}
