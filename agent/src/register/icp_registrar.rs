//! Registration of a whole inspection: each view against the model so far, all of them again at the end.

use super::joint_refinement::{JointConfig, refine};
use super::kinematics::{Prior, prior};
use super::projective_icp::align;
use super::twist::adjoint;
use super::{
    Arrival, IcpConfig, JointRefinement, Method, ModelView, RefinedView, RegisterError, Registrar, Registration,
    SourcePoints,
};
use nalgebra::{Isometry3, Matrix6};

/// Which pixels take part in the registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All: right where everything in the picture stands still.
    Everything,
    /// Those with a component label (P1's segment ICP); all, where a view has hardly any.
    Object,
    /// Those of one component class.
    Class(u16),
}

/// Points that take part in an alignment: more do not make it better.
const POINTS: usize = 80_000;
/// Columns of the picture that the refinement keeps of a view.
const KEPT_COLUMNS: usize = 640;
/// Points that the refinement keeps of a view.
const KEPT_POINTS: usize = 12_000;
/// Fewest labelled points that can stand for the object.
const FEWEST: usize = 500;

/// Aligns views with the model (`projective_icp`) and, at the end, with each other (`joint_refinement`).
#[derive(Debug)]
pub struct IcpRegistrar {
    config: IcpConfig,
    selection: Selection,
    pending: Option<RefinedView>,
    /// In order; the first one says where the model stands.
    views: Vec<RefinedView>,
}

impl IcpRegistrar {
    /// Registers on the pixels of `selection`.
    pub fn new(config: IcpConfig, selection: Selection) -> Self {
        Self { config, selection, pending: None, views: Vec::new() }
    }

    /// How far the whole model may be off where the first view put it, seen from a camera at `table_from_camera`: the
    /// first view's covariance, carried there.
    fn model_covariance(&self, table_from_camera: &Isometry3<f64>) -> Matrix6<f64> {
        self.views.first().map_or_else(Matrix6::zeros, |first| {
            let carry = adjoint(&(table_from_camera.inverse() * first.prior));
            carry * first.covariance * carry.transpose()
        })
    }

    /// Row-major: whether a pixel takes part.
    fn wanted(&self, arrival: &Arrival<'_>) -> Vec<bool> {
        let components = &arrival.segmentation.components;
        let n = arrival.cloud.depth.len();
        let usable = |i: usize| arrival.cloud.depth[i] > 0.0;
        let mut wanted: Vec<bool> = match self.selection {
            Selection::Everything => (0..n).map(usable).collect(),
            Selection::Object => (0..n).map(|i| usable(i) && components.best(i) != 0).collect(),
            Selection::Class(class) => (0..n).map(|i| usable(i) && components.best(i) == class).collect(),
        };
        if self.selection == Selection::Object && wanted.iter().filter(|w| **w).count() < FEWEST {
            wanted = (0..n).map(usable).collect();
        }
        wanted
    }
}

impl Registrar for IcpRegistrar {
    fn register(&mut self, arrival: &Arrival<'_>) -> Result<Registration, RegisterError> {
        let Prior { table_from_camera: kinematic, covariance } = prior(arrival.view)?;
        let wanted = self.wanted(arrival);
        let label = |i: usize| arrival.segmentation.components.best(i);
        let stride = |most: usize| {
            let count = wanted.iter().filter(|w| **w).count();
            (count as f64 / most as f64).sqrt().ceil().max(1.0) as usize
        };
        let source = SourcePoints::select(arrival.cloud, stride(POINTS), label, |i| wanted[i]);
        let mut registration =
            Registration { table_from_camera: kinematic, prior: kinematic, covariance, method: Method::Kinematic };
        if let Some(model) = arrival.model {
            let camera = &arrival.view.intrinsics;
            let spread = covariance + self.model_covariance(&kinematic);
            match align(&source, camera, model, &kinematic, &spread, &self.config) {
                Ok(aligned) => {
                    registration.table_from_camera = aligned.table_from_camera;
                    registration.covariance = aligned.covariance;
                    registration.method = Method::Icp(Box::new(aligned.report));
                }
                Err(reason) => registration.method = Method::KeptPrior(reason),
            }
        }
        let coarse = (arrival.cloud.intrinsics.width as usize).div_ceil(KEPT_COLUMNS);
        let pose = registration.table_from_camera;
        self.pending = Some(RefinedView {
            surface: ModelView::of(arrival.cloud, pose, coarse, label, |i| wanted[i]),
            points: source.thinned(source.len().div_ceil(KEPT_POINTS)),
            prior: kinematic,
            covariance,
        });
        Ok(registration)
    }

    fn accepted(&mut self) {
        self.views.extend(self.pending.take());
    }

    fn refine(&mut self) -> Option<JointRefinement> {
        let IcpConfig { weakest, same_label, .. } = self.config;
        refine(&self.views, &JointConfig { weakest, same_label })
    }
}
