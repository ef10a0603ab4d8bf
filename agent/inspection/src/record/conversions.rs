//! From what registration and fusion report to what the record keeps.

use nalgebra::{Isometry3, Matrix6, Quaternion, UnitQuaternion};
use semascan_model::record::{
    GlobalRecord, IcpRecord, MisidentificationRecord, PhotometricRecord, PoseRecord, QuaternionRecord,
    RefinementRecord, RegistrationRecord, ViewNetworksRecord, WindowRecord,
};
use semascan_perception::fuse::Misidentification;
use semascan_perception::register::{IcpReport, JointRefinement, Method, Relocalization};
use semascan_perception::reprojection::{CONVENTION, ReprojectionReport};
use semascan_perception::segment::network::ViewDetail;

/// A pose as the record keeps it.
pub fn pose_record(pose: &Isometry3<f64>) -> PoseRecord {
    let q = pose.rotation.coords;
    let rotation = QuaternionRecord { x: q.x, y: q.y, z: q.z, w: q.w };
    PoseRecord { rotation, translation: pose.translation.vector.into() }
}

/// A recorded pose as a rigid motion; its quaternion is normalized.
pub fn isometry(pose: &PoseRecord) -> Isometry3<f64> {
    let QuaternionRecord { x, y, z, w } = pose.rotation;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(pose.translation.into(), rotation)
}

/// How a pose was estimated.
pub(crate) fn registration_record(method: &Method) -> RegistrationRecord {
    match method {
        Method::Kinematic => RegistrationRecord::Kinematic,
        Method::KeptPrior(reason) => RegistrationRecord::KeptPrior { reason: reason.to_string() },
        Method::Icp(report) => RegistrationRecord::Icp { icp: icp_record(report) },
        Method::CameraIsFrame => RegistrationRecord::CameraIsFrame,
        Method::Relocalized(found) => {
            RegistrationRecord::Relocalized { global: global_record(found), icp: found.icp.as_ref().map(icp_record) }
        }
    }
}

fn global_record(r: &Relocalization) -> GlobalRecord {
    let found = &r.found;
    GlobalRecord {
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

fn icp_record(r: &IcpReport) -> IcpRecord {
    IcpRecord {
        iterations: r.iterations,
        overlap: r.overlap,
        sigma: r.sigma,
        fit_before: r.fit_before,
        fit_after: r.fit_after,
        eigenvalues: r.degeneracy.eigenvalues,
        frozen_directions: r.degeneracy.frozen.iter().map(|f| f.twist).collect(),
    }
}

/// An object that is not what its label says.
pub(crate) fn misidentification_record(m: &Misidentification) -> MisidentificationRecord {
    MisidentificationRecord {
        instance: m.instance,
        class: m.class,
        against: m.against,
        model_class: m.model_class,
        share: m.share,
    }
}

/// How a refinement went.
pub(crate) fn refinement_record(r: &JointRefinement) -> RefinementRecord {
    RefinementRecord { edges: r.edges, rounds: r.rounds, fit_before: r.fit_before, fit_after: r.fit_after }
}

/// How well estimated poses and, where there are such, kinematic ones agree with the pictures: the first and the second set
/// of `r`.
pub fn photometric_record(r: &ReprojectionReport) -> PhotometricRecord {
    let error = |set: usize| r.errors.get(set).copied().flatten();
    PhotometricRecord {
        convention: CONVENTION.into(),
        error: error(0),
        prior_error: error(1),
        unknown: r.unknown().map(str::to_owned),
        views: r.views as u64,
        compared: r.compared as u64,
        pairs: r.pairs as u64,
        searched: r.searched as u64,
        still: r.still as u64,
        matches: r.matches as u64,
    }
}

/// What networks said of a view.
pub(crate) fn view_networks_record(detail: &ViewDetail) -> ViewNetworksRecord {
    let window = detail.window.map(|w| WindowRecord { left: w.left, top: w.top, width: w.width, height: w.height });
    ViewNetworksRecord { window, domain: detail.domain, components: detail.components, defects: detail.defects }
}

/// Rows of a covariance.
pub(crate) fn rows(covariance: &Matrix6<f64>) -> [[f64; 6]; 6] {
    std::array::from_fn(|r| std::array::from_fn(|c| covariance[(r, c)]))
}
