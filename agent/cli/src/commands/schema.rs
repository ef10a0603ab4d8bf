//! `semascan schema`: the JSON Schemas of `inspection.json`, `criteria.toml` and `cell.toml`.

use super::{Failure, cell_schema};
use crate::stdout::print_pretty_json;
use clap::{Args, ValueEnum};
use semascan_model::criteria::Criteria;
use semascan_model::record::InspectionRecord;

/// Arguments of `semascan schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {
    /// Of which file
    #[arg(value_enum, default_value = "record")]
    of: Of,
}

/// The files that have a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Of {
    /// inspection.json
    Record,
    /// criteria.toml, read as JSON
    Criteria,
    /// cell.toml, read as JSON
    Cell,
}

impl SchemaArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        print_pretty_json(&match self.of {
            Of::Record => InspectionRecord::json_schema(),
            Of::Criteria => Criteria::json_schema(),
            Of::Cell => cell_schema::json_schema(),
        })
    }
}
