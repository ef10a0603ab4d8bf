//! What the program needs wherever it runs: ONNX Runtime, trained networks, the viewer.

use super::super::models;
use super::{Finding, Health};
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_perception::segment::network::engine::{self, Engine, EngineChoice, EngineError, OnnxRuntime};
use semascan_perception::segment::network::{Provider, installed, search_path};
use semascan_server::EmbeddedFiles;
use serde_json::{Value, json};

/// All of it, as an inspection as `spec` says needs it.
pub(super) fn findings(spec: &InspectionSpec, embedded: EmbeddedFiles) -> Vec<Finding> {
    // Without what labels come from nothing is inspected; where they come from elsewhere it is only missing.
    let missing = if spec.labels == LabelSource::Network { Health::Failed } else { Health::Warning };
    vec![runtime(spec, missing), tract(), networks(missing), viewer(embedded)]
}

/// ONNX Runtime and what it can compute on.
fn runtime(spec: &InspectionSpec, missing: Health) -> Finding {
    let what = "ONNX Runtime";
    let (library, provider) = (spec.network.onnxruntime.as_deref(), spec.network.provider);
    let (_, looked_in) = engine::candidates(library);
    match OnnxRuntime::open(library, provider) {
        Ok(runtime) => {
            let about = runtime.description();
            let providers: Vec<&str> = runtime.providers().into_iter().map(Provider::name).collect();
            let path = about.library.as_ref().map_or_else(String::new, |p| p.display().to_string());
            let text = format!("{} from {path}, computes on {}", about.version, providers.join(", "));
            let details = json!({ "version": about.version, "library": about.library, "providers": providers });
            Finding { looked_in, details, ..Finding::ok(what, text) }
        }
        Err(error @ EngineError::NotFound { .. }) => {
            let (health, instead) = match engine::HAS_TRACT {
                true => (Health::Warning, "networks run in tract, several times slower"),
                false => (missing, "--labels network cannot run"),
            };
            let mend = "`pip install onnxruntime` brings it, or `cargo xtask onnxruntime` in the source tree";
            Finding::wrong(what, health, format!("{error}; {instead}"), mend)
        }
        Err(error) => {
            let mend = "name a library of this machine's kind with network.onnxruntime in cell.toml, or ORT_DYLIB_PATH";
            Finding { looked_in, ..Finding::wrong(what, Health::Failed, error.to_string(), mend) }
        }
    }
}

/// tract, where this build has it.
fn tract() -> Finding {
    let (text, details) = match engine::open(EngineChoice::Tract, None, Provider::Cpu) {
        Ok(tract) => {
            let version = tract.description().version;
            (format!("{version}, built in"), json!({ "version": version }))
        }
        Err(_) => ("not built in; ONNX Runtime does its work".to_owned(), Value::Null),
    };
    Finding { details, ..Finding::ok("tract", text) }
}

/// The models that are installed.
fn networks(missing: Health) -> Finding {
    let what = "models";
    let folders = search_path();
    let models: Vec<Value> = installed(&folders).iter().map(models::to_json).collect();
    let broken: Vec<String> = models.iter().filter_map(|m| Some(m["error"].as_str()?.to_owned())).collect();
    let names: Vec<&str> = models.iter().filter_map(|m| m["name"].as_str()).collect();
    let found = if !broken.is_empty() {
        Finding::wrong(what, Health::Failed, broken.join("; "), "mend or remove the folders that are named")
    } else if models.is_empty() {
        let text = "none are installed, --labels network has nothing to use";
        Finding::wrong(
            what,
            missing,
            text,
            "name a folder of models with SEMASCAN_MODELS, or put one where they are looked for",
        )
    } else {
        Finding::ok(what, names.join(", "))
    };
    Finding { looked_in: folders, details: json!(models), ..found }
}

/// The viewer's files.
fn viewer(embedded: EmbeddedFiles) -> Finding {
    if ["index.html", "index.html.br"].iter().any(|name| embedded(name).is_some()) {
        Finding::ok("viewer", "built in")
    } else {
        Finding::wrong("viewer", Health::Failed, "is not built in", "build it with: cargo xtask web")
    }
}
