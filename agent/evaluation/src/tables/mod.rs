//! The papers' tables, rerun on the virtual cell, and the tables of findings, of measurements, of corrected labels, of
//! networks that were trained on them, of planned views, and of textures.

pub mod findings;
mod frozen_threshold;
pub mod labels;
pub mod measure;
pub mod p0;
pub mod p1;
pub mod p2;
pub mod planning;
mod setting;
pub mod teach;
pub mod texture;

pub use frozen_threshold::{FrozenThreshold, ValidationPoint, freeze};
pub use setting::{DomainScores, NetworkSetting, Progress};

use semascan_inspection::source::Source;
use semascan_inspection::spec::InspectionSpec;
use semascan_inspection::{Inspected, Inspection, InspectionError, SetupFailure};

/// Why an inspection of a table has no result.
#[derive(Debug, thiserror::Error)]
pub enum InspectError {
    /// It could not begin.
    #[error(transparent)]
    Setup(#[from] SetupFailure),
    /// It has no model.
    #[error(transparent)]
    Run(#[from] InspectionError),
}

/// Inspects a source as the product does; views that are left out go to the log.
fn inspect(spec: InspectionSpec, source: Box<dyn Source>) -> Result<Inspected, InspectError> {
    finish(Inspection::new(spec, source)?)
}

/// The same with the views that `spec` plans.
fn inspect_planned(spec: InspectionSpec, source: Box<dyn Source>) -> Result<Inspected, InspectError> {
    let plan = spec.plan.clone();
    finish(semascan_planning::planned(Inspection::new(spec, source)?, &plan)?)
}

fn finish(inspection: Inspection) -> Result<Inspected, InspectError> {
    let inspected = inspection.start().wait()?;
    for rejection in inspected.recorded.rejections() {
        tracing::warn!("{rejection}");
    }
    Ok(inspected)
}
