//! Commands, their arguments and exit codes.

mod calibrate;
mod config;
#[cfg(feature = "demo")]
mod demo;
mod doctor;
#[cfg(feature = "demo")]
mod evaluate;
mod export;
mod inspect;
mod limit_args;
mod models;
#[cfg(feature = "demo")]
mod photometric;
mod report;
mod run;
mod schema;
mod serve;
mod source;
mod spec_args;
#[cfg(feature = "demo")]
mod synth;
#[cfg(feature = "demo")]
mod synth_turntable;
#[cfg(feature = "demo")]
mod tables;

use clap::{Parser, Subcommand};
use semascan_inspection::SetupFailure;
use semascan_inspection::source::SourceError;
use semascan_perception::segment::network::SelectError;
use semascan_server::EmbeddedFiles;
use semascan_store::StoreError;

/// Semantic 3D inspection of used parts.
#[derive(Debug, Parser)]
#[command(name = "semascan", version, about)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Inspect a simulated starter motor and watch it in the browser
    #[cfg(feature = "demo")]
    Demo(demo::DemoArgs),
    /// Serve the viewer and the live stream, and inspect a source if one is given
    Serve(serve::ServeArgs),
    /// Inspect a source without a browser and write the model
    Inspect(inspect::InspectArgs),
    /// Measure a model against a reference, clouds or meshes; or the poses of an inspection against its pictures
    #[cfg(feature = "demo")]
    Evaluate(evaluate::EvaluateArgs),
    /// Write the model of an inspection as a mesh or a cloud in other formats
    Export(export::ExportArgs),
    /// List the trained networks that are installed
    Models(models::ModelsArgs),
    /// Say whether everything that inspections need is there
    Doctor(doctor::DoctorArgs),
    /// Rerun a paper's tables on the virtual cell, its figures beside ours
    #[cfg(feature = "demo")]
    Tables(tables::TablesArgs),
    /// Print the JSON Schema of inspection.json
    Schema(schema::SchemaArgs),
    /// Write labelled training data from the virtual cell, in BOP layout
    #[cfg(feature = "demo")]
    Synth(synth::SynthArgs),
}

/// A failed command: its exit code and why.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The work failed: exit code 1.
    Work(anyhow::Error),
    /// The call was wrong: exit code 2.
    Call(anyhow::Error),
}

impl Failure {
    pub(crate) fn into_parts(self) -> (u8, anyhow::Error) {
        match self {
            Self::Work(e) => (1, e),
            Self::Call(e) => (2, e),
        }
    }
}

/// An error with its causes, outermost first. Messages that name a file carry the cause's own words already: those are
/// not said again.
pub(crate) fn format_error(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |text, cause| {
        let cause = cause.to_string();
        if text.ends_with(&cause) { text } else { format!("{text}: {cause}") }
    })
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        let error = error.into();
        let is_call = error.chain().any(|cause| {
            matches!(cause.downcast_ref(), Some(SourceError::Uri { .. }))
                || matches!(cause.downcast_ref(), Some(StoreError::NotEmpty { .. }))
                || matches!(cause.downcast_ref(), Some(SelectError::Unknown { .. } | SelectError::None { .. }))
                || matches!(
                    cause.downcast_ref(),
                    Some(
                        SetupFailure::Spec(_)
                            | SetupFailure::Source(SourceError::Uri { .. })
                            | SetupFailure::Select(SelectError::Unknown { .. } | SelectError::None { .. })
                    )
                )
        });
        if is_call { Self::Call(error) } else { Self::Work(error) }
    }
}

impl Cli {
    /// Runs the command; `viewer` holds the viewer's files.
    pub(crate) fn run(self, viewer: EmbeddedFiles) -> Result<(), Failure> {
        match self.command {
            #[cfg(feature = "demo")]
            Command::Demo(args) => args.run(viewer),
            Command::Serve(args) => args.run(viewer),
            Command::Inspect(args) => args.run(),
            #[cfg(feature = "demo")]
            Command::Evaluate(args) => args.run(),
            Command::Export(args) => args.run(),
            Command::Models(args) => args.run(),
            Command::Doctor(args) => args.run(viewer),
            #[cfg(feature = "demo")]
            Command::Tables(args) => args.run(),
            Command::Schema(args) => args.run(),
            #[cfg(feature = "demo")]
            Command::Synth(args) => args.run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn a_cause_is_said_once() {
        let missing = || std::io::Error::from(std::io::ErrorKind::NotFound);
        let path = "rgb/000001.png".into();
        let named = anyhow::Error::new(SourceError::Io { path, source: missing() }).context("view 1");
        assert_eq!(format_error(&named), "view 1: rgb/000001.png: entity not found");
        let plain = Err::<(), _>(missing()).context("cannot open the scene").expect_err("an error");
        assert_eq!(format_error(&plain), "cannot open the scene: entity not found");
    }
}
