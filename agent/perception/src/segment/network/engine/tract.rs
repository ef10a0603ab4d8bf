//! tract: networks in pure Rust, where ONNX Runtime is missing. Three to eight times slower.
//!
//! It wants every dimension fixed: a plan is made for each size of picture that comes and the last few are kept. What it
//! cannot plan (Mask R-CNN, whose sizes depend on what it finds) it refuses by the file's name.

use super::interface::{Element, Engine, EngineDescription, EngineError, Network, Port, Provider, Tensor, one_by_one};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tract_onnx::prelude::{
    Datum, Framework, InferenceModel, InferenceModelExt, IntoRunnable, TractResult, TypedSimplePlan, tvec,
};
use tract_onnx::tract_hir::infer::{Factoid, InferenceFact};

/// Version of the crate, which does not report it itself.
const VERSION: &str = "0.23";

/// Plans that are kept: regions of interest come in a few sizes.
const PLANS: usize = 4;

/// tract as an engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tract;

impl Engine for Tract {
    fn description(&self) -> EngineDescription {
        EngineDescription { name: "tract".into(), version: VERSION.into(), provider: Provider::Cpu, library: None }
    }

    fn load(&self, file: &Path, _threads: usize) -> Result<Box<dyn Network>, EngineError> {
        let model = guarded(|| {
            let onnx = tract_onnx::onnx();
            let proto = onnx.proto_model_for_path(file)?;
            let names = proto.graph.as_ref().map(|g| g.output.iter().map(|o| o.name.clone()).collect::<Vec<_>>());
            Ok((onnx.model_for_proto_model(&proto)?, names.unwrap_or_default()))
        });
        let network = model.and_then(|(model, names)| TractNetwork::new(file, model, names));
        let network = network.map_err(|reason| EngineError::Load { file: file.into(), reason })?;
        Ok(Box::new(network))
    }
}

/// Runs what tract does with a file that may hold anything: it reports most faults and panics at some.
fn guarded<T>(work: impl FnOnce() -> TractResult<T>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(|e| {
            let chain = e.chain().map(|c| c.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
            format!("tract cannot run it: {}", chain.take(3).collect::<Vec<_>>().join(": "))
        }),
        Err(_) => Err("tract cannot run it; ONNX Runtime may".into()),
    }
}

/// A plan and the shape it is for.
type Plan = (Vec<usize>, Arc<TypedSimplePlan>);

struct TractNetwork {
    file: PathBuf,
    model: InferenceModel,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    /// The last used comes last.
    plans: Vec<Plan>,
}

impl TractNetwork {
    fn new(file: &Path, model: InferenceModel, names: Vec<String>) -> Result<Self, String> {
        let dimensions = |fact: &InferenceFact| {
            let fixed = fact
                .shape
                .dims()
                .map(|d| d.concretize().and_then(|d| usize::try_from(d.to_i64().ok()?).ok()))
                .collect();
            fact.shape.rank().concretize().map(|_| fixed)
        };
        // Inputs of other types than single precision are refused, outputs are converted.
        let element = |fact: &InferenceFact| match fact.datum_type.concretize() {
            None => Element::F32,
            Some(known) if known == f32::datum_type() => Element::F32,
            Some(other) => Element::Other(format!("{other:?}, which tract is not given")),
        };
        let ports = guarded(|| {
            let mut inputs = Vec::new();
            for outlet in model.input_outlets()? {
                let fact = model.outlet_fact(*outlet)?;
                let name = model.node(outlet.node).name.clone();
                inputs.push(Port { name, element: element(fact), shape: dimensions(fact) });
            }
            let mut outputs = Vec::new();
            for (outlet, name) in model.output_outlets()?.iter().zip(names) {
                let fact = model.outlet_fact(*outlet)?;
                outputs.push(Port { name, element: element(fact), shape: dimensions(fact) });
            }
            Ok((inputs, outputs))
        });
        let (inputs, outputs) = ports?;
        Ok(Self { file: file.into(), model, inputs, outputs, plans: Vec::new() })
    }

    /// The plan for inputs of `shape`.
    fn plan(&mut self, shape: &[usize]) -> Result<Arc<TypedSimplePlan>, String> {
        if let Some(at) = self.plans.iter().position(|(known, _)| known == shape) {
            let used = self.plans.remove(at);
            self.plans.push(used);
        } else {
            tracing::info!("{}: tract plans it for an input of {shape:?}", self.file.display());
            let model = self.model.clone();
            let plan = guarded(|| {
                let mut model = model;
                // Sizes that the file declares by name would contradict the fixed ones.
                for output in 0..model.output_outlets()?.len() {
                    model.set_output_fact(output, InferenceFact::default())?;
                }
                model.set_input_fact(0, InferenceFact::dt_shape(f32::datum_type(), shape))?;
                model.into_optimized()?.into_runnable()
            })?;
            if self.plans.len() == PLANS {
                self.plans.remove(0);
            }
            self.plans.push((shape.to_vec(), plan));
        }
        self.plans.last().map(|(_, plan)| Arc::clone(plan)).ok_or_else(|| "there is no plan".into())
    }

    /// All outputs for an input of one picture.
    fn run_one(&mut self, shape: &[usize], data: &[f32]) -> Result<Vec<Tensor>, String> {
        let plan = self.plan(shape)?;
        guarded(|| {
            let input = tract_onnx::prelude::Tensor::from_shape(shape, data)?;
            let outputs = plan.run(tvec![input.into()])?;
            outputs
                .iter()
                .map(|value: &tract_onnx::prelude::TValue| -> TractResult<Tensor> {
                    let floats = value.cast_to::<f32>()?;
                    let data = floats.try_as_plain_ram()?.as_slice::<f32>()?.to_vec();
                    Ok(Tensor { shape: floats.shape().to_vec(), data })
                })
                .collect()
        })
    }
}

impl Network for TractNetwork {
    fn inputs(&self) -> &[Port] {
        &self.inputs
    }

    fn outputs(&self) -> &[Port] {
        &self.outputs
    }

    fn run(&mut self, input: &Tensor, wanted: &[&str]) -> Result<Vec<Tensor>, EngineError> {
        let file = self.file.clone();
        let fail = |reason: String| EngineError::Run { file: file.clone(), reason };
        let indices: Vec<usize> = wanted
            .iter()
            .map(|name| {
                let at = self.outputs.iter().position(|port| port.name == *name);
                at.ok_or_else(|| fail(format!("it has no output {name}")))
            })
            .collect::<Result<_, _>>()?;
        // One picture after the other, so that one plan serves every size of batch.
        one_by_one(input, |picture| {
            let outputs = self.run_one(&picture.shape, &picture.data).map_err(fail)?;
            indices
                .iter()
                .zip(wanted)
                .map(|(&i, name)| outputs.get(i).cloned().ok_or_else(|| fail(format!("output {name} did not come"))))
                .collect()
        })
    }
}
