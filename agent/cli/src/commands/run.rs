//! What every command that inspects has in common: a source opened, an inspection begun, its result judged and written.

use super::Failure;
use super::source::open;
use anyhow::{Context, anyhow};
use semascan_inspection::spec::InspectionSpec;
use semascan_inspection::{Inspected, Inspection, InspectionHandle};
use semascan_store::{write_inspection, write_view_clouds};
use std::path::Path;

/// An inspection of the source that `spec` names, ready to begin.
pub(crate) fn prepare(spec: InspectionSpec) -> Result<Inspection, Failure> {
    let uri = spec.source.uri.as_deref().ok_or_else(|| Failure::Call(anyhow!("no source is named")))?;
    let source = open(uri, &spec.source.camera_mask)?;
    Ok(Inspection::new(spec, source)?)
}

/// Waits for the end, and judges the model where its source knows the truth.
#[cfg(feature = "demo")]
pub(crate) fn finish(handle: InspectionHandle) -> Result<Inspected, Failure> {
    let mut inspected = handle.wait()?;
    inspected.record.truth = semascan_evaluation::judge_inspection(&inspected);
    Ok(inspected)
}

/// Waits for the end. This build has no metrics to judge the model with.
#[cfg(not(feature = "demo"))]
pub(crate) fn finish(handle: InspectionHandle) -> Result<Inspected, Failure> {
    Ok(handle.wait()?)
}

/// Writes the inspection into `folder`.
pub(crate) fn write(folder: &Path, inspected: &Inspected) -> Result<(), Failure> {
    write_inspection(folder, inspected).context("the inspection could not be written")?;
    Ok(())
}

/// Writes each view that became part of the model as a semantic cloud of its own into `folder`.
pub(crate) fn write_views(folder: &Path, inspected: &Inspected) -> Result<(), Failure> {
    let taxonomy = &inspected.source.info().taxonomy;
    write_view_clouds(folder, inspected.model.read().kept_views(), taxonomy)
        .context("the clouds of the views could not be written")?;
    Ok(())
}
