//! Has a mesh made where one is needed, looks up picks on it, notices that the model has changed since it was measured, and asks
//! the agent for what is kept with the inspection.

use super::kept::MeasurementsAnswer;
use super::{Kind, MeasureEvent, Picking, Survey};
use crate::features::FeatureEvent;
use crate::features::mesh::MeshEvent;
use crate::features::review::ReviewEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use crate::words::t;
use semascan_model::SemanticMesh;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::Arc;
use wasm_bindgen_futures::spawn_local;

/// See the module.
pub(super) struct MeasureController {
    host: Host,
    /// The survey of a mesh, and the mesh's revision: it takes a while to prepare.
    survey: RefCell<Option<(u64, Survey<Arc<SemanticMesh>>)>>,
    /// Counts what the agent is asked: an answer to an earlier question comes too late.
    asked: Rc<Cell<u64>>,
}

impl MeasureController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new(Self { host: host.clone(), survey: RefCell::default(), asked: Rc::default() })
    }

    /// Asks for a mesh where `kind` needs one and there is none of the model as it is.
    fn prepare(&self, kind: Kind) {
        if kind.needs_mesh() && self.host.ui.read(|s| s.has_model() && s.features.mesh.is_wanted()) {
            self.host.ui.send_feature(MeshEvent::Requested);
        }
    }

    /// Asks for what is kept with the inspection that is reviewed.
    fn ask(&self) {
        let ui = self.host.ui;
        let id = ui.read(|s| s.features.review.case.inspection.clone());
        let (agent, asked) = (self.host.agent.clone(), Rc::clone(&self.asked));
        asked.set(asked.get() + 1);
        let mine = asked.get();
        spawn_local(async move {
            // Without an answer what is known stays; the findings say that the agent is away.
            let answer = agent.get::<MeasurementsAnswer>(&format!("/api/v1/inspections/{id}/measurements")).await;
            let is_shown = asked.get() == mine && ui.read(|s| s.features.review.case.inspection == id);
            if let (Ok(answer), true) = (answer, is_shown) {
                ui.send_feature(MeasureEvent::Known(answer.items));
            }
        });
    }

    /// Looks a pick up on the mesh.
    fn look_up(&self, kind: Kind, place: [f32; 3]) -> Result<super::Taken, String> {
        if self.host.ui.read(|s| s.features.mesh.is_wanted() || s.features.mesh.is_running()) {
            self.prepare(kind);
            return Err(t!("measure.mesh_first").into());
        }
        let mesh = self.host.mesh.borrow();
        let held = mesh.mesh().ok_or(t!("mesh.none"))?;
        let mut survey = self.survey.borrow_mut();
        if survey.as_ref().is_none_or(|(revision, _)| *revision != mesh.revision()) {
            *survey = Some((mesh.revision(), Survey::new(held.clone(), self.host.model.borrow().voxel())));
        }
        match survey.as_ref() {
            Some((_, survey)) => survey.take(kind, &self.host.ui.read(|s| s.features.measure.taken.clone()), place),
            None => Err(t!("mesh.none").into()),
        }
    }
}

impl Controller for MeasureController {
    fn handle(&self, event: &FeatureEvent) {
        if let FeatureEvent::Review(ReviewEvent::Known(_)) = event {
            self.ask();
        }
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
