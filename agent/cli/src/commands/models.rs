//! `semascan models`: the trained networks that are installed, and whether they are what they say. `semascan models calibrate`
//! measures which views their labels can be believed for.

use super::Failure;
use super::calibrate::CalibrateArgs;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::Context;
use clap::{Args, Subcommand};
use semascan_formats::regular_file;
use semascan_perception::segment::network::{Installed, installed, search_path};
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `semascan models`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct ModelsArgs {
    #[command(subcommand)]
    command: Option<ModelsCommand>,
    /// Folders of models [default: where they are looked for]
    #[arg(long, value_name = "DIR", value_delimiter = ',')]
    models: Vec<PathBuf>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// What is done with models beside listing them.
#[derive(Debug, Subcommand)]
enum ModelsCommand {
    /// Measure which views a model's labels can be believed for, and write that into its manifest
    Calibrate(CalibrateArgs),
}

impl ModelsArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if let Some(ModelsCommand::Calibrate(arguments)) = self.command {
            return arguments.run();
        }
        for folder in &self.models {
            regular_file::check_folder(folder).with_context(|| folder.display().to_string())?;
        }
        let folders = if self.models.is_empty() { search_path() } else { self.models };
        let models = installed(&folders);
        let mut out = Stderr::default();
        if models.is_empty() {
            let places: Vec<String> = folders.iter().map(|f| f.display().to_string()).collect();
            writeln!(out, "no models are installed; looked in {}", places.join(", "))?;
        } else {
            writeln!(out, "{:<24} {:<10} {:<5} {:>8} {:>8}  classes", "model", "task", "nets", "mean IoU", "files")?;
        }
        for model in &models {
            print(&mut out, model)?;
        }
        if self.json {
            let models: Vec<Value> = models.iter().map(to_json).collect();
            print_json(&json!({ "models": models }))?;
        }
        Ok(())
    }
}

fn print(out: &mut impl Write, model: &Installed) -> std::io::Result<()> {
    let manifest = match &model.manifest {
        Ok(manifest) => manifest,
        Err(error) => return writeln!(out, "{error}"),
    };
    let iou = manifest.metrics.get("mean_iou").and_then(toml::Value::as_float);
    let iou = iou.map_or_else(|| "-".to_owned(), |iou| format!("{iou:.3}"));
    let classes: Vec<&str> = manifest.classes.iter().map(|c| c.name.as_str()).collect();
    let files = manifest.verify(&model.folder);
    writeln!(
        out,
        "{:<24} {:<10} {:<5} {iou:>8} {:>8}  {}",
        format!("{} {}", manifest.name, manifest.version),
        manifest.task.name(),
        manifest.networks.len(),
        if files.is_ok() { "ok" } else { "WRONG" },
        classes.join(", ")
    )?;
    if let Err(error) = files {
        writeln!(out, "  {error}")?;
    }
    if manifest.domain.is_none() {
        writeln!(out, "  not calibrated: nothing says which views its labels can be believed for")?;
    }
    Ok(())
}

/// A model as one JSON object.
pub(super) fn to_json(model: &Installed) -> Value {
    match &model.manifest {
        Ok(manifest) => {
            let files = manifest.verify(&model.folder);
            json!({
                "folder": model.folder, "name": manifest.name, "version": manifest.version,
                "task": manifest.task, "architecture": manifest.architecture, "backbone": manifest.backbone,
                "fusion": manifest.fusion, "licence": manifest.licence, "networks": manifest.networks,
                "classes": manifest.classes, "metrics": manifest.metrics, "training": manifest.training,
                "calibrated": manifest.domain.is_some(),
                "valid": files.is_ok(), "error": files.err().map(|e| e.to_string()),
            })
        }
        Err(error) => json!({ "folder": model.folder, "valid": false, "error": error.to_string() }),
    }
}
