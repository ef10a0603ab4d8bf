//! What every engine provides: it loads networks, and they run on tensors.

pub use semascan_model::record::{EngineDescription, Provider};
use std::fmt::Debug;
use std::path::{Path, PathBuf};

/// Numbers with a shape, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor {
    /// Length of each dimension.
    pub shape: Vec<usize>,
    /// As many values as the shape says.
    pub data: Vec<f32>,
}

/// Type of a tensor's numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Element {
    /// Single precision.
    F32,
    /// Half precision; converted on the way in and out.
    F16,
    /// Another, by its name.
    Other(String),
}

/// An input or output of a network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Its name in the graph.
    pub name: String,
    /// Type of its numbers.
    pub element: Element,
    /// Its dimensions where the graph fixes them; `None` where not even their number is known.
    pub shape: Option<Vec<Option<usize>>>,
}

/// A loaded network.
pub trait Network: Send {
    /// Its inputs.
    fn inputs(&self) -> &[Port];

    /// Its outputs.
    fn outputs(&self) -> &[Port];

    /// Runs it on `input`, the tensor of its one input, and gives the outputs called `wanted`, in that order. Whole
    /// numbers come as f32.
    ///
    /// # Errors
    /// [`EngineError::Run`] if it does not run, or has no such output.
    fn run(&mut self, input: &Tensor, wanted: &[&str]) -> Result<Vec<Tensor>, EngineError>;
}

/// What loads networks.
pub trait Engine: Debug + Send + Sync {
    /// What it is.
    fn description(&self) -> EngineDescription;

    /// Loads an `.onnx` file, to be run with at most `threads` threads of its own.
    ///
    /// # Errors
    /// [`EngineError::Load`] naming the file.
    fn load(&self, file: &Path, threads: usize) -> Result<Box<dyn Network>, EngineError>;
}

/// Runs the pictures of a batch one after the other and joins their outputs.
pub(super) fn one_by_one(
    batch: &Tensor,
    mut run: impl FnMut(&Tensor) -> Result<Vec<Tensor>, EngineError>,
) -> Result<Vec<Tensor>, EngineError> {
    let (&[count, ref rest @ ..], 4) = (batch.shape.as_slice(), batch.shape.len()) else { return run(batch) };
    let mut joined: Vec<Tensor> = Vec::new();
    for picture in batch.data.chunks_exact((batch.data.len() / count.max(1)).max(1)) {
        let outputs = run(&Tensor { shape: [&[1], rest].concat(), data: picture.to_vec() })?;
        if joined.is_empty() {
            joined = outputs;
            continue;
        }
        for (all, output) in joined.iter_mut().zip(outputs) {
            all.data.extend(output.data);
            if let Some(n) = all.shape.first_mut() {
                *n += 1;
            }
        }
    }
    Ok(joined)
}

/// Why networks cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// ONNX Runtime is not there.
    #[error("ONNX Runtime was not found; looked for it in {}", list(looked_in))]
    NotFound {
        /// Where.
        looked_in: Vec<PathBuf>,
    },
    /// ONNX Runtime is there but cannot be used.
    #[error("ONNX Runtime from {} ({from}): {reason}", path.display())]
    Library {
        /// The library.
        path: PathBuf,
        /// What named it.
        from: &'static str,
        /// Why.
        reason: String,
    },
    /// The engine is not part of this build.
    #[error("this build has no {0}: build it with the feature `{0}`")]
    NotBuilt(&'static str),
    /// What was to compute is not there.
    #[error("provider {}: {reason}", provider.name())]
    Provider {
        /// What was asked for.
        provider: Provider,
        /// Why it cannot be had.
        reason: String,
    },
    /// A network cannot be loaded.
    #[error("{}: {reason}", file.display())]
    Load {
        /// The network.
        file: PathBuf,
        /// Why.
        reason: String,
    },
    /// A network does not run.
    #[error("{}: {reason}", file.display())]
    Run {
        /// The network.
        file: PathBuf,
        /// Why.
        reason: String,
    },
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}
