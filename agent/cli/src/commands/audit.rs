//! `semascan audit verify`: whether the log of reviews is what was written.

use super::Failure;
use crate::stdout::print_json;
use anyhow::anyhow;
use clap::{Args, Subcommand};
use semascan_inspection::ports::BlobDigest;
use semascan_store::data::{BadEntry, DataFolder};
use std::path::PathBuf;

/// Arguments of `semascan audit`.
#[derive(Debug, Args)]
pub(crate) struct AuditArgs {
    #[command(subcommand)]
    command: AuditCommand,
}

#[derive(Debug, Subcommand)]
enum AuditCommand {
    /// Read the whole log of reviews and name the first entry that is not what was written
    Verify(VerifyArgs),
}

/// Arguments of `semascan audit verify`.
#[derive(Debug, Args)]
struct VerifyArgs {
    /// The data folder
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// The hash of the last entry as an earlier run printed it: whether that entry is still there. Without it nothing can
    /// tell that the last entries were removed
    #[arg(long, value_name = "SHA256")]
    head: Option<BlobDigest>,
    /// Print what was found as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl AuditArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.command {
            AuditCommand::Verify(args) => args.run(),
        }
    }
}

impl VerifyArgs {
    fn run(self) -> Result<(), Failure> {
        let data = DataFolder::open_beside(&self.data)?;
        let noted = self.head.map(|head| head.to_string());
        let audited = data.catalogue().audit(noted.as_deref())?;
        if self.json {
            print_json(&audited)?;
        }
        match audited.fault {
            None => {
                tracing::info!("{} entries, all good; the last has the hash {}", audited.entries, audited.head);
                Ok(())
            }
            Some(BadEntry { sequence, id, reason }) => {
                let name = if id.is_empty() { String::new() } else { format!(" (review {id})") };
                let log = self.data.display();
                Err(Failure::Work(anyhow!("{log}: entry {sequence}{name} of the log of reviews {reason}")))
            }
        }
    }
}
