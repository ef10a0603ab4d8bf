//! From what registration and fusion report to what the record keeps.

use super::networks::{ViewNetworksRecord, WindowRecord};
use super::view::{
    GlobalRecord, IcpRecord, MisidentificationRecord, PoseRecord, QuaternionRecord, RefinementRecord,
    RegistrationRecord,
};
use nalgebra::{Isometry3, Matrix6, Quaternion, UnitQuaternion};
use semascan_perception::fuse::Misidentification;
use semascan_perception::register::{IcpReport, JointRefinement, Method, Relocalization};
use semascan_perception::segment::network::ViewDetail;

impl From<&Isometry3<f64>> for PoseRecord {
    fn from(pose: &Isometry3<f64>) -> Self {
        let q = pose.rotation.coords;
        let rotation = QuaternionRecord { x: q.x, y: q.y, z: q.z, w: q.w };
        Self { rotation, translation: pose.translation.vector.into() }
    }
}

impl From<&PoseRecord> for Isometry3<f64> {
    fn from(pose: &PoseRecord) -> Self {
        let QuaternionRecord { x, y, z, w } = pose.rotation;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Self::from_parts(pose.translation.into(), rotation)
    }
}

impl From<&Method> for RegistrationRecord {
    fn from(method: &Method) -> Self {
        match method {
            Method::Kinematic => Self::Kinematic,
            Method::KeptPrior(reason) => Self::KeptPrior { reason: reason.to_string() },
            Method::Icp(report) => Self::Icp { icp: (&**report).into() },
            Method::CameraIsFrame => Self::CameraIsFrame,
            Method::Relocalized(found) => {
                Self::Relocalized { global: (&**found).into(), icp: found.icp.as_ref().map(Into::into) }
            }
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
            unconstrained: found.unconstrained,
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

impl From<&ViewDetail> for ViewNetworksRecord {
    fn from(detail: &ViewDetail) -> Self {
        Self {
            window: detail.window.map(|w| WindowRecord { left: w.left, top: w.top, width: w.width, height: w.height }),
            components: detail.components,
            defects: detail.defects,
        }
    }
}

/// Rows of a covariance.
pub(crate) fn rows(covariance: &Matrix6<f64>) -> [[f64; 6]; 6] {
    std::array::from_fn(|r| std::array::from_fn(|c| covariance[(r, c)]))
}
