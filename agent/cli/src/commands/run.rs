//! What every command that inspects has in common: a source opened, an inspection begun, its result judged and written. The
//! folder that it is written into says from the beginning on how the inspection stands, unless it holds an earlier model,
//! which stays until the new one is whole.

use super::Failure;
use super::keeping::Keeping;
use super::report_html;
use super::signals::{Signals, Work};
use super::source::open;
use anyhow::anyhow;
use jiff::Timestamp;
use semascan_formats::regular_file;
use semascan_inspection::bus::Events;
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::source::CaptureTrigger;
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_inspection::{Inspected, Inspection, InspectionHandle, StopSwitch};
use semascan_model::Taxonomy;
use semascan_model::finding::Finding;
use semascan_model::record::{InspectionRecord, Outcome, RunRecord};
use semascan_perception::segment::network::select;
use semascan_store::{Additions, Kept, ResultFolder};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// How long after a failed save the next one is tried: twice as long each time, up to a limit.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// Failed saves before a command without a server gives up.
const TRIES: u32 = 3;

/// An inspection of the source that `spec` names, ready to begin.
pub(crate) fn prepare(spec: InspectionSpec) -> Result<Inspection, Failure> {
    let uri = spec.source.uri.as_deref().ok_or_else(|| Failure::Call(anyhow!("no source is named")))?;
    check_labels(&spec)?;
    let source = open(uri, &spec)?;
    let plan = spec.plan.clone();
    Ok(semascan_planning::planned(Inspection::new(spec, source)?, &plan)?)
}

/// Finds what is wrong with a specification before a source is opened, which may take long.
///
/// # Errors
/// [`Failure`] naming the field or model.
pub(crate) fn check_labels(spec: &InspectionSpec) -> Result<(), Failure> {
    spec.depth_scale().map_err(|e| Failure::Call(e.into()))?;
    if spec.labels == LabelSource::Network {
        // Whether there are models; which of them suit the source is not known yet.
        select(&spec.network.models, &Taxonomy::from_names::<&str>(&[], &[]))?;
    }
    Ok(())
}

/// Where an inspection will be written to, opened and locked.
pub(crate) struct Target {
    given: PathBuf,
    folder: ResultFolder,
    view_clouds: bool,
    criteria: Option<Arc<CheckedCriteria>>,
    kept: Option<Keeping>,
}

impl Target {
    /// The folder, as the caller named it.
    pub(crate) fn path(&self) -> &Path {
        &self.given
    }

    /// The folder of an inspection that is kept.
    pub(crate) fn kept(self, kept: Keeping) -> Self {
        Self { kept: Some(kept), ..self }
    }

    /// Opens `folder` for an inspection, `overwrite` if it may replace the model of an earlier one; each view is written as a
    /// cloud of its own too if `view_clouds` asks for that.
    ///
    /// # Errors
    /// [`Failure`] if the folder cannot be used.
    pub(crate) fn open(folder: &Path, overwrite: bool, view_clouds: bool) -> Result<Self, Failure> {
        let given = folder.to_owned();
        Ok(Self { given, folder: ResultFolder::open(folder, overwrite)?, view_clouds, criteria: None, kept: None })
    }

    /// The same, what is found judged by `criteria`.
    pub(crate) fn judged_by(self, criteria: Option<Arc<CheckedCriteria>>) -> Self {
        Self { criteria, ..self }
    }

    /// The findings of an inspection of the same source that the folder holds: what is found again keeps its name.
    pub(crate) fn earlier_findings(&self, source: &str) -> Vec<Finding> {
        let text = regular_file::read_to_string(&self.folder.path().join("inspection.json")).unwrap_or_default();
        let earlier = InspectionRecord::from_json(&text).ok().filter(|record| record.source == source);
        earlier.and_then(|record| record.findings).map_or_else(Vec::new, |findings| findings.list)
    }
}

/// An inspection that runs.
pub(crate) struct Running {
    pub(crate) events: Events,
    pub(crate) handle: InspectionHandle,
    pub(crate) output: Option<Arc<Output>>,
    /// What is found is judged by these.
    pub(crate) criteria: Option<Arc<CheckedCriteria>>,
    /// What it can be asked for a view with, where its source can be asked.
    pub(crate) trigger: Option<CaptureTrigger>,
}

impl Running {
    /// What lines of the log belong to that speak of it.
    pub(crate) fn span(&self) -> tracing::Span {
        tracing::info_span!("inspection", id = %self.handle.id())
    }
}

/// Begins the folder and the inspection, which is judged by the criteria of its target. From now on a signal stops it, and what it has until then is written.
///
/// # Errors
/// [`Failure`] if the folder cannot be used.
pub(crate) fn start(inspection: Inspection, target: Option<Target>, signals: &Signals) -> Result<Running, Failure> {
    signals.begin(|| {
        let output = target.map(|target| Output::begin(target, &inspection)).transpose()?.map(Arc::new);
        let events = inspection.subscribe();
        let trigger = inspection.capture_trigger();
        let handle = inspection.start();
        let stop = handle.stop_switch();
        // The folder's lock goes with the inspection, not with who waits for signals.
        let late = output.as_ref().map(Arc::downgrade);
        let too_late = Box::new(move || {
            if let Some(output) = late.and_then(|output| output.upgrade()) {
                output.note(&InspectionRecord { outcome: Outcome::Stopped, ..output.begun.clone() });
            }
            tracing::error!("stopped before there was a result: what was in work took too long");
        });
        let criteria = output.as_ref().and_then(|output| output.criteria.clone());
        Ok((Running { events, handle, output, criteria, trigger }, Work { stop, too_late }))
    })
}

/// The folder that an inspection is written into.
pub(crate) struct Output {
    given: PathBuf,
    folder: ResultFolder,
    view_clouds: bool,
    criteria: Option<Arc<CheckedCriteria>>,
    kept: Option<Keeping>,
    begun: InspectionRecord,
}

impl Output {
    fn begin(target: Target, inspection: &Inspection) -> Result<Self, Failure> {
        let begun = inspection.record();
        let Target { given, folder, view_clouds, criteria, kept } = target;
        folder.publish_record(&begun)?;
        Ok(Self { given, folder, view_clouds, criteria, kept, begun })
    }

    /// The folder, as the caller named it.
    pub(crate) fn path(&self) -> &Path {
        &self.given
    }

    /// Writes the inspection and closes it where it is kept. What fails is tried again, `tries` times or, where that is absent,
    /// until it succeeds or `stop` is set; then once more for the last time. `failed` is told of each failure.
    ///
    /// # Errors
    /// [`Failure::Work`] with the reason of the last failure.
    pub(crate) fn save(
        &self,
        inspected: &mut Inspected,
        tries: Option<u32>,
        stop: &StopSwitch,
        failed: &dyn Fn(&str),
    ) -> Result<(), Failure> {
        let mut is_written = false;
        let saved = until_done(tries, stop, failed, || {
            if !is_written {
                let (model, mesh, taxonomy) = (&inspected.model, &inspected.mesh, &inspected.source.info().taxonomy);
                let report = |record: &InspectionRecord| report_html::of_inspected(model, mesh, taxonomy, record);
                let additions = Additions { view_clouds: self.view_clouds, report: Some(&report) };
                inspected.record = self.folder.publish(inspected, additions)?;
                is_written = true;
            }
            self.close(&inspected.record)
        });
        // One that is written and not closed is closed by the next start.
        saved.map_err(|failure| if is_written { failure } else { self.give_up(inspected, &failure) })
    }

    /// Notes an inspection without a model and closes it where it is kept, tried again as in [`save`](Self::save).
    fn save_record(
        &self,
        record: &InspectionRecord,
        tries: Option<u32>,
        stop: &StopSwitch,
        failed: &dyn Fn(&str),
    ) -> Result<(), Failure> {
        until_done(tries, stop, failed, || {
            if self.folder.publish_record(record)? == Kept::EarlierModel {
                tracing::warn!("{} still holds the earlier inspection, unchanged", self.given.display());
            }
            self.close(record)
        })
    }

    /// Closes the inspection where it is kept.
    fn close(&self, record: &InspectionRecord) -> Result<(), Failure> {
        self.kept.as_ref().map_or(Ok(()), |kept| kept.close(record, self.criteria.as_deref()))
    }

    fn give_up(&self, inspected: &Inspected, failure: &Failure) -> Failure {
        let reason = format!("the inspection could not be saved: {}", failure.reason());
        let outcome = Outcome::Failed { reason: reason.clone() };
        // Its model is nowhere: the record must not name points that nobody has.
        let record = InspectionRecord { outcome, points: 0, ..inspected.record.clone() };
        self.note(&record);
        Failure::Work(anyhow!("{reason}"))
    }

    /// Writes what there is to say of an inspection without a model, and says so if that is not possible.
    fn note(&self, record: &InspectionRecord) {
        match self.folder.publish_record(record) {
            Ok(Kept::Record) => {}
            Ok(Kept::EarlierModel) => {
                tracing::warn!("{} still holds the earlier inspection, unchanged", self.given.display());
            }
            Err(error) => tracing::error!("the record could not be written: {error}"),
        }
    }
}

/// Does `work`, and again after a pause where it fails, as [`Output::save`] says.
fn until_done(
    tries: Option<u32>,
    stop: &StopSwitch,
    failed: &dyn Fn(&str),
    mut work: impl FnMut() -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut pause = FIRST_PAUSE;
    for number in 1.. {
        let Err(failure) = work() else { break };
        if stop.is_set() || tries.is_some_and(|tries| number >= tries) {
            return Err(failure);
        }
        failed(&format!(
            "the inspection could not be saved: {}; its model is kept in memory, the next try is in {} s",
            failure.reason(),
            pause.as_secs()
        ));
        sleep_unless_stopped(pause, stop);
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
    Ok(())
}

fn sleep_unless_stopped(pause: Duration, stop: &StopSwitch) {
    const STEP: Duration = Duration::from_millis(50);
    let mut waited = Duration::ZERO;
    while waited < pause && !stop.is_set() {
        std::thread::sleep(STEP);
        waited += STEP;
    }
}

/// Waits for the end of an inspection, compares the model with the truth where its source knows it, judges what was found by
/// `criteria`, and writes all into `output`, as [`Output::save`] says.
///
/// # Errors
/// [`Failure`] if there is no model or it cannot be written.
pub(crate) fn finish(
    handle: InspectionHandle,
    output: Option<&Output>,
    criteria: Option<&CheckedCriteria>,
    tries: Option<u32>,
    failed: &dyn Fn(&str),
    signals: &Signals,
) -> Result<Inspected, Failure> {
    let stop = handle.stop_switch();
    let mut inspected = match handle.wait() {
        Ok(inspected) => inspected,
        Err(error) => {
            let failure = anyhow!("{error}");
            let record = error.into_record();
            let stopped = record.as_ref().is_some_and(|record| record.outcome == Outcome::Stopped);
            if let Some(output) = output {
                let lost = || InspectionRecord {
                    outcome: Outcome::Failed { reason: failure.to_string() },
                    ..output.begun.clone()
                };
                let record = record.unwrap_or_else(lost);
                if let Err(failure) = output.save_record(&record, tries, &stop, failed) {
                    tracing::error!("the record could not be written: {}", failure.reason());
                }
            }
            return Err(if stopped { Failure::stopped(signals, failure) } else { Failure::Work(failure) });
        }
    };
    // Who stops an inspection does not wait for figures.
    if !stop.is_set() {
        tracing::debug!("the model is compared with the truth, where the source knows it");
        judge(&mut inspected);
    }
    if let Some(criteria) = criteria {
        let Inspected { record, mesh, source, .. } = &mut inspected;
        let model = Some((&*mesh, &source.info().taxonomy));
        semascan_inspection::judge(record, criteria, model, Timestamp::now());
    }
    if let Some(output) = output {
        tracing::debug!("the inspection is written to {}", output.path().display());
        output.save(&mut inspected, tries, &stop, failed)?;
    }
    Ok(inspected)
}

/// [`finish`] of a command that ends then.
///
/// # Errors
/// As [`finish`].
pub(crate) fn finish_and_end(running: Running, signals: &Signals) -> Result<Inspected, Failure> {
    let Running { handle, output, criteria, .. } = running;
    finish(handle, output.as_deref(), criteria.as_deref(), Some(TRIES), &|reason| tracing::warn!("{reason}"), signals)
}

#[cfg(feature = "demo")]
fn judge(inspected: &mut Inspected) {
    inspected.record.truth = semascan_evaluation::judge_inspection(inspected);
}

/// This build has no metrics to judge the model with.
#[cfg(not(feature = "demo"))]
fn judge(_: &mut Inspected) {}

/// Whether the inspection did what it was asked to: every view was taken its way, and enough of them were used.
///
/// # Errors
/// [`Failure`] that says what is missing.
pub(crate) fn verdict(record: &InspectionRecord, signals: &Signals) -> Result<(), Failure> {
    let views = record.views.len();
    match (&record.outcome, &record.run) {
        (Outcome::Stopped, _) => {
            Err(Failure::stopped(signals, anyhow!("stopped after {views} views; the model is that of these")))
        }
        (Outcome::Failed { reason }, _) => Err(Failure::Work(anyhow!("{reason}"))),
        (_, Some(RunRecord { used, share, least_share, sufficient: false, .. })) => Err(Failure::Work(anyhow!(
            "{used} of {views} views became part of the model, {:.0} %, and {:.0} % are asked for (--least-views)",
            100.0 * share,
            100.0 * least_share
        ))),
        _ => Ok(()),
    }
}
