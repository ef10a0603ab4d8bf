//! What a tool is to the page: a panel, something over the 3D view, and work beyond changes of the state.

use super::{Feature, FeatureEvent};
use crate::camera::OrbitCamera;
use crate::link::api::Agent;
use crate::mesh_worker::MeshWorker;
use crate::scene::{HeldLayers, HeldMesh, HeldModel, HeldPaint, HeldPhotograph, ModelChange};
use crate::ui::Ui;
use leptos::prelude::{AnyView, IntoAny};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// The part of a tool that needs a browser.
pub trait FeatureView: Feature {
    /// The tool's panel.
    fn panel(ui: Ui) -> AnyView {
        let _ = ui;
        ().into_any()
    }

    /// What the tool lays over the 3D view.
    fn overlay(ui: Ui) -> AnyView {
        let _ = ui;
        ().into_any()
    }

    /// What carries out the tool's work beyond changes of the state; `None` if there is none.
    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        let _ = host;
        None
    }
}

/// Carries out a tool's work beyond changes of the state, and lives as long as the page.
pub trait Controller {
    /// The page is there: what follows the state may begin.
    fn begin(&self) {}

    /// Follows an event of any tool, after the state has followed it.
    fn handle(&self, event: &FeatureEvent);

    /// The model has changed.
    fn model_changed(&self, change: ModelChange) {
        let _ = change;
    }

    /// A frame was drawn.
    ///
    /// * `is_still`: whether nothing has moved for a while.
    fn drawn(&self, is_still: bool) {
        let _ = is_still;
    }
}

/// What the page lends to controllers.
#[derive(Clone)]
pub struct Host {
    /// The state, and the way to send events.
    pub ui: Ui,
    /// The model as held.
    pub model: Rc<RefCell<HeldModel>>,
    /// The mesh as held.
    pub mesh: Rc<RefCell<HeldMesh>>,
    /// The photograph as held.
    pub photograph: Rc<RefCell<HeldPhotograph>>,
    /// The photographs that colour the mesh, as held.
    pub layers: Rc<RefCell<HeldLayers>>,
    /// What of the surface is painted.
    pub paint: Rc<RefCell<HeldPaint>>,
    /// Where the model is seen from.
    pub camera: Rc<Cell<OrbitCamera>>,
    /// The worker that meshes and compares.
    pub mesh_worker: Rc<MeshWorker>,
    /// Who answers what is asked about inspections.
    pub agent: Agent,
    /// Asks for a frame.
    pub redraw: Rc<dyn Fn()>,
}
