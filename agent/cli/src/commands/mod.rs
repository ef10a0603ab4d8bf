//! Commands, their arguments and exit codes.

mod config;
mod doctor;
mod evaluate;
mod export;
mod inspect;
mod models;
mod network;
mod report;
mod run;
mod serve;
mod source;
mod synth;
mod tables;

use clap::{Parser, Subcommand};
use semascan_inspection::source::AcquireError;
use semascan_perception::segment::network::SelectError;

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
    Demo(serve::DemoArgs),
    /// Serve the viewer and the live stream, and inspect a source if one is given
    Serve(serve::ServeArgs),
    /// Inspect a source without a browser and write the model
    Inspect(inspect::InspectArgs),
    /// Measure a model against a reference, clouds or meshes
    Evaluate(evaluate::EvaluateArgs),
    /// Write the model of an inspection as a mesh or a cloud in other formats
    Export(export::ExportArgs),
    /// List the trained networks that are installed
    Models(models::ModelsArgs),
    /// Say whether everything that inspections need is there
    Doctor(doctor::DoctorArgs),
    /// Rerun a paper's tables on the virtual cell, its figures beside ours
    Tables(tables::TablesArgs),
    /// Write labelled training data from the virtual cell, in BOP layout
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
pub(crate) fn told(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |told, cause| {
        let cause = cause.to_string();
        if told.ends_with(&cause) { told } else { format!("{told}: {cause}") }
    })
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        let error = error.into();
        match error.downcast_ref() {
            Some(AcquireError::Uri { .. }) => Self::Call(error),
            _ if matches!(error.downcast_ref(), Some(SelectError::Unknown { .. } | SelectError::None { .. })) => {
                Self::Call(error)
            }
            _ => Self::Work(error),
        }
    }
}

impl Cli {
    /// Runs the command.
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            Command::Demo(args) => args.run(),
            Command::Serve(args) => args.run(),
            Command::Inspect(args) => args.run(),
            Command::Evaluate(args) => args.run(),
            Command::Export(args) => args.run(),
            Command::Models(args) => args.run(),
            Command::Doctor(args) => args.run(),
            Command::Tables(args) => args.run(),
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
        let named = anyhow::Error::new(AcquireError::Io { path, source: missing() }).context("view 1");
        assert_eq!(told(&named), "view 1: rgb/000001.png: entity not found");
        let plain = Err::<(), _>(missing()).context("cannot open the scene").expect_err("an error");
        assert_eq!(told(&plain), "cannot open the scene: entity not found");
    }
}
