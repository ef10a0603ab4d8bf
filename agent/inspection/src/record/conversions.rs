//! From what registration and fusion report to what the record keeps.

use super::{GlobalRecord, IcpRecord, MisidentificationRecord, PoseRecord, RefinementRecord, RegistrationRecord};
use nalgebra::{Isometry3, Matrix6};
use semascan_perception::fuse::Misidentification;
use semascan_perception::register::{IcpReport, JointRefinement, Method, Relocalization};

impl From<&Isometry3<f64>> for PoseRecord {
    fn from(pose: &Isometry3<f64>) -> Self {
        let q = pose.rotation.coords;
        Self { rotation: [q.x, q.y, q.z, q.w], translation: pose.translation.vector.into() }
    }
}

impl From<&Method> for RegistrationRecord {
    fn from(method: &Method) -> Self {
        let named = |name: &str| Self { method: name.into(), reason: None, icp: None, global: None };
        match method {
            Method::Kinematic => named("kinematic"),
            Method::KeptPrior(reason) => Self { reason: Some(reason.to_string()), ..named("kept prior") },
            Method::Icp(report) => Self { icp: Some((&**report).into()), ..named("icp") },
            Method::CameraIsFrame => named("camera is frame"),
            Method::Relocalized(relocalised) => Self {
                icp: relocalised.icp.as_ref().map(Into::into),
                global: Some((&**relocalised).into()),
                ..named("relocalised")
            },
        }
    }
}

impl From<&Relocalization> for GlobalRecord {
    fn from(r: &Relocalization) -> Self {
        let found = &r.found;
        Self {
            seed: r.seed,
            voxel: found.voxel,
            overlap: found.overlap,
            runner_up: found.runner_up,
            support: found.support,
            open: found.unconstrained,
            rmse: found.rmse,
            confirmed: r.confirmed,
            contradicted: r.contradicted,
        }
    }
}

impl From<&Misidentification> for MisidentificationRecord {
    fn from(m: &Misidentification) -> Self {
        Self { instance: m.instance, class: m.class, against: m.against, model_class: m.model_class, share: m.share }
    }
}

impl From<&IcpReport> for IcpRecord {
    fn from(r: &IcpReport) -> Self {
        Self {
            iterations: r.iterations,
            overlap: r.overlap,
            sigma: r.sigma,
            fit_before: r.fit_before,
            fit_after: r.fit_after,
            eigenvalues: r.degeneracy.eigenvalues,
            frozen_directions: r.degeneracy.frozen.iter().map(|f| f.twist).collect(),
        }
    }
}

impl From<&JointRefinement> for RefinementRecord {
    fn from(r: &JointRefinement) -> Self {
        Self { edges: r.edges, rounds: r.rounds, fit_before: r.fit_before, fit_after: r.fit_after }
    }
}

/// Rows of a covariance.
pub(in crate::record) fn rows(covariance: &Matrix6<f64>) -> Vec<[f64; 6]> {
    covariance.row_iter().map(|row| std::array::from_fn(|c| row[c])).collect()
}
