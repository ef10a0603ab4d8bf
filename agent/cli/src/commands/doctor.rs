//! `semascan doctor`: whether everything that inspections need is there.

use super::{Failure, config, models};
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::anyhow;
use clap::Args;
use jiff::Timestamp;
use semascan_formats::regular_file;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibrationRecord};
use semascan_perception::segment::network::engine::{self, Engine, EngineChoice, EngineError, OnnxRuntime};
use semascan_perception::segment::network::{Provider, installed, search_path};
use semascan_server::EmbeddedFiles;
use serde::Serialize;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `semascan doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// Configuration of the cell
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Temperature of the cell now, degrees Celsius, to hold against that of its calibration
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// How something stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Health {
    Ok,
    /// It works, but not as well as it could.
    Warning,
    /// It does not work.
    Failed,
}

/// One thing that was looked at.
#[derive(Debug, Serialize)]
struct Finding {
    what: &'static str,
    health: Health,
    text: String,
    /// Where it is looked for, the first place first; empty for what is built in.
    looked_in: Vec<PathBuf>,
    details: Value,
}

impl DoctorArgs {
    pub(crate) fn run(self, embedded: EmbeddedFiles) -> Result<(), Failure> {
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        let network = &config.inspection.network;
        let mut findings =
            vec![runtime(network.onnxruntime.as_deref(), network.provider), tract(), networks(), viewer(embedded)];
        findings
            .extend(config.inspection.source.calibration.as_deref().map(|path| calibration(path, self.temperature)));
        let mut out = Stderr::default();
        for finding in &findings {
            let looked_in = finding.looked_in.iter().map(|place| place.display().to_string()).collect::<Vec<_>>();
            let mark = match finding.health {
                Health::Ok => "ok     ",
                Health::Warning => "warning",
                Health::Failed => "FAILED ",
            };
            writeln!(out, "{mark}  {:<13} {}", finding.what, finding.text)?;
            if !looked_in.is_empty() {
                writeln!(out, "{:>24}looked for in this order: {}", "", looked_in.join(", "))?;
            }
        }
        let failed: Vec<&str> = findings.iter().filter(|f| f.health == Health::Failed).map(|f| f.what).collect();
        if self.json {
            let report = json!({ "healthy": failed.is_empty(), "findings": findings });
            print_json(&report)?;
        }
        if failed.is_empty() {
            Ok(())
        } else {
            Err(Failure::Work(anyhow!("not as it should be: {}", failed.join(", "))))
        }
    }
}

/// ONNX Runtime and what it can compute on.
fn runtime(library: Option<&std::path::Path>, provider: Provider) -> Finding {
    let what = "ONNX Runtime";
    let (_, looked_in) = engine::candidates(library);
    match OnnxRuntime::open(library, provider) {
        Ok(runtime) => {
            let about = runtime.description();
            let providers: Vec<&str> = runtime.providers().into_iter().map(Provider::name).collect();
            let path = about.library.as_ref().map_or_else(String::new, |p| p.display().to_string());
            let text = format!("{} from {path}, computes on {}", about.version, providers.join(", "));
            let details = json!({ "version": about.version, "library": about.library, "providers": providers });
            Finding { what, health: Health::Ok, text, looked_in, details }
        }
        Err(error @ EngineError::NotFound { .. }) => {
            let (health, instead) = match engine::HAS_TRACT {
                true => (Health::Warning, "networks run in tract, several times slower"),
                false => (
                    Health::Warning,
                    "--labels network cannot run; `pip install onnxruntime` brings it, or `cargo xtask onnxruntime` in the source tree",
                ),
            };
            Finding { what, health, text: format!("{error}; {instead}"), looked_in: Vec::new(), details: Value::Null }
        }
        Err(error) => {
            Finding { what, health: Health::Failed, text: error.to_string(), looked_in, details: Value::Null }
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
    Finding { what: "tract", health: Health::Ok, text, looked_in: Vec::new(), details }
}

/// The models that are installed.
fn networks() -> Finding {
    let folders = search_path();
    let models: Vec<Value> = installed(&folders).iter().map(models::to_json).collect();
    let broken: Vec<String> = models.iter().filter_map(|m| Some(m["error"].as_str()?.to_owned())).collect();
    let names: Vec<&str> = models.iter().filter_map(|m| m["name"].as_str()).collect();
    let (health, text) = if !broken.is_empty() {
        (Health::Failed, broken.join("; "))
    } else if models.is_empty() {
        (Health::Warning, "none are installed, --labels network has nothing to use".to_owned())
    } else {
        (Health::Ok, names.join(", "))
    };
    Finding { what: "models", health, text, looked_in: folders, details: json!(models) }
}

/// The viewer's files.
fn viewer(embedded: EmbeddedFiles) -> Finding {
    let (health, text) = if ["index.html", "index.html.br"].iter().any(|name| embedded(name).is_some()) {
        (Health::Ok, "built in")
    } else {
        (Health::Failed, "is not built in; build it with: cargo xtask web")
    };
    Finding { what: "viewer", health, text: text.into(), looked_in: Vec::new(), details: Value::Null }
}

/// The cell's calibration: whether it can be read, and whether it is due.
fn calibration(path: &Path, temperature: Option<f64>) -> Finding {
    let what = "calibration";
    let read = || -> anyhow::Result<CalibrationRecord> {
        let record: CalibrationRecord = serde_json::from_slice(&regular_file::read(path)?)?;
        anyhow::ensure!(record.schema == CALIBRATION_SCHEMA, "is of version {}", record.schema);
        Ok(record)
    };
    let name = path.display();
    let record = match read() {
        Ok(record) => record,
        Err(error) => {
            let text = format!("{name}: {error}; `semascan calibrate --out` makes it");
            return Finding { what, health: Health::Failed, text, looked_in: Vec::new(), details: Value::Null };
        }
    };
    let weak: Vec<String> =
        record.reminders(Timestamp::now(), temperature).into_iter().chain(record.warnings).collect();
    let made = record.made.map_or_else(|| "nobody noted when".to_owned(), |made| made.to_string());
    let (health, text) = match weak.is_empty() {
        true => (Health::Ok, format!("{name}, made: {made}")),
        false => (Health::Warning, format!("{name}, made: {made}: {}", weak.join("; "))),
    };
    Finding { what, health, text, looked_in: Vec::new(), details: json!({ "made": record.made, "weak": weak }) }
}
