//! `semascan inspect S --out DIR`: one inspection without a browser.

use super::criteria_file::CriteriaFile;
use super::signals::Signals;
use super::spec_args::SpecArgs;
use super::{Failure, config, keep, numbers, report, run, serve, source};
use crate::stdout::print_json;
use anyhow::anyhow;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use run::{Running, Target};
use semascan_inspection::Inspection;
use semascan_inspection::event::{EventKind, StageStatus};
use semascan_inspection::source::CaptureTrigger;
use semascan_inspection::spec::InspectionSpec;
use semascan_store::data::DataFolder;
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `semascan inspect`.
#[derive(Debug, Args)]
#[command(after_long_help = source::help())]
pub(crate) struct InspectArgs {
    /// What to inspect: `virtual:starter-motor?seed=7&views=5`, a BOP scene folder, or a folder of PCD files (`--help` lists
    /// all)
    source: String,
    /// Folder to write the inspection into
    #[arg(long, value_name = "DIR", required_unless_present_any = ["data", "config"])]
    out: Option<PathBuf>,
    /// Data folder to keep the inspection in while it runs: its views as a capture, its history and its model. One with
    /// the same settings that was cut off there is continued
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "overwrite", "view_clouds"])]
    data: Option<PathBuf>,
    /// Replace the earlier inspection that the folder holds, when the new one is whole: until then, and where the new one
    /// fails, the earlier one stays. A folder with other files is refused
    #[arg(long)]
    overwrite: bool,
    /// Configuration of the cell; `semascan config --sample` prints one with every key
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    #[command(flatten)]
    inspection: SpecArgs,
    /// Judge what was found by these criteria; `semascan judge` does so later
    #[arg(long, value_name = "TOML")]
    criteria: Option<PathBuf>,
    /// Also write each view as a semantic cloud of its own: DIR/views/000000.ply
    #[arg(long)]
    view_clouds: bool,
    /// Threads to compute with; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = numbers::threads(), allow_negative_numbers = true)]
    threads: Option<usize>,
    /// Print the record as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl InspectArgs {
    pub(crate) fn run(self, quiet: bool, signals: &Signals) -> Result<(), Failure> {
        serve::use_threads(self.threads)?;
        let config = config::read(self.config.as_deref()).map_err(Failure::Call)?;
        let spec = config.complete(self.inspection.apply(config.inspection.clone()), Some(self.source.clone()));
        let criteria = self.criteria.as_deref().map(CriteriaFile::open).transpose()?;
        // Whether the result can be written is known before anything is opened.
        let data = self.data.as_ref().or(config.cell.data.as_ref().filter(|_| self.out.is_none()));
        let (inspection, target) = match (&self.out, data) {
            (_, Some(data)) => keep(spec, data, criteria.as_ref())?,
            (Some(out), None) => {
                let target = Target::open(out, self.overwrite, self.view_clouds)?;
                let earlier = target.earlier_findings(&self.source);
                let inspection = run::prepare(spec.clone())?.with_earlier_findings(earlier);
                let taxonomy = &inspection.info().taxonomy;
                let criteria = criteria.map(|criteria| criteria.for_classes(&spec, taxonomy)).transpose()?;
                (inspection, target.judged_by(criteria))
            }
            (None, None) => {
                return Err(Failure::Call(anyhow!(
                    "neither --out nor --data names a folder, nor cell.data in the configuration"
                )));
            }
        };
        let out = target.path().to_owned();
        let bar = if quiet { ProgressBar::hidden() } else { progress_bar(inspection.views_expected()) };
        let mut running = run::start(inspection, Some(target), signals)?;
        if let Some(trigger) = running.trigger.take().filter(|_| std::io::stdin().is_terminal()) {
            bar.suspend(|| tracing::info!("Enter takes a view of what the camera sees"));
            std::thread::spawn(move || asked_by_lines(std::io::stdin().lock(), &trigger));
        }
        let _in_span = running.span().entered();
        follow(&mut running, &bar);
        let inspected = run::finish_and_end(running, signals);
        bar.finish_and_clear();
        let inspected = inspected?;
        if !quiet {
            report::print(&inspected.record, &out)?;
        }
        let printed = if self.json { print_json(&inspected.record) } else { Ok(()) };
        run::verdict(&inspected.record, signals)?;
        printed
    }
}

/// An inspection that is kept in the data folder `data`. One with the same settings that was cut off is continued; others
/// stay for `semascan serve`, or until they are asked for.
fn keep(spec: InspectionSpec, data: &Path, criteria: Option<&CriteriaFile>) -> Result<(Inspection, Target), Failure> {
    let spec = keep::anchored(spec);
    let data = Arc::new(DataFolder::open(data)?);
    let asked = serde_json::to_string(&spec)?;
    let mut same = None;
    for interrupted in data.interrupted()? {
        let id = interrupted.row.id;
        if same.is_none() && interrupted.row.spec == asked {
            same = Some(interrupted);
        } else {
            tracing::warn!(
                "inspection {id} of {} was cut off; semascan serve --data continues it",
                interrupted.row.source
            );
        }
    }
    let told = |text: &str| {
        if !text.is_empty() {
            tracing::error!("{text}");
        }
    };
    keep::prepare(spec, &data, criteria, same.as_ref(), Box::new(told))
}

fn progress_bar(views: Option<u32>) -> ProgressBar {
    let bar = views.map_or_else(ProgressBar::no_length, |n| ProgressBar::new(n.into()));
    // A template that indicatif cannot read costs the decoration only.
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} views  {elapsed}  {wide_msg}") {
        bar.set_style(style);
    }
    bar
}

/// Asks for a view with each line that a person types, until they end.
fn asked_by_lines(lines: impl BufRead, trigger: &CaptureTrigger) {
    for _ in lines.lines().map_while(Result::ok) {
        if !trigger.ask() {
            tracing::warn!("so many views were asked for that this request is not taken in");
        }
    }
}

/// Moves the bar with the inspection until its end.
fn follow(running: &mut Running, bar: &ProgressBar) {
    for event in &mut running.events {
        match &event.kind {
            EventKind::Planned { view } => bar.suspend(|| tracing::debug!("{}", report::of_planned(view))),
            EventKind::PlanEnded { why, .. } => bar.suspend(|| tracing::debug!("no more views are planned: {why}")),
            EventKind::Stage { view, stage, status: StageStatus::Started } => {
                bar.set_message(format!("view {view}: {}", stage.name()));
                bar.suspend(|| tracing::trace!("view {view}: {} begins", stage.name()));
            }
            EventKind::ViewFinished { record, .. } => {
                if let Some(reason) = &record.reason {
                    bar.suspend(|| tracing::warn!("view {} left out: {reason}", record.index));
                }
                bar.suspend(|| tracing::debug!("{}", report::of_view(record)));
                bar.inc(1);
            }
            EventKind::Refined { poses, .. } => {
                bar.suspend(|| tracing::debug!("{} poses refined; the map is made anew with them", poses.len()));
            }
            EventKind::Measured { .. } => bar.suspend(|| tracing::debug!("the final model is meshed and measured")),
            EventKind::Judged { .. } => bar.suspend(|| tracing::debug!("the poses are compared with the pictures")),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_asks_for_a_view() {
        let trigger = CaptureTrigger::default();
        asked_by_lines("\n\nnow\n".as_bytes(), &trigger);
        assert_eq!(trigger.waiting(), 3);
    }
}
