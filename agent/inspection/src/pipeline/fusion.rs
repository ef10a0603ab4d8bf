//! The stages that need the model: a view is registered against what the views before it made, and becomes part of it;
//! after the last one all poses are refined together.

use super::{InFlight, InspectionSink, PipelineConfig, PipelineError, Stage, Surface, ViewOutcome, staged};
use crate::source::SourceInfo;
use image::RgbImage;
use semascan_perception::fuse::{
    Associator, FuseError, Integration, LabelledView, MapConfig, SemanticMap, TouchedChunk, voxel_for,
};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::{Method, ModelSurface, Registrar, Registration, RegistrationInput};
use semascan_perception::view::View;
use std::time::Duration;

/// The stages that need the model: registration against it, and integration into it.
pub(super) struct Fusion<'a> {
    info: &'a SourceInfo,
    config: &'a PipelineConfig,
    sink: &'a dyn InspectionSink,
    registrar: &'a mut dyn Registrar,
    associator: Option<Associator>,
    map: Option<SemanticMap>,
    /// Views in the map, in order.
    accepted: Vec<u32>,
}

impl<'a> Fusion<'a> {
    /// Begins with an empty model.
    pub(super) fn new(
        info: &'a SourceInfo,
        config: &'a PipelineConfig,
        sink: &'a dyn InspectionSink,
        registrar: &'a mut dyn Registrar,
    ) -> Self {
        let associator = config.association.map(Associator::new);
        Self { info, config, sink, registrar, associator, map: None, accepted: Vec::new() }
    }

    /// Takes one view the rest of its way; whether it became part of the model.
    pub(super) fn view(&mut self, in_flight: InFlight) -> Result<bool, PipelineError> {
        let InFlight { index, mut timings, result, mut view } = in_flight;
        let (mut registration, mut segmentation, mut misidentified) = (None, None, Vec::new());
        let result = match (result, &mut view) {
            (Err(reason), _) => Err(reason),
            (Ok(_), None) => Err("view was lost on its way".to_owned()),
            (Ok(mut surface), Some(view)) => {
                let posed = self.register(index, view, &surface, &mut timings);
                match posed {
                    Err(reason) => {
                        segmentation = Some(surface.segmentation);
                        Err(reason)
                    }
                    Ok(posed) => {
                        if let Some(associator) = &mut self.associator {
                            let Surface { cloud, segmentation } = &mut surface;
                            let pose = &posed.table_from_camera;
                            misidentified = associator.associate(self.map.as_ref(), cloud, pose, segmentation);
                        }
                        let labelled = LabelledView {
                            index,
                            cloud: surface.cloud,
                            rgb: std::mem::replace(&mut view.rgb, RgbImage::new(0, 0)),
                            segmentation: surface.segmentation,
                            table_from_camera: posed.table_from_camera,
                        };
                        let in_table = posed.method != Method::CameraIsFrame;
                        let integrated = self.integrate(&labelled, in_table, &mut timings)?;
                        view.rgb = labelled.rgb;
                        registration = Some(posed);
                        segmentation = Some(labelled.segmentation);
                        integrated
                    }
                }
            }
        };
        if let (Some(map), Ok(integration)) = (&self.map, &result) {
            let publish = || -> Result<(), String> {
                self.sink.map_changed(map, &integration.touched, false);
                Ok(())
            };
            let _ = staged(self.sink, &mut timings, index, Stage::Publish, publish);
        }
        let accepted = result.is_ok();
        if accepted {
            self.registrar.accepted();
            self.accepted.push(index);
        }
        self.sink.view_done(&ViewOutcome { index, view, segmentation, registration, misidentified, result, timings });
        Ok(accepted)
    }

    fn register(
        &mut self,
        index: u32,
        view: &View,
        surface: &Surface,
        timings: &mut Vec<(Stage, Duration)>,
    ) -> Result<Registration, String> {
        let input = RegistrationInput {
            view,
            cloud: &surface.cloud,
            segmentation: &surface.segmentation,
            model: self.map.as_ref().map(|map| map as &dyn ModelSurface),
        };
        let registrar = &mut *self.registrar;
        staged(self.sink, timings, index, Stage::Register, || registrar.register(&input))
    }

    fn integrate(
        &mut self,
        view: &LabelledView,
        in_table: bool,
        timings: &mut Vec<(Stage, Duration)>,
    ) -> Result<Result<Integration, String>, PipelineError> {
        if self.map.is_none() {
            self.map = new_map(self.info, self.config, &view.cloud, in_table)?;
        }
        Ok(match &mut self.map {
            Some(map) => staged(self.sink, timings, view.index, Stage::Fuse, || map.integrate(view)),
            None => Err("no depth in the whole picture".to_owned()),
        })
    }

    /// Refines all poses, makes the map anew with them, and marks outliers.
    pub(super) fn finish(self) -> Result<Option<SemanticMap>, PipelineError> {
        let Some(mut map) = self.map else { return Ok(None) };
        let last = self.accepted.last().copied().unwrap_or(0);
        let mut touched = Vec::new();
        let refined = staged(self.sink, &mut Vec::new(), last, Stage::Refine, || -> Result<bool, FuseError> {
            let Some(refinement) = self.registrar.refine() else { return Ok(false) };
            // Chunks that vanish must be told as well as those that come.
            touched = map.chunk_ids();
            map.rebuild(&refinement.table_from_camera)?;
            self.sink.refined(&self.accepted, &refinement);
            Ok(true)
        });
        let marked = map.mark_outliers(&self.config.filter);
        if refined == Ok(true) {
            touched.extend(map.chunk_ids());
            touched.sort_unstable();
            touched.dedup();
        } else {
            touched = marked;
        }
        let touched: Vec<_> = touched.into_iter().map(|id| TouchedChunk { id, made: 0, relabelled: 0 }).collect();
        self.sink.map_changed(&map, &touched, true);
        Ok(Some(map))
    }
}

/// A map for views like the first one; `None` if that has no depth. The measuring volume is known in the source's table
/// frame only: where the model stands in another (`in_table` is false), nothing counts as background.
fn new_map(
    info: &SourceInfo,
    config: &PipelineConfig,
    cloud: &OrganizedCloud,
    in_table: bool,
) -> Result<Option<SemanticMap>, PipelineError> {
    let Some(voxel) = config.voxel.or_else(|| voxel_for(cloud)) else { return Ok(None) };
    let taxonomy = &info.taxonomy;
    let mut settings = MapConfig::new(voxel, taxonomy.component_count(), taxonomy.defect_count());
    settings.volume = info.volume.filter(|_| in_table);
    settings.uncertainty = config.uncertainty;
    Ok(Some(SemanticMap::new(settings)?))
}
