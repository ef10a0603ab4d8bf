//! Registration of a whole inspection: each view against the model so far, all of them again at the end.

use super::global::GlobalConfig;
use super::joint_refinement::{JointConfig, JointRefinement, RefinedView};
use super::kinematics::{Prior, prior};
use super::model_view::ModelView;
use super::projective_icp::{Aligned, IcpConfig, NotAligned, align};
use super::refinement_set::RefinementSet;
use super::registration::{Method, RegisterError, Registrar, Registration, RegistrationInput, Relocalization};
use super::relocalization::{Pictures, Proposal, camera_as_frame, find};
use super::se3::adjoint;
use super::selection::Selection;
use super::source_points::SourcePoints;
use super::texture::ViewTexture;
use crate::view::PoseEvidence;
use nalgebra::{Isometry3, Matrix6};

/// Points that take part in an alignment: more do not make it better.
const POINTS: usize = 80_000;
/// Columns of the picture that the refinement keeps of a view.
const KEPT_COLUMNS: usize = 640;
/// Points that the refinement keeps of a view.
const KEPT_POINTS: usize = 12_000;
/// Fewest labelled points that can stand for the object.
const FEWEST: usize = 500;

/// Aligns views with the model (`projective_icp`) and, at the end, with each other (`joint_refinement`).
///
/// Where nothing is known of the first view, the frame of its camera becomes the table frame. What the kinematics say of
/// later views is then about another frame, and these are found in the model as if nothing were known of them either.
#[derive(Debug)]
pub struct IcpRegistrar {
    config: IcpConfig,
    selection: Selection,
    global: GlobalConfig,
    pending: Option<Pending>,
    views: RefinementSet,
    /// Whether the table frame is that of the first view's camera.
    camera_is_frame: bool,
}

/// A view that may yet become part of the model.
#[derive(Debug)]
struct Pending {
    view: RefinedView,
    camera_is_frame: bool,
}

/// What is known of a view's pose before it is aligned.
struct Known {
    /// In the table frame.
    prior: Prior,
    /// Covariance of the pose relative to the model, camera frame.
    spread: Matrix6<f64>,
    how: How,
}

/// How a prior was estimated.
enum How {
    /// From the kinematics.
    Kinematic,
    /// Nothing is known, and it is the first view.
    First,
    /// It was found in the model.
    Found(Proposal),
}

impl IcpRegistrar {
    /// Registers on the pixels of `selection`.
    pub fn new(config: IcpConfig, selection: Selection) -> Self {
        let (pending, views) = (None, RefinementSet::default());
        Self { config, selection, global: GlobalConfig::default(), pending, views, camera_is_frame: false }
    }

    /// How far the whole model may be off where the first view put it, seen from a camera at `table_from_camera`: the
    /// first view's covariance, carried there.
    fn model_covariance(&self, table_from_camera: &Isometry3<f64>) -> Matrix6<f64> {
        self.views.first().map_or_else(Matrix6::zeros, |first| {
            let carry = adjoint(&(table_from_camera.inverse() * first.prior));
            carry * first.covariance * carry.transpose()
        })
    }

    /// The selection that suits the view: all of it, where it has hardly any labels.
    fn selection_for(&self, input: &RegistrationInput<'_>) -> Selection {
        let labelled = || (0..input.cloud.depth.len()).filter(|&i| Selection::Object.includes(input, i));
        let few = self.selection == Selection::Object && labelled().take(FEWEST).count() < FEWEST;
        if few { Selection::Everything } else { self.selection }
    }

    /// What is known of the view's pose before it is aligned.
    fn known(
        &self,
        input: &RegistrationInput<'_>,
        source: &SourcePoints,
        selection: Selection,
        texture: Option<&ViewTexture>,
    ) -> Result<Known, RegisterError> {
        match prior(input.view) {
            Ok(prior) if !self.camera_is_frame => {
                let spread = prior.covariance + self.model_covariance(&prior.table_from_camera);
                Ok(Known { prior, spread, how: How::Kinematic })
            }
            Ok(_) | Err(RegisterError::NoEvidence) => {
                let Some(model) = input.model else {
                    let prior = camera_as_frame();
                    return Ok(Known { prior, spread: prior.covariance, how: How::First });
                };
                let known: Vec<(&ModelView, &ViewTexture)> =
                    self.views.kept().filter_map(|view| Some((&view.surface, view.appearance()?))).collect();
                let pictures = Pictures { own: texture, known: &known };
                let (mut prior, found) = find(source, input, model, selection, pictures, &self.global)?;
                // It was found in the model, wherever that stands.
                let spread = prior.covariance;
                prior.covariance += self.model_covariance(&prior.table_from_camera);
                Ok(Known { prior, spread, how: How::Found(found) })
            }
            Err(error) => Err(error),
        }
    }
}

impl Registrar for IcpRegistrar {
    fn register(&mut self, input: &RegistrationInput<'_>) -> Result<Registration, RegisterError> {
        let selection = self.selection_for(input);
        let wanted: Vec<bool> = (0..input.cloud.depth.len()).map(|i| selection.includes(input, i)).collect();
        let label = |i: usize| input.segmentation.components.best(i);
        let stride = |most: usize| {
            let count = wanted.iter().filter(|w| **w).count();
            (count as f64 / most as f64).sqrt().ceil().max(1.0) as usize
        };
        let source = SourcePoints::select(input.cloud, stride(POINTS), label, |i| wanted[i]);
        let coarse = (input.cloud.intrinsics.width as usize).div_ceil(KEPT_COLUMNS);
        // On a turntable the light stands still and the part turns under it: its picture is no evidence of where exactly it
        // is, but of which side is seen.
        let refines = self.selection == Selection::Everything;
        let texture = (refines || self.camera_is_frame || input.view.pose == PoseEvidence::None)
            .then(|| ViewTexture::of(&input.view.rgb, input.cloud, coarse, |i| wanted[i]))
            .flatten();
        let Known { prior, spread, how } = self.known(input, &source, selection, texture.as_ref())?;
        let camera = &input.view.intrinsics;
        let start = &prior.table_from_camera;
        let aligned = input.model.map(|model| align(&source, camera, model, start, &spread, &self.config));
        let registration = concluded(&prior, how, aligned)?;
        let (texture, side) = if refines { (texture, None) } else { (None, texture) };
        let pose = registration.table_from_camera;
        self.pending = Some(Pending {
            view: RefinedView {
                surface: ModelView::of(input.cloud, pose, coarse, label, |i| wanted[i]),
                texture,
                side,
                points: source.thinned(source.len().div_ceil(KEPT_POINTS)),
                prior: prior.table_from_camera,
                covariance: prior.covariance,
                registered: registration.covariance,
            },
            camera_is_frame: registration.method == Method::CameraIsFrame,
        });
        Ok(registration)
    }

    fn accepted(&mut self) {
        if let Some(Pending { view, camera_is_frame }) = self.pending.take() {
            self.views.push(view);
            self.camera_is_frame |= camera_is_frame;
        }
    }

    fn refine(&mut self) -> Option<JointRefinement> {
        let IcpConfig { weakest, same_label, .. } = self.config;
        self.views.refine(&JointConfig { weakest, same_label })
    }
}

/// The pose of a view, from what was known before and how the alignment from there went.
fn concluded(
    prior: &Prior,
    how: How,
    aligned: Option<Result<Aligned, NotAligned>>,
) -> Result<Registration, RegisterError> {
    let Prior { mut table_from_camera, mut covariance } = *prior;
    let icp = aligned.map(|aligned| {
        aligned.map(|aligned| {
            (table_from_camera, covariance) = (aligned.table_from_camera, aligned.covariance);
            aligned.report
        })
    });
    let kinematic = matches!(how, How::Kinematic).then_some(prior.table_from_camera);
    let relocalized = |Proposal { found, seed, seen, confirmed, .. }, icp| {
        let contradicted = seen.contradiction();
        Method::Relocalized(Box::new(Relocalization { found, seed, confirmed, contradicted, icp }))
    };
    let method = match (how, icp) {
        (How::Kinematic, None) => Method::Kinematic,
        (How::Kinematic, Some(Ok(report))) => Method::Icp(Box::new(report)),
        (How::Kinematic, Some(Err(reason))) => Method::KeptPrior(reason),
        (How::First, _) => Method::CameraIsFrame,
        (How::Found(found), Some(Ok(report))) => relocalized(found, Some(report)),
        // A pose that cannot be made better is as good as one that was.
        (How::Found(found), None | Some(Err(NotAligned::Worse { .. }))) => relocalized(found, None),
        (How::Found(_), Some(Err(reason))) => return Err(RegisterError::NotConfirmed(reason)),
    };
    Ok(Registration { table_from_camera, prior: kinematic, covariance, method })
}
