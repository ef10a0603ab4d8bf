//! Inspections as the product runs them.

use anyhow::Result;
use semascan_inspection::source::Source;
use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_inspection::{Inspected, Inspection};

/// Inspects `source` as `semascan inspect` does without further arguments.
///
/// # Errors
/// If it cannot begin or no view could be used.
pub fn inspect(source: Box<dyn Source>) -> Result<Inspected> {
    inspect_with(InspectionSpec::default(), source)
}

/// Inspects `source` with the poses that kinematics give.
///
/// # Errors
/// If it cannot begin or no view could be used.
pub fn inspect_kinematic(source: Box<dyn Source>) -> Result<Inspected> {
    inspect_with(InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() }, source)
}

/// Inspects `source` as `spec` says.
///
/// # Errors
/// If it cannot begin or no view could be used.
pub fn inspect_with(spec: InspectionSpec, source: Box<dyn Source>) -> Result<Inspected> {
    Ok(Inspection::new(spec, source)?.start().wait()?)
}
