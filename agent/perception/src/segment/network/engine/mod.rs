//! What runs networks, behind one trait: ONNX Runtime, or tract where this was built with it (feature `tract`).

mod choice;
mod interface;
mod locate;
mod onnx_runtime;
#[cfg(feature = "tract")]
mod tract;
mod trusted;

pub use choice::{EngineChoice, HAS_TRACT, open};
pub use interface::{Element, Engine, EngineDescription, EngineError, Network, Port, Provider, Tensor};
pub use locate::{Found, candidates};
pub use onnx_runtime::OnnxRuntime;
#[cfg(feature = "tract")]
pub use tract::Tract;
