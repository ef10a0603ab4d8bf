//! `semascan dataset`: labels that people corrected on models, as masks of every view that saw them; and `dataset queue`: where
//! a label would teach most.

mod input;
mod manifest;
mod queue;
mod scenes;
mod writer;

#[cfg(feature = "demo")]
pub(super) use writer::DatasetWriter;

use super::{Failure, numbers};
use anyhow::anyhow;
use clap::{Args, Subcommand, ValueEnum};
use semascan_labelling::{RimTreatment, Selection};
use semascan_model::InspectionId;
use serde::Serialize;
use std::path::PathBuf;

/// The layout of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Format {
    /// BOP scenes with a mask of each component, and one class a pixel in labels/ and defects/: what the training code reads
    Bop,
    /// Polygons for LabelMe: images/, components/, defects/; what is not known is `__ignore__`
    Labelme,
    /// Run-length masks in COCO's annotations.json; what is not known is `iscrowd`
    Coco,
}

/// Arguments of `semascan dataset`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct DatasetArgs {
    #[command(subcommand)]
    command: Option<DatasetCommand>,
    /// Data folders, or folders of inspections, whose recording is opened again
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    from: Vec<PathBuf>,
    /// Folder to write into
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Layout of the data set
    #[arg(long, value_enum, default_value = "bop")]
    format: Format,
    /// Only these inspections (repeatable)
    #[arg(long, value_name = "ID")]
    inspection: Vec<InspectionId>,
    /// Also take inspections that nobody reviewed, with their labels as measured
    #[arg(long)]
    include_uncorrected: bool,
    /// Only label surface that a person labelled; what was measured and not corrected is left open
    #[arg(long)]
    only_reviewed: bool,
    /// Leave measured labels open whose standard uncertainty (0 to 1) is larger [default: all are used]
    #[arg(long, value_name = "T", value_parser = numbers::threshold, allow_negative_numbers = true)]
    max_sigma: Option<f32>,
    /// Also label pixels along silhouettes that depth says nothing of, by the picture: less certain, but what networks get wrong lies
    /// there
    #[arg(long)]
    close_gaps: bool,
    /// Replace the data set in the folder
    #[arg(long)]
    overwrite: bool,
    /// Print the manifest as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum DatasetCommand {
    /// Order inspections and regions by what a label would teach most: uncertainty times area
    Queue(queue::QueueArgs),
}

impl DatasetArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if let Some(DatasetCommand::Queue(args)) = self.command {
            return args.run();
        }
        let Some(out) = &self.out else { return Err(Failure::Call(anyhow!("--out: name a folder to write into"))) };
        if self.only_reviewed && self.include_uncorrected {
            let reason = "--only-reviewed and --include-uncorrected contradict each other";
            return Err(Failure::Call(anyhow!(reason)));
        }
        let inputs = input::open(&self.from, &self.inspection)?;
        let selection = Selection { only_people: self.only_reviewed, max_sigma: self.max_sigma };
        let options = scenes::Options {
            format: self.format,
            include_uncorrected: self.include_uncorrected,
            selection,
            rims: if self.close_gaps { RimTreatment::Close } else { RimTreatment::Refine },
            overwrite: self.overwrite,
        };
        let manifest = scenes::write(out, inputs, &options)?;
        if self.json {
            crate::stdout::print_json(&manifest)?;
        }
        Ok(())
    }
}
