//! `semascan evaluate --photometric OUT SOURCE`: how well the poses of an inspection, the robot's and those of other programs
//! agree with the pictures.

use super::Failure;
use super::source::open;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::anyhow;
use semascan_evaluation::{PoseFile, judge_poses};
use semascan_inspection::record::photometric_record;
use semascan_inspection::spec::{InspectionSpec, LengthUnit};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Judges the poses of `inspection` and of `others` by the pictures of `source`, and prints how well they agree.
pub(super) fn judge(
    inspection: &Path,
    others: &[PathBuf],
    source: &Path,
    unit: Option<LengthUnit>,
    json: bool,
) -> Result<(), Failure> {
    let paths = || std::iter::once(inspection).chain(others.iter().map(PathBuf::as_path));
    let files = paths().map(PoseFile::read).collect::<Result<Vec<_>, _>>()?;
    let mut spec = InspectionSpec::default();
    spec.source.unit = unit;
    let uri = source.to_str().ok_or_else(|| Failure::Call(anyhow!("{}: not UTF-8", source.display())))?;
    let mut source = open(uri, &spec)?;
    let judged = judge_poses(source.as_mut(), &files)?;

    let report = &judged.report;
    let mut names: Vec<String> = files.iter().map(|f| f.path.display().to_string()).collect();
    if judged.kinematic {
        names.push("kinematic".into());
    }
    let mut out = Stderr::default();
    for reason in &judged.unreadable {
        writeln!(out, "left out: {reason}")?;
    }
    if judged.unposed > 0 {
        writeln!(out, "left out: {} views without a pose in every file", judged.unposed)?;
    }
    writeln!(
        out,
        "{} views, {} pairs with common ground, {} of them with enough matches: {} matches of {} corners, {} stand still \
         with the camera",
        report.views, report.compared, report.pairs, report.matches, report.searched, report.still
    )?;
    for (name, error) in names.iter().zip(&report.errors) {
        match error {
            Some(error) => writeln!(out, "{error:>8.2} px  {name}")?,
            None => writeln!(out, "not known    {name}: {}", report.unknown().unwrap_or("a view has no pose"))?,
        }
    }
    let record = photometric_record(report);
    writeln!(out, "  {}", record.convention)?;
    if json {
        let poses: Vec<_> =
            names.iter().zip(&report.errors).map(|(name, error)| json!({ "name": name, "error": error })).collect();
        let report = json!({
            "source": uri, "convention": record.convention, "poses": poses, "unknown": record.unknown,
            "views": record.views, "compared": record.compared, "pairs": record.pairs, "searched": record.searched,
            "still": record.still, "matches": record.matches, "unreadable": judged.unreadable, "unposed": judged.unposed,
        });
        print_json(&report)?;
    }
    Ok(())
}
