//! Has a mesh made where one is needed, looks up picks on it, and notices that the model has changed since it was measured.

use super::{Kind, MeasureEvent, Survey};
use crate::features::FeatureEvent;
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use semascan_model::SemanticMesh;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// See the module.
pub(super) struct MeasureController {
    host: Host,
    /// The survey of a mesh, and the mesh's revision: it takes a while to prepare.
    survey: RefCell<Option<(u64, Survey<Arc<SemanticMesh>>)>>,
}

impl MeasureController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new(Self { host: host.clone(), survey: RefCell::default() })
    }

    /// Asks for a mesh where `kind` needs one and there is none of the model as it is.
    fn prepare(&self, kind: Kind) {
        if kind.needs_mesh() && self.host.ui.read(|s| s.has_model() && s.features.mesh.is_wanted()) {
            self.host.ui.send_feature(MeshEvent::Requested);
        }
    }

    /// Looks a pick up on the mesh.
    fn look_up(&self, kind: Kind, place: [f32; 3]) -> Result<super::Taken, String> {
        if self.host.ui.read(|s| s.features.mesh.is_wanted() || s.features.mesh.is_running()) {
            self.prepare(kind);
            return Err("The mesh is being made: pick again in a moment.".into());
        }
        let mesh = self.host.mesh.borrow();
        let held = mesh.mesh().ok_or("There is no mesh.")?;
        let mut survey = self.survey.borrow_mut();
        if survey.as_ref().is_none_or(|(revision, _)| *revision != mesh.revision()) {
            *survey = Some((mesh.revision(), Survey::new(held.clone(), self.host.model.borrow().voxel())));
        }
        match survey.as_ref() {
            Some((_, survey)) => survey.take(kind, &self.host.ui.read(|s| s.features.measure.taken.clone()), place),
            None => Err("There is no mesh.".into()),
        }
    }
}

impl Controller for MeasureController {
    fn handle(&self, event: &FeatureEvent) {
        let FeatureEvent::Measure(event) = event else { return };
        let (kind, surveying) = self.host.ui.read(|s| (s.features.measure.kind, s.features.measure.surveying));
        match (event, kind) {
            (MeasureEvent::Choose(Some(kind)), _) => self.prepare(*kind),
            (MeasureEvent::Picked(Some(point)), Some(kind)) if surveying => {
                let found = self.look_up(kind, point.position).map(Box::new);
                self.host.ui.send_feature(MeasureEvent::Surveyed(found));
            }
            _ => {}
        }
    }

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None && self.host.ui.read(|s| s.features.measure.is_current()) {
            self.host.ui.send_feature(MeasureEvent::Outdated);
        }
    }
}
