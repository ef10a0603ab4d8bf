//! From which uncertainty on a label does not count: what networks judge by and fusion does.

/// Largest sigma of a component label that is kept: chosen on validation motors for the shipped ensemble and its two
/// augmentations, where it brings the false detection rate to less than half (`semascan tables P0 --table 5`).
pub const COMPONENT_SIGMA_LIMIT: f32 = 0.16;
/// Largest sigma of a defect label that is kept. One network is asked twice there, which is another scale.
pub const DEFECT_SIGMA_LIMIT: f32 = 0.5;
