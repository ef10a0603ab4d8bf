//! `semascan gc | verify | backup`: the data folder that inspections are kept in.

use super::Failure;
use crate::stdout::print_json;
use anyhow::anyhow;
use clap::Args;
use jiff::{SignedDuration, Timestamp};
use semascan_inspection::ports::Catalogue;
use semascan_model::InspectionId;
use semascan_store::data::{DataFolder, Retention};
use std::path::PathBuf;

/// Arguments of `semascan gc`.
#[derive(Debug, Args)]
pub(crate) struct GcArgs {
    /// The data folder
    data: PathBuf,
    /// Remove inspections that ended more than so many days ago
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u32).range(1..=36500))]
    older_than: Option<u32>,
    /// Remove the oldest inspections until the rest has at most so many gigabytes (10^9 bytes)
    #[arg(long, value_name = "GB", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    keep_gb: Option<u64>,
    /// Never remove this inspection from now on (repeatable)
    #[arg(long, value_name = "ID")]
    hold: Vec<InspectionId>,
    /// Let retention remove this inspection again (repeatable)
    #[arg(long, value_name = "ID")]
    release: Vec<InspectionId>,
    /// Only say what would be removed
    #[arg(long)]
    dry_run: bool,
}

impl GcArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let data = open_for_writing(&self.data)?;
        let named = |id: &InspectionId| match data.catalogue().inspection(*id) {
            Ok(Some(_)) => Ok(()),
            Ok(None) => Err(Failure::Call(anyhow!("{}: holds no inspection {id}", self.data.display()))),
            Err(error) => Err(error.into()),
        };
        self.hold.iter().chain(&self.release).try_for_each(named)?;
        for (ids, held) in [(&self.hold, true), (&self.release, false)] {
            ids.iter().try_for_each(|id| data.catalogue().hold(*id, held))?;
        }
        let age = self.older_than.map(|days| SignedDuration::from_hours(24 * i64::from(days)));
        let retention = Retention { age, bytes: self.keep_gb.map(|gb| gb * 1_000_000_000) };
        let removed = data.collect(&retention, Timestamp::now(), self.dry_run)?;
        let verb = if self.dry_run { "would be removed" } else { "removed" };
        for one in &removed {
            tracing::info!("inspection {}: {} kB {verb}", one.id, one.bytes / 1000);
        }
        let bytes: u64 = removed.iter().map(|one| one.bytes).sum();
        tracing::info!("{} inspections with {} MB {verb}", removed.len(), bytes / 1_000_000);
        Ok(())
    }
}

/// Arguments of `semascan verify`.
#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The data folder
    data: PathBuf,
    /// Print what was found as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl VerifyArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let data = DataFolder::open_beside(&self.data)?;
        let verified = data.verify()?;
        for fault in &verified.faults {
            tracing::error!("{}: {}", self.data.join(&fault.file).display(), fault.reason);
        }
        tracing::info!(
            "{} inspections, {} files, {} captured views, {} reviews, {} changes of accounts and {} blobs read; {} faults",
            verified.inspections,
            verified.files,
            verified.views,
            verified.reviews,
            verified.account_entries,
            verified.blobs,
            verified.faults.len()
        );
        if self.json {
            print_json(&verified)?;
        }
        if verified.faults.is_empty() {
            return Ok(());
        }
        Err(Failure::Work(anyhow!("{}: {} files are missing or damaged", self.data.display(), verified.faults.len())))
    }
}

/// Arguments of `semascan backup`.
#[derive(Debug, Args)]
pub(crate) struct BackupArgs {
    /// The data folder
    data: PathBuf,
    /// The folder to copy it into, which must be empty or not be there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl BackupArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let backup = DataFolder::open_beside(&self.data)?.back_up(&self.out)?;
        tracing::info!(
            "{} inspections ({} of them running), {} files and {} MB copied to {}",
            backup.inspections,
            backup.running,
            backup.files,
            backup.bytes / 1_000_000,
            self.out.display()
        );
        Ok(())
    }
}

/// Opens a data folder that is there for writing; a slip of the name makes no new one.
fn open_for_writing(folder: &std::path::Path) -> Result<DataFolder, Failure> {
    drop(DataFolder::open_beside(folder)?);
    Ok(DataFolder::open(folder)?)
}
