//! `semascan schema`: the JSON Schema of `inspection.json`.

use super::Failure;
use crate::stdout::print_pretty_json;
use clap::Args;
use semascan_model::record::InspectionRecord;

/// Arguments of `semascan schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {}

impl SchemaArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        print_pretty_json(&InspectionRecord::json_schema())
    }
}
