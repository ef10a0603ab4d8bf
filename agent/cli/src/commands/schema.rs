//! `semascan schema`: the JSON Schema of `inspection.json`.

use super::Failure;
use clap::Args;
use semascan_model::record::InspectionRecord;
use std::io::Write;

/// Arguments of `semascan schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {}

impl SchemaArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let mut out = std::io::stdout().lock();
        serde_json::to_writer_pretty(&mut out, &InspectionRecord::json_schema())?;
        writeln!(out)?;
        Ok(())
    }
}
