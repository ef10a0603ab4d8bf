//! `semascan report DIR`: what an inspection found, as a report for people or a table for quality systems.

use super::{Failure, report_html};
use anyhow::anyhow;
use clap::{Args, ValueEnum};
use semascan_model::measurement::KeptMeasurement;
use semascan_model::record::InspectionRecord;
use semascan_reports::{ReportError, components_csv, dfq, findings_csv, measurements_csv, qif};
use semascan_store::{check_place, read_record, write_file};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// One file for people with pictures of everything: report.html
    Html,
    /// The same for archives (PDF/A-2b): report.pdf
    #[cfg(feature = "pdf")]
    Pdf,
    /// Tables for spreadsheets: findings.csv, components.csv and, of kept inspections, measurements.csv
    Csv,
    /// The Q-DAS ASCII transfer format, for statistical process control: report.dfq
    Dfq,
    /// Results in the Quality Information Framework, QIF 3.0: report.qif
    Qif,
}

/// Arguments of `semascan report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The inspection's folder
    folder: PathBuf,
    /// What to write. The record itself, inspection.json, is the whole in JSON
    #[arg(long, value_enum, default_value = "html")]
    format: Format,
    /// File to write, for csv the folder to write into [default: in the inspection's folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl ReportArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if !self.folder.is_dir() {
            return Err(Failure::Call(anyhow!("{}: is no folder of an inspection", self.folder.display())));
        }
        report_html::refuse_kept(self.written_into(), "name what to write elsewhere with --out")?;
        let record = read_record(&self.folder)?;
        match self.format {
            Format::Html => {
                let path = self.path("report.html");
                check_place(&path)?;
                report_html::put(&self.folder, &path, &record)
            }
            #[cfg(feature = "pdf")]
            Format::Pdf => {
                let path = self.path("report.pdf");
                check_place(&path)?;
                let made = report_html::pdf_of_folder(&self.folder, record, jiff::Timestamp::now())?;
                write(&path, &made)
            }
            Format::Csv => {
                let (record, kept) = report_html::with_reviews(&self.folder, record)?;
                self.write_tables(&record, kept.as_deref())
            }
            Format::Dfq => {
                let (record, kept) = report_html::with_reviews(&self.folder, record)?;
                write(&self.path("report.dfq"), &made(dfq(&record, &kept.unwrap_or_default()))?)
            }
            Format::Qif => {
                let (record, kept) = report_html::with_reviews(&self.folder, record)?;
                write(&self.path("report.qif"), &made(qif(&record, &kept.unwrap_or_default()))?)
            }
        }
    }

    /// The folder that files are written into.
    fn written_into(&self) -> &Path {
        match (&self.out, self.format) {
            (None, _) => &self.folder,
            (Some(folder), Format::Csv) => folder,
            (Some(file), _) => file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| self.folder.join(name))
    }

    fn write_tables(&self, record: &InspectionRecord, kept: Option<&[KeptMeasurement]>) -> Result<(), Failure> {
        let folder = self.out.as_deref().unwrap_or(&self.folder);
        if !folder.is_dir() {
            return Err(Failure::Call(anyhow!(
                "{}: is no folder; csv writes several files into one",
                folder.display()
            )));
        }
        // All are made before one is written.
        let mut tables =
            vec![("findings.csv", made(findings_csv(record))?), ("components.csv", made(components_csv(record))?)];
        if let Some(kept) = kept {
            tables.push(("measurements.csv", made(measurements_csv(record, kept))?));
        }
        for (name, bytes) in tables {
            write(&folder.join(name), &bytes)?;
        }
        Ok(())
    }
}

fn made(bytes: Result<Vec<u8>, ReportError>) -> Result<Vec<u8>, Failure> {
    bytes.map_err(|error| Failure::Work(error.into()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    Ok(write_file(path, |out| Ok(out.write_all(bytes)?))?)
}
