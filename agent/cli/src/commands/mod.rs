//! Commands, their arguments and exit codes.

mod accounts;
mod audit;
mod calibrate;
mod calibrate_cell;
mod cell_schema;
mod cell_section;
mod completions;
mod config;
mod config_command;
mod convert;
mod criteria_file;
mod data_folder;
mod dataset;
#[cfg(feature = "demo")]
mod demo;
mod doctor;
#[cfg(feature = "demo")]
mod evaluate;
mod export;
mod export_texture;
mod findings_report;
mod init;
mod inspect;
mod judge;
mod keep;
mod keeping;
mod limit_args;
mod man;
mod models;
mod numbers;
mod oidc;
mod password;
mod past;
mod photographs;
#[cfg(feature = "demo")]
mod photometric;
mod plan;
mod plan_args;
#[cfg(feature = "demo")]
mod pose_truth;
mod reach;
mod record;
mod recorded_views;
mod report;
mod report_command;
mod report_html;
mod run;
mod schema;
mod serve;
mod signals;
mod source;
mod spec_args;
#[cfg(feature = "demo")]
mod synth;
#[cfg(feature = "demo")]
mod synth_turntable;
#[cfg(feature = "demo")]
mod tables;
mod verbosity;

use anyhow::Context;
use clap::{Parser, Subcommand};
use semascan_inspection::SetupFailure;
use semascan_inspection::ports::{Obstacle, PortError};
use semascan_inspection::source::SourceError;
use semascan_perception::segment::network::SelectError;
use semascan_perception::segment::network::engine::EngineError;
use semascan_server::EmbeddedFiles;
use semascan_store::{ExportError, StoreError};
use signals::Signals;
use verbosity::Verbosity;

/// What scripts rely on.
const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 the work failed, or too few views could be used; 2 the call was wrong, or a file that it names is not
there or is none; 130 (SIGINT) and 143 (SIGTERM) the work was cut off: an inspection keeps what it has, within 5 s, and its record says
`stopped`; a second signal ends it at once. A server whose work was done ends with 0.";

/// Semantic 3D inspection of used parts.
#[derive(Debug, Parser)]
#[command(name = "semascan", version, about = "Semantic 3D inspection of used parts", after_help = EXIT_CODES)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    pub(crate) verbosity: Verbosity,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Inspect a simulated starter motor and watch it in the browser
    #[cfg(feature = "demo")]
    Demo(Box<demo::DemoArgs>),
    /// Serve the viewer and the live stream, and inspect a source if one is given
    Serve(Box<serve::ServeArgs>),
    /// Inspect a source without a browser and write the model
    Inspect(Box<inspect::InspectArgs>),
    /// Measure a model against a reference, clouds or meshes; or the poses of an inspection against its pictures
    #[cfg(feature = "demo")]
    Evaluate(evaluate::EvaluateArgs),
    /// Judge an inspection by criteria: accept, rework, reject, or a person decides
    Judge(judge::JudgeArgs),
    /// Plan close looks at the findings and components of an inspection: poses of the camera and angles of the table
    Plan(plan::PlanCommandArgs),
    /// Write what was found as a report or a table: HTML, CSV, Q-DAS ASCII, QIF
    Report(report_command::ReportArgs),
    /// Write the model of an inspection as a mesh or a cloud in other formats
    Export(export::ExportArgs),
    /// Record what a live camera or robot streams, in an MCAP file
    Record(record::RecordArgs),
    /// Write the views of any source as a capture (MCAP) or as a BOP scene
    Convert(convert::ConvertArgs),
    /// Find where the camera sits on the robot and where the table's axis lies, from captures of a board
    Calibrate(calibrate_cell::CalibrateCellArgs),
    /// Make training data of inspections whose labels people corrected, or say where a label would teach most
    Dataset(dataset::DatasetArgs),
    /// List the trained networks that are installed
    Models(models::ModelsArgs),
    /// Remove old inspections from a data folder, by age and size; held ones stay
    Gc(data_folder::GcArgs),
    /// Read everything in a data folder and name what is missing or damaged
    Verify(data_folder::VerifyArgs),
    /// Copy a data folder, also while inspections run
    Backup(data_folder::BackupArgs),
    /// Make what a new cell needs: cell.toml, criteria.toml, a data folder and the first user
    Init(init::InitArgs),
    /// Add, list, change and remove the users of an agent
    User(accounts::UserArgs),
    /// Make, list and revoke tokens, with which machines use an agent
    Token(accounts::TokenArgs),
    /// Check the logs of reviews and accounts in a data folder, and print that of accounts
    Audit(audit::AuditArgs),
    /// Say whether everything that inspections need is there
    Doctor(doctor::DoctorArgs),
    /// Print a commented sample of cell.toml, or check one
    Config(config_command::ConfigArgs),
    /// Print a script by which a shell completes the arguments of this program
    Completions(completions::CompletionsArgs),
    /// Write the manual pages of this program
    Man(man::ManArgs),
    /// Rerun a paper's tables on the virtual cell, its figures beside ours
    #[cfg(feature = "demo")]
    Tables(tables::TablesArgs),
    /// Print the JSON Schema of inspection.json or criteria.toml
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
    /// The work was cut off by a signal, of which this is the exit code.
    Stopped(u8, anyhow::Error),
}

impl Failure {
    pub(crate) fn into_parts(self) -> (u8, anyhow::Error) {
        match self {
            Self::Work(e) => (1, e),
            Self::Call(e) => (2, e),
            Self::Stopped(code, e) => (code, e),
        }
    }

    /// Why, in words.
    pub(crate) fn reason(&self) -> String {
        let (Self::Work(error) | Self::Call(error) | Self::Stopped(_, error)) = self;
        format_error(error)
    }

    /// The state of the machine that keeps the result from being kept, where that is the reason: it may be over later.
    pub(crate) fn obstacle(&self) -> Option<Obstacle> {
        let (Self::Work(error) | Self::Call(error) | Self::Stopped(_, error)) = self;
        let store = error.downcast_ref::<StoreError>().and_then(StoreError::obstacle);
        store.or_else(|| error.downcast_ref::<PortError>().and_then(|error| error.obstacle))
    }

    /// Work that ended early: by a signal, or because somebody stopped it otherwise.
    pub(crate) fn stopped(signals: &Signals, error: anyhow::Error) -> Self {
        match signals.exit_code() {
            Some(code) => Self::Stopped(code, error),
            None => Self::Work(error),
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
        let is_call = error.chain().any(is_of_the_call);
        if is_call { Self::Call(error) } else { Self::Work(error) }
    }
}

/// Whether an error says that the call was wrong: it names what does not exist, or asks for what must not be done.
fn is_of_the_call(cause: &(dyn std::error::Error + 'static)) -> bool {
    let source = |error: &SourceError| matches!(error, SourceError::Uri { .. });
    let select = |error: &SelectError| matches!(error, SelectError::Unknown { .. } | SelectError::None { .. });
    // An option that is a file, as ONNX Runtime's library is.
    let engine = |error: &EngineError| matches!(error, EngineError::Library { path, .. } if !path.is_file());
    if let Some(error) = cause.downcast_ref() {
        return source(error);
    }
    if let Some(error) = cause.downcast_ref() {
        return select(error);
    }
    if let Some(error) = cause.downcast_ref() {
        return engine(error);
    }
    if let Some(error) = cause.downcast_ref::<SetupFailure>() {
        return match error {
            SetupFailure::Spec(_) => true,
            SetupFailure::Source(error) => source(error),
            SetupFailure::Select(error) => select(error),
            SetupFailure::Engine(error) => engine(error),
            _ => false,
        };
    }
    let store = |error: &StoreError| {
        matches!(
            error,
            StoreError::NotEmpty { .. }
                | StoreError::Foreign { .. }
                | StoreError::ForeignData { .. }
                | StoreError::NoFolder { .. }
        )
    };
    if let Some(error) = cause.downcast_ref() {
        return store(error);
    }
    if let Some(error) = cause.downcast_ref::<ExportError>() {
        return match error {
            ExportError::Store(error) => store(error),
            _ => true,
        };
    }
    is_no_file(cause)
}

/// Whether it says that there is no such file, or that what is there is none: a folder, a pipe, a device.
fn is_no_file(cause: &(dyn std::error::Error + 'static)) -> bool {
    cause.downcast_ref::<std::io::Error>().is_some_and(|error| {
        error.kind() == std::io::ErrorKind::NotFound || semascan_formats::regular_file::is_not_regular(error)
    })
}

impl Cli {
    /// Runs the command; `viewer` holds the viewer's files.
    pub(crate) fn run(self, viewer: EmbeddedFiles) -> Result<(), Failure> {
        let signals = Signals::handle().context("signals cannot be handled")?;
        let quiet = self.verbosity.is_quiet();
        match self.command {
            #[cfg(feature = "demo")]
            Command::Demo(args) => args.run(viewer, &signals),
            Command::Serve(args) => args.run(viewer, &signals),
            Command::Inspect(args) => args.run(quiet, &signals),
            #[cfg(feature = "demo")]
            Command::Evaluate(args) => args.run(),
            Command::Judge(args) => args.run(),
            Command::Plan(args) => args.run(),
            Command::Report(args) => args.run(),
            Command::Export(args) => args.run(),
            Command::Convert(args) => args.run(),
            Command::Record(args) => args.run(&signals),
            Command::Calibrate(args) => args.run(),
            Command::Dataset(args) => args.run(),
            Command::Models(args) => args.run(),
            Command::Gc(args) => args.run(),
            Command::Verify(args) => args.run(),
            Command::Backup(args) => args.run(),
            Command::Init(args) => args.run(),
            Command::User(args) => args.run(),
            Command::Token(args) => args.run(),
            Command::Man(args) => args.run(),
            Command::Audit(args) => args.run(),
            Command::Doctor(args) => args.run(viewer),
            #[cfg(feature = "demo")]
            Command::Tables(args) => args.run(quiet),
            Command::Schema(args) => args.run(),
            Command::Config(args) => args.run(),
            Command::Completions(args) => args.run(),
            #[cfg(feature = "demo")]
            Command::Synth(args) => args.run(quiet),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
