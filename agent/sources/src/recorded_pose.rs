//! Recorded poses as evidence. No format of recordings states how far off its poses may be: that is assumed.

use nalgebra::Isometry3;
use semascan_perception::view::{PoseEvidence, covariance_of_prior};

/// Standard deviations that are assumed of what robots record: radians and metres.
pub(crate) const OF_ROBOTS: (f64, f64) = (0.01, 0.003);

/// A recorded pose, off by standard deviations in radians and metres; none where there is none.
pub(crate) fn evidence(table_from_camera: Option<Isometry3<f64>>, (rotation, translation): (f64, f64)) -> PoseEvidence {
    table_from_camera.map_or(PoseEvidence::None, |table_from_camera| PoseEvidence::World {
        table_from_camera,
        covariance: covariance_of_prior(rotation, translation),
    })
}
