//! `semascan schema`: the JSON Schemas of `inspection.json` and `criteria.toml`.

use super::Failure;
use clap::{Args, ValueEnum};
use semascan_model::criteria::Criteria;
use semascan_model::record::InspectionRecord;
use std::io::Write;

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
}

impl SchemaArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let mut out = std::io::stdout().lock();
        let schema = match self.of {
            Of::Record => InspectionRecord::json_schema(),
            Of::Criteria => Criteria::json_schema(),
        };
        serde_json::to_writer_pretty(&mut out, &schema)?;
        writeln!(out)?;
        Ok(())
    }
}
