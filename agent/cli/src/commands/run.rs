//! What every command that inspects has in common: a source opened, an inspection begun, its result judged and written. The
//! folder that it is written into says from the beginning on how the inspection stands.

use super::Failure;
use super::source::open;
use anyhow::{Context, anyhow};
use semascan_inspection::spec::InspectionSpec;
use semascan_inspection::{Inspected, Inspection, InspectionHandle, StopSwitch};
use semascan_model::record::{InspectionRecord, Outcome, RunRecord};
use semascan_store::{begin_folder, write_inspection, write_record, write_view_clouds};
use std::path::{Path, PathBuf};

/// An inspection of the source that `spec` names, ready to begin.
pub(crate) fn prepare(spec: InspectionSpec) -> Result<Inspection, Failure> {
    let uri = spec.source.uri.as_deref().ok_or_else(|| Failure::Call(anyhow!("no source is named")))?;
    spec.depth_scale().map_err(|e| Failure::Call(e.into()))?;
    let source = open(uri, &spec)?;
    Ok(Inspection::new(spec, source)?)
}

/// The folder that an inspection is written into.
pub(crate) struct Output {
    folder: PathBuf,
    begun: Box<InspectionRecord>,
}

impl Output {
    /// Begins the folder: it holds a record that says that the inspection runs.
    ///
    /// # Errors
    /// [`Failure`] if the folder holds something already and is not to be overwritten, or cannot be written.
    pub(crate) fn begin(folder: &Path, inspection: &Inspection, overwrite: bool) -> Result<Self, Failure> {
        let begun = Box::new(inspection.record());
        begin_folder(folder, &begun, overwrite)?;
        Ok(Self { folder: folder.to_owned(), begun })
    }

    fn write(&self, inspected: &Inspected) -> Result<(), Failure> {
        let written = write_inspection(&self.folder, inspected);
        if let Err(error) = &written {
            let outcome = Outcome::Failed { reason: error.to_string() };
            self.note(&InspectionRecord { outcome, ..inspected.record.clone() });
        }
        Ok(written.context("the inspection could not be written")?)
    }

    /// Writes what there is to say of an inspection without a model.
    fn note(&self, record: &InspectionRecord) {
        if let Err(error) = write_record(&self.folder, record) {
            tracing::error!("the record could not be written: {error}");
        }
    }
}

/// Waits for the end, judges the model where its source knows the truth, and writes all into `output`.
pub(crate) fn finish(handle: InspectionHandle, output: Option<&Output>) -> Result<Inspected, Failure> {
    let mut inspected = match handle.wait() {
        Ok(inspected) => inspected,
        Err(error) => {
            let failure = anyhow!("{error}");
            if let Some(output) = output {
                let lost = || InspectionRecord {
                    outcome: Outcome::Failed { reason: failure.to_string() },
                    ..(*output.begun).clone()
                };
                output.note(&error.into_record().unwrap_or_else(lost));
            }
            return Err(Failure::Work(failure));
        }
    };
    judge(&mut inspected);
    if let Some(output) = output {
        output.write(&inspected)?;
    }
    Ok(inspected)
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
/// [`Failure::Work`] that says what is missing.
pub(crate) fn verdict(record: &InspectionRecord) -> Result<(), Failure> {
    let views = record.views.len();
    match (&record.outcome, &record.run) {
        (Outcome::Stopped, _) => Err(Failure::Work(anyhow!("stopped after {views} views; the model is that of these"))),
        (_, Some(RunRecord { used, share, least_share, sufficient: false, .. })) => Err(Failure::Work(anyhow!(
            "{used} of {views} views became part of the model, {:.0} %, and {:.0} % are asked for (--least-views)",
            100.0 * share,
            100.0 * least_share
        ))),
        _ => Ok(()),
    }
}

/// Writes each view that became part of the model as a semantic cloud of its own into `folder`.
pub(crate) fn write_views(folder: &Path, inspected: &Inspected) -> Result<(), Failure> {
    let taxonomy = &inspected.source.info().taxonomy;
    write_view_clouds(folder, inspected.model.read().kept_views(), taxonomy)
        .context("the clouds of the views could not be written")?;
    Ok(())
}

/// Ends the inspection early when the process is interrupted, so that what was inspected is written; interrupted again,
/// the process ends at once.
pub(crate) fn stop_when_interrupted(stop: StopSwitch) {
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else { return };
        runtime.block_on(async {
            interrupted().await;
            tracing::warn!("stopping after the view in work; once more to end at once");
            stop.set();
            interrupted().await;
            std::process::exit(1);
        });
    });
}

/// Completes when the process is asked to end.
pub(crate) async fn interrupted() {
    let interrupt = async {
        if tokio::signal::ctrl_c().await.is_err() {
            // Without signals the process can still be killed.
            std::future::pending::<()>().await;
        }
    };
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut terminate) = signal(SignalKind::terminate()) {
            tokio::select! {
                () = interrupt => {}
                _ = terminate.recv() => {}
            }
            return;
        }
    }
    interrupt.await;
}
