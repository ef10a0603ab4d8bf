//! The stages that need the model: a view is registered against what the views before it made, and becomes part of it;
//! after the last one all poses are refined together, and compared with the pictures.

use super::{PipelineConfig, Segmented, Surface, run_stage};
use crate::bus::EventBus;
use crate::event::{EventKind, ProcessedView, SharedModel};
use crate::record::{
    misidentification_record, photometric_record, pose_record, refinement_record, registration_record, rows,
    view_networks_record,
};
use crate::source::SourceInfo;
use nalgebra::{Isometry3, Matrix6};
use semascan_model::record::{Stage, StageTime, ViewPose, ViewRecord};
use semascan_perception::fuse::{
    Associator, FuseError, Integration, LabelledView, MapConfig, Misidentification, SemanticMap, TouchedChunk,
    voxel_for,
};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::{Method, ModelSurface, Registrar, Registration, RegistrationInput};
use semascan_perception::reprojection::{JudgedPicture, Pictures};
use semascan_perception::segment::Segmentation;
use semascan_perception::view::View;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Voxels of the largest model whose noisy surfaces are made thin when the inspection is stopped: whoever stopped it waits
/// for seconds only, and the mesh has to be made in them as well. With depth noise of one to two voxels, thinning and the
/// marking of outliers take 2 to 4 microseconds of processor time a voxel: 2 s at most for so many on one core.
const THINNED_WHEN_STOPPED: usize = 1 << 19;

/// Registration against the model, and integration into it.
pub(super) struct Fusion<'a> {
    info: &'a SourceInfo,
    config: &'a PipelineConfig,
    events: &'a EventBus,
    registrar: &'a mut dyn Registrar,
    associator: Option<Associator>,
    model: Option<SharedModel>,
    /// Views in the model, in order.
    accepted: Vec<Accepted>,
    /// Their pictures, or those of some of them, for the judge.
    pictures: Pictures,
}

/// A view that became part of the model.
struct Accepted {
    view: u32,
    /// As registered.
    table_from_camera: Isometry3<f64>,
    /// From kinematics alone.
    prior: Option<Isometry3<f64>>,
    /// Covariance over (rotation, translation) of the pose as registered, camera frame.
    covariance: Matrix6<f64>,
}

/// A finished model.
pub(super) struct Finished {
    pub(super) model: SharedModel,
    /// Whether its noisy surfaces were made thin.
    pub(super) thinned: bool,
    /// The views in it, each with the covariance of its pose over (rotation, translation), camera frame.
    pub(super) covariances: BTreeMap<u32, Matrix6<f64>>,
}

/// What these stages made of one view.
#[derive(Default)]
struct Fused {
    segmentation: Option<Segmentation>,
    registration: Option<Registration>,
    misidentified: Vec<Misidentification>,
    sharpness: Option<f64>,
}

impl<'a> Fusion<'a> {
    /// Begins with an empty model.
    pub(super) fn new(
        info: &'a SourceInfo,
        config: &'a PipelineConfig,
        events: &'a EventBus,
        registrar: &'a mut dyn Registrar,
    ) -> Self {
        let associator = config.association.map(Associator::new);
        Self {
            info,
            config,
            events,
            registrar,
            associator,
            model: None,
            accepted: Vec::new(),
            pictures: Pictures::default(),
        }
    }

    /// Takes one view the rest of its way.
    ///
    /// # Errors
    /// [`FuseError`] if the map cannot be set up.
    pub(super) fn add(&mut self, segmented: Segmented) -> Result<(), FuseError> {
        let Segmented { index, mut timings, view, result } = segmented;
        let mut fused = Fused::default();
        let result = match (result, &view) {
            (Ok(surface), Some(view)) => self.register_and_fuse(view, surface, &mut fused, &mut timings)?,
            (Ok(_), None) => Err("view was lost on its way".to_owned()),
            (Err(reason), _) => Err(reason),
        };
        if let (Some(model), Ok(integration)) = (&self.model, &result) {
            self.registrar.accepted();
            self.publish_model(model, Some(index), integration.touched.clone(), false);
        }
        let registration = fused.registration.as_ref();
        let record = ViewRecord {
            index,
            stamp: view.as_ref().and_then(|v| v.stamp),
            accepted: result.is_ok(),
            sharpness: fused.sharpness,
            points_added: result.as_ref().map_or(0, |i| i.points_added),
            reason: result.err(),
            pose: registration.map(|r| pose_record(&r.table_from_camera)),
            prior: registration.and_then(|r| r.prior.as_ref()).map(pose_record),
            covariance: registration.map(|r| rows(&r.covariance)),
            registration: registration.map(|r| registration_record(&r.method)),
            networks: fused.segmentation.as_ref().and_then(|s| s.network.as_deref()).map(view_networks_record),
            misidentified: fused.misidentified.iter().map(misidentification_record).collect(),
            timings,
        };
        let Fused { segmentation, registration, .. } = fused;
        let view = view.map(|view| Arc::new(ProcessedView { view, segmentation, registration }));
        self.events.publish(EventKind::ViewFinished { record: Box::new(record), view });
        Ok(())
    }

    /// The outer error ends the inspection, the inner one leaves the view out.
    fn register_and_fuse(
        &mut self,
        view: &View,
        surface: Surface,
        fused: &mut Fused,
        timings: &mut Vec<StageTime>,
    ) -> Result<Result<Integration, String>, FuseError> {
        let Surface { cloud, mut segmentation, sharpness } = surface;
        fused.sharpness = sharpness;
        // Where the view was taken, by the model so far.
        let registered = {
            let map = self.model.as_ref().map(SharedModel::read);
            let model = map.as_deref().map(|map| map as &dyn ModelSurface);
            let input = RegistrationInput { view, cloud: &cloud, segmentation: &segmentation, model };
            let registrar = &mut *self.registrar;
            run_stage(self.events, timings, view.index, Stage::Register, || registrar.register(&input))
        };
        let registration = match registered {
            Ok(registration) => registration,
            Err(reason) => {
                fused.segmentation = Some(segmentation);
                return Ok(Err(reason));
            }
        };
        // Its objects get the model's numbers.
        if let Some(associator) = &mut self.associator {
            let map = self.model.as_ref().map(SharedModel::read);
            let pose = &registration.table_from_camera;
            fused.misidentified = associator.associate(map.as_deref(), &cloud, pose, &mut segmentation);
        }
        // It becomes part of the model, which its first view sets up.
        if self.model.is_none() {
            let in_table = registration.method != Method::CameraIsFrame;
            self.model = new_map(self.info, self.config, &cloud, in_table)?.map(SharedModel::new);
        }
        let labelled = LabelledView {
            index: view.index,
            cloud,
            rgb: Arc::clone(&view.rgb),
            segmentation,
            table_from_camera: registration.table_from_camera,
        };
        let place = self.accepted.len();
        let (result, picture) = match &self.model {
            Some(model) => {
                let mut picture = None;
                let result = run_stage(self.events, timings, view.index, Stage::Fuse, || {
                    // Locked here, not by a thread of the pool: a reader of the model may be waiting for all of these.
                    let mut guard = model.write();
                    let map = &mut *guard;
                    let wanted = self.pictures.wants(place);
                    let judged = || wanted.then(|| judged_picture(self.info, &labelled));
                    let integrated;
                    (integrated, picture) = rayon::join(|| map.integrate(&labelled), judged);
                    integrated
                });
                (result, picture)
            }
            None => (Err("no depth in the whole picture".to_owned()), None),
        };
        if result.is_ok() {
            self.accepted.push(Accepted {
                view: view.index,
                table_from_camera: registration.table_from_camera,
                prior: registration.prior,
                covariance: registration.covariance,
            });
            if let Some(picture) = picture {
                self.pictures.keep(place, picture);
            }
        }
        fused.segmentation = Some(labelled.segmentation);
        fused.registration = Some(registration);
        Ok(result)
    }

    /// The model so far; none before its first view.
    pub(super) fn model(&self) -> Option<&SharedModel> {
        self.model.as_ref()
    }

    /// Views that are in the model.
    pub(super) fn used(&self) -> usize {
        self.accepted.len()
    }

    /// Refines all poses, makes the map anew with them, makes noisy surfaces thin and marks outliers; the final model, `None`
    /// if no view is in it. A refinement that fails is published as a failed stage, and the model stays as it was. Who
    /// `stopped` the inspection does not wait for a refinement, nor for a judgement of the poses, nor for the surfaces of a
    /// large model.
    pub(super) fn finish(self, stopped: bool) -> Option<Finished> {
        let model = self.model.clone().filter(|_| !self.accepted.is_empty())?;
        let mut covariances: BTreeMap<u32, Matrix6<f64>> =
            self.accepted.iter().map(|a| (a.view, a.covariance)).collect();
        if stopped {
            let (touched, thinned) = model.write().finish_in_short_time(&self.config.filter, THINNED_WHEN_STOPPED);
            self.publish_model(&model, None, untouched(touched), true);
            return Some(Finished { model, thinned, covariances });
        }
        let last = self.accepted.last().map_or(0, |accepted| accepted.view);
        let mut poses: Vec<Isometry3<f64>> = self.accepted.iter().map(|a| a.table_from_camera).collect();
        // Chunks that a rebuild touched: those that vanish are published as well as those that come.
        let mut rebuilt = None;
        let _ = run_stage(self.events, &mut Vec::new(), last, Stage::Refine, || -> Result<(), FuseError> {
            let Some(refinement) = self.registrar.refine() else { return Ok(()) };
            {
                let mut map = model.write();
                let mut chunks = map.chunk_ids();
                map.rebuild(&refinement.table_from_camera)?;
                chunks.extend(map.chunk_ids());
                rebuilt = Some(chunks);
            }
            poses.clone_from(&refinement.table_from_camera);
            covariances = self.accepted.iter().map(|a| a.view).zip(refinement.covariances.iter().copied()).collect();
            let refined = self.accepted.iter().zip(poses.iter().zip(&refinement.covariances));
            let refined = refined
                .map(|(a, (pose, covariance))| ViewPose {
                    view: a.view,
                    pose: pose_record(pose),
                    covariance: rows(covariance),
                })
                .collect();
            self.events.publish(EventKind::Refined { poses: refined, refinement: refinement_record(&refinement) });
            Ok(())
        });
        let mut touched = model.write().finish(&self.config.filter);
        touched.extend(rebuilt.unwrap_or_default());
        touched.sort_unstable();
        touched.dedup();
        self.publish_model(&model, None, untouched(touched), true);
        // All views have a kinematic pose, or they are not compared by it.
        let priors: Option<Vec<Isometry3<f64>>> = self.accepted.iter().map(|a| a.prior).collect();
        let judged = match &priors {
            Some(priors) => self.pictures.judge(&[&poses, priors]),
            None => self.pictures.judge(&[&poses]),
        };
        self.events.publish(EventKind::Judged { photometric: Box::new(photometric_record(&judged)) });
        Some(Finished { model, thinned: true, covariances })
    }

    fn publish_model(&self, model: &SharedModel, view: Option<u32>, touched: Vec<TouchedChunk>, complete: bool) {
        let (epoch, voxel) = {
            let map = model.read();
            (map.epoch(), map.config().voxel)
        };
        let model = Some(model.clone());
        self.events.publish(EventKind::ModelChanged { epoch, voxel, view, touched, complete, model });
    }
}

/// Chunks without voxels that are new or relabelled.
fn untouched(chunks: Vec<[i32; 3]>) -> Vec<TouchedChunk> {
    chunks.into_iter().map(|id| TouchedChunk { id, made: 0, relabelled: 0 }).collect()
}

/// What the judge of poses gets to see of a view.
fn judged_picture(info: &SourceInfo, view: &LabelledView) -> JudgedPicture {
    let labelled = |i: usize| view.segmentation.components.best(i) != 0;
    JudgedPicture::new(&view.rgb, &view.cloud, info.turntable.is_some().then_some(&labelled as _))
}

/// A map for views like the first one; `None` if that has no depth. The measuring volume is known in the source's table
/// frame only: where the model stands in another (`in_table` is false), nothing counts as background.
fn new_map(
    info: &SourceInfo,
    config: &PipelineConfig,
    cloud: &OrganizedCloud,
    in_table: bool,
) -> Result<Option<SemanticMap>, FuseError> {
    let Some(voxel) = config.voxel.or_else(|| voxel_for(cloud)) else { return Ok(None) };
    let taxonomy = &info.taxonomy;
    let mut settings = MapConfig::new(voxel, taxonomy.component_count(), taxonomy.defect_count());
    settings.volume = info.volume.filter(|_| in_table);
    settings.uncertainty = config.uncertainty;
    Ok(Some(SemanticMap::new(settings)?))
}
