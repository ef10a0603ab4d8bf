//! `semascan judge DIR --criteria F`: an inspection that was written, judged by criteria.
//!
//! The verdict goes into the folder's `inspection.json`, which is exchanged in one step; the decisions that people made of
//! an earlier verdict stay. With `--print-only` the folder stays as it is.

use super::{Failure, criteria_file, findings_report, report_html};
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use jiff::Timestamp;
use semascan_formats::{ply, regular_file};
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::judge;
use semascan_model::record::InspectionRecord;
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_store::{AmendError, amend_record};
use std::path::{Path, PathBuf};

/// Arguments of `semascan judge`.
#[derive(Debug, Args)]
#[command(after_long_help = help())]
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

/// A `criteria.toml` with every key, commented.
const SAMPLE: &str = include_str!("criteria.sample.toml");

fn help() -> String {
    format!(
        "Whatever the verdict is, the exit code is 0 if it could be made: 1 says that the work failed, 2 that the call was \
         wrong, as where the criteria name an unknown key or class. Scripts read `decision` of --json: accept, rework, reject, \
         or person where a person decides.\n\nA sample of criteria.toml:\n\n{SAMPLE}"
    )
}

/// Why nothing was written.
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
        if !self.print_only {
            report_html::refuse_kept(&self.folder, "see what follows with --print-only, decide in a review")?;
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
        if !self.print_only {
            // The report shows the verdict that counts.
            report_html::renew(&self.folder, &record)?;
        }
        let verdict = record.verdict.as_ref().ok_or_else(|| anyhow!("no verdict was made"))?;
        findings_report::print_verdict(&mut Stderr::default(), verdict)?;
        if self.json {
            let mut report = serde_json::to_value(verdict)?;
            report["decision"] = serde_json::to_value(verdict.decision())?;
            print_json(&report)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::criteria::Criteria;

    #[test]
    fn the_sample_can_be_used_and_shows_every_key() {
        // What is commented out is a whole section.
        let whole: String = SAMPLE
            .lines()
            .map(|line| match line.strip_prefix("# ") {
                Some(rest) if rest.starts_with('[') || rest.contains(" = ") => format!("{rest}\n"),
                _ => format!("{line}\n"),
            })
            .collect();
        let checked = CheckedCriteria::parse(&whole).expect("a right sample");
        assert!(checked.criteria.reference.is_some() && CheckedCriteria::parse(SAMPLE).is_ok());
        let schema = Criteria::json_schema().to_string();
        for key in
            schema.split('"').filter(|word| word.ends_with("_mm") || word.ends_with("_mm2") || word.contains("_share"))
        {
            assert!(whole.contains(&format!("{key} = ")), "{key}");
        }
    }
}
