//! ONNX Runtime, loaded when the first network is: linking it at build time would break every build on a machine that
//! lacks it.
//!
//! A process has one ONNX Runtime environment, made from the first library that loads. Threads do not spin while they
//! wait: spinning nearly doubles the processor time, which the other stages of the pipeline need.

use super::interface::{Element, Engine, EngineDescription, EngineError, Network, Port, Provider, Tensor, one_by_one};
use super::locate::{Found, candidates};
use super::trusted::trusted;
use half::f16;
use ort::environment::Environment;
use ort::ep::{self, ExecutionProvider, ExecutionProviderDispatch};
use ort::logging::LogLevel;
use ort::session::Session;
use ort::session::builder::{GraphOptimizationLevel, SessionBuilder};
use ort::value::{DynValue, Outlet, TensorElementType, TensorRef, ValueType};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The library that was loaded and what was made of it.
struct Loaded {
    library: PathBuf,
    environment: Environment,
}

/// Set once; the environment cannot be made a second time, so it is never let go.
static LOADED: Mutex<Option<Loaded>> = Mutex::new(None);

/// ONNX Runtime with a provider.
#[derive(Clone, Debug)]
pub struct OnnxRuntime {
    environment: Environment,
    library: PathBuf,
    provider: Provider,
}

impl OnnxRuntime {
    /// Loads the library: from `configured` if given, else from where it is found.
    ///
    /// # Errors
    /// [`EngineError`]: not found, not loadable, or without the provider.
    pub fn open(configured: Option<&Path>, provider: Provider) -> Result<Self, EngineError> {
        let (found, looked_in) = candidates(configured);
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let mut last = EngineError::NotFound { looked_in };
        if loaded.is_none() {
            for candidate in found {
                match load(&candidate) {
                    Ok(environment) => {
                        tracing::debug!("ONNX Runtime: {}, named by {}", candidate.path.display(), candidate.from);
                        *loaded = Some(Loaded { library: candidate.path, environment });
                        break;
                    }
                    Err(error) if candidate.binding => return Err(error),
                    Err(error) => {
                        tracing::warn!("{error}");
                        last = error;
                    }
                }
            }
        }
        let Some(Loaded { library, environment }) = &*loaded else { return Err(last) };
        if let Some(other) = configured.filter(|path| !same_file(path, library)) {
            let reason = format!("this process has loaded {} already", library.display());
            return Err(EngineError::Library { path: other.into(), from: "the configuration", reason });
        }
        let runtime = Self { environment: environment.clone(), library: library.clone(), provider };
        if provider != Provider::Cpu && !runtime.providers().contains(&provider) {
            let there = runtime.providers().iter().map(|p| p.name()).collect::<Vec<_>>().join(", ");
            let reason = format!("{} was built without it; it has {there}", runtime.library.display());
            return Err(EngineError::Provider { provider, reason });
        }
        Ok(runtime)
    }

    /// The providers that the library was built with.
    pub fn providers(&self) -> Vec<Provider> {
        Provider::ALL
            .into_iter()
            .filter(|provider| match provider {
                Provider::Cpu => true,
                Provider::Cuda => ep::CUDA::is_available().unwrap_or(false),
                Provider::TensorRt => ep::TensorRT::is_available().unwrap_or(false),
                Provider::OpenVino => ep::OpenVINO::is_available().unwrap_or(false),
                Provider::CoreMl => ep::CoreML::is_available().unwrap_or(false),
            })
            .collect()
    }

    fn dispatch(&self) -> Option<ExecutionProviderDispatch> {
        let provider = match self.provider {
            Provider::Cpu => return None,
            Provider::Cuda => ep::CUDA::default().build(),
            Provider::TensorRt => ep::TensorRT::default().build(),
            Provider::OpenVino => ep::OpenVINO::default().build(),
            Provider::CoreMl => ep::CoreML::default().build(),
        };
        Some(provider.error_on_failure())
    }

    fn session(&self, file: &Path, threads: usize) -> ort::Result<Session> {
        let mut builder: SessionBuilder = Session::builder(&self.environment)?
            .with_optimization_level(GraphOptimizationLevel::All)?
            .with_intra_threads(threads.max(1))?
            .with_intra_op_spinning(false)?;
        if let Some(provider) = self.dispatch() {
            builder = builder.with_execution_providers([provider])?;
        }
        builder.commit_from_file(file)
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}

fn load(candidate: &Found) -> Result<Environment, EngineError> {
    let fail = |reason: String| EngineError::Library { path: candidate.path.clone(), from: candidate.from, reason };
    let path = trusted(&candidate.path).map_err(fail)?;
    let builder = ort::init_from(path).map_err(|e| fail(e.to_string()))?;
    let builder = builder.with_name("semascan").with_telemetry(false).with_logger(Arc::new(log));
    builder.build().map_err(|e| fail(e.to_string()))
}

/// Passes on what ONNX Runtime reports, one level down: its errors also reach the caller.
fn log(level: LogLevel, _category: &str, _id: &str, place: &str, message: &str) {
    match level {
        LogLevel::Error | LogLevel::Fatal => tracing::warn!("onnxruntime: {message} ({place})"),
        LogLevel::Warning => tracing::debug!("onnxruntime: {message} ({place})"),
        _ => tracing::trace!("onnxruntime: {message} ({place})"),
    }
}

impl Engine for OnnxRuntime {
    fn description(&self) -> EngineDescription {
        EngineDescription {
            name: "onnxruntime".into(),
            version: version(ort::info(), &self.library),
            provider: self.provider,
            library: Some(self.library.clone()),
        }
    }

    fn load(&self, file: &Path, threads: usize) -> Result<Box<dyn Network>, EngineError> {
        let session = self
            .session(file, threads)
            .map_err(|e| EngineError::Load { file: file.into(), reason: one_line(&e.to_string()) })?;
        let ports = |outlets: &[Outlet]| outlets.iter().map(port).collect();
        let (inputs, outputs) = (ports(session.inputs()), ports(session.outputs()));
        Ok(Box::new(OrtNetwork { file: file.into(), session, inputs, outputs }))
    }
}

/// The version: of the release branch in ONNX Runtime's description of its build, else in the library's file name, else the
/// commit. (The C interface tells it as well, but not without unsafe code.)
fn version(info: &str, library: &Path) -> String {
    let entry = |key: &str| info.split(key).nth(1).and_then(|rest| rest.split([',', ' ']).next());
    if let Some(release) = entry("git-branch=rel-") {
        return release.to_owned();
    }
    let file = library.canonicalize().unwrap_or_else(|_| library.to_owned());
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let numbers: Vec<&str> = name.split('.').filter(|part| part.parse::<u32>().is_ok()).collect();
    if numbers.len() > 1 { numbers.join(".") } else { entry("git-commit-id=").unwrap_or("unknown").to_owned() }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn port(outlet: &Outlet) -> Port {
    let (element, shape) = match outlet.dtype() {
        ValueType::Tensor { ty, shape, .. } => {
            let element = match ty {
                TensorElementType::Float32 => Element::F32,
                TensorElementType::Float16 => Element::F16,
                other => Element::Other(format!("{other:?}")),
            };
            (element, Some(shape.iter().map(|&d| usize::try_from(d).ok()).collect()))
        }
        _ => (Element::Other("no tensor".into()), None),
    };
    Port { name: outlet.name().to_owned(), element, shape }
}

/// A network in ONNX Runtime.
struct OrtNetwork {
    file: PathBuf,
    session: Session,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
}

impl Network for OrtNetwork {
    fn inputs(&self) -> &[Port] {
        &self.inputs
    }

    fn outputs(&self) -> &[Port] {
        &self.outputs
    }

    fn run(&mut self, input: &Tensor, wanted: &[&str]) -> Result<Vec<Tensor>, EngineError> {
        let batch = self.inputs.first().and_then(|p| p.shape.as_ref()).and_then(|s| *s.first()?);
        let single = input.shape.len() == 4 && batch == Some(1);
        if single {
            one_by_one(input, |picture| self.run_batch(picture, wanted))
        } else {
            self.run_batch(input, wanted)
        }
    }
}

impl OrtNetwork {
    fn run_batch(&mut self, input: &Tensor, wanted: &[&str]) -> Result<Vec<Tensor>, EngineError> {
        let Self { file, session, inputs, .. } = self;
        let fail = |reason: String| EngineError::Run { file: file.clone(), reason: one_line(&reason) };
        let name = inputs.first().map(|p| p.name.clone()).unwrap_or_default();
        let shape = input.shape.clone();
        let halved: Vec<f16>;
        let outputs = if inputs.first().is_some_and(|port| port.element == Element::F16) {
            halved = input.data.iter().map(|v| f16::from_f32(*v)).collect();
            TensorRef::from_array_view((shape, halved.as_slice())).and_then(|t| session.run(ort::inputs![name => t]))
        } else {
            TensorRef::from_array_view((shape, input.data.as_slice()))
                .and_then(|t| session.run(ort::inputs![name => t]))
        };
        let outputs = outputs.map_err(|e| fail(e.to_string()))?;
        wanted
            .iter()
            .map(|&name| {
                let value = outputs.get(name).ok_or_else(|| fail(format!("it has no output {name}")))?;
                read(value).map_err(|reason| fail(format!("output {name}: {reason}")))
            })
            .collect()
    }
}

/// A value as numbers.
fn read(value: &DynValue) -> Result<Tensor, String> {
    let ValueType::Tensor { ty, .. } = value.dtype() else { return Err("is no tensor".into()) };
    let (shape, data) = match ty {
        TensorElementType::Float32 => {
            let (shape, data) = value.try_extract_tensor::<f32>().map_err(|e| e.to_string())?;
            (shape, data.to_vec())
        }
        TensorElementType::Float16 => {
            let (shape, data) = value.try_extract_tensor::<f16>().map_err(|e| e.to_string())?;
            (shape, data.iter().map(|v| v.to_f32()).collect())
        }
        TensorElementType::Int64 => {
            let (shape, data) = value.try_extract_tensor::<i64>().map_err(|e| e.to_string())?;
            (shape, data.iter().map(|&v| v as f32).collect())
        }
        other => return Err(format!("holds {other:?}, not f32, f16 or i64")),
    };
    let shape = shape.iter().map(|&d| usize::try_from(d).unwrap_or(0)).collect();
    Ok(Tensor { shape, data })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_that_of_the_release_or_of_the_file() {
        let info = |branch: &str| format!("ORT Build Info: git-branch={branch}, git-commit-id=abc, build type=Release");
        let (bare, numbered) = (Path::new("/x/libonnxruntime.so"), Path::new("/x/libonnxruntime.so.1.31.1"));
        assert_eq!(version(&info("rel-1.24.0"), numbered), "1.24.0");
        assert_eq!(version(&info("HEAD"), numbered), "1.31.1");
        assert_eq!(version(&info("HEAD"), Path::new("/x/libonnxruntime.1.31.1.dylib")), "1.31.1");
        assert_eq!(version(&info("HEAD"), bare), "abc");
        assert_eq!(version("", bare), "unknown");
    }

    #[test]
    fn a_library_that_a_person_named_and_that_is_none_is_an_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("libonnxruntime.so");
        let candidate = Found { path: file.clone(), from: "the configuration", binding: true };
        let error = load(&candidate).expect_err("nothing there").to_string();
        assert!(error.contains("the configuration") && error.contains("no such file"), "{error}");
        std::fs::write(&file, b"no library").expect("writes");
        let error = load(&candidate).expect_err("no library").to_string();
        assert!(error.contains("libonnxruntime.so"), "{error}");
    }
}
