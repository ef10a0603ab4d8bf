//! `semascan judge DIR --criteria F`: an inspection that was written, judged by criteria.
//!
//! The verdict goes into the folder's `inspection.json`, which is exchanged in one step; the decisions that people made of
//! an earlier verdict stay. With `--print-only` the folder stays as it is.

use super::{Failure, criteria_file, findings_report};
use crate::stderr::Stderr;
use anyhow::{Context, anyhow};
use clap::Args;
use jiff::Timestamp;
use semascan_formats::{ply, regular_file};
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::judge;
use semascan_model::record::InspectionRecord;
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_store::{AmendError, amend_record};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `semascan judge`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Whatever the verdict is, the exit code is 0 if it could be made: 1 says that the work failed, 2 that the call was wrong, as where \
the criteria name an unknown key or class. Scripts read `decision` of --json: accept, rework, reject, or person where a person \
decides.")]
pub(crate) struct JudgeArgs {
    /// The inspection's folder
    folder: PathBuf,
    /// The criteria; `semascan schema criteria` prints what they may hold
    #[arg(long, value_name = "TOML")]
    criteria: PathBuf,
    /// Leave the folder as it is: the verdict is printed only
    #[arg(long)]
    print_only: bool,
    /// Print the verdict as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Why nothing was written: not an error.
enum Stop {
    Failed(Failure),
    PrintOnly(Box<InspectionRecord>),
}

impl From<AmendError> for Stop {
    fn from(error: AmendError) -> Self {
        Self::Failed(error.into())
    }
}

impl JudgeArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if !self.folder.is_dir() {
            return Err(Failure::Call(anyhow!("{}: is no folder of an inspection", self.folder.display())));
        }
        let checked = criteria_file::read(&self.criteria)?;
        let judged = amend_record(&self.folder, |record| {
            self.judge(record, &checked).map_err(Stop::Failed)?;
            if self.print_only { Err(Stop::PrintOnly(Box::new(record.clone()))) } else { Ok(()) }
        });
        let record = match judged {
            Ok(record) => record,
            Err(Stop::PrintOnly(record)) => *record,
            Err(Stop::Failed(failure)) => return Err(failure),
        };
        let verdict = record.verdict.as_ref().ok_or_else(|| anyhow!("no verdict was made"))?;
        findings_report::print_verdict(&mut Stderr::default(), verdict)?;
        if self.json {
            let mut report = serde_json::to_value(verdict)?;
            report["decision"] = serde_json::to_value(verdict.decision())?;
            writeln!(std::io::stdout().lock(), "{report}")?;
        }
        Ok(())
    }

    fn judge(&self, record: &mut InspectionRecord, checked: &CheckedCriteria) -> Result<(), Failure> {
        criteria_file::check_record(&self.criteria, checked, record)?;
        // Only a reference is compared with the mesh.
        let mesh = if checked.reference.is_some() && record.points > 0 { Some(mesh(&self.folder)?) } else { None };
        judge(record, checked, mesh.as_ref().map(|(mesh, taxonomy)| (mesh, taxonomy)), Timestamp::now());
        Ok(())
    }
}

fn mesh(folder: &Path) -> Result<(SemanticMesh, Taxonomy), Failure> {
    let path = folder.join("mesh.ply");
    let name = path.display().to_string();
    let bytes = regular_file::read(&path).with_context(|| name.clone())?;
    let model = ply::read(&name, &bytes)?;
    Ok((model.mesh, model.taxonomy))
}
