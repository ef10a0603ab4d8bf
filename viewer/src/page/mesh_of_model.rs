//! The mesh of the model: orders to the mesh worker, and what comes back.

use super::stage::Stage;
use crate::app::Event;
use crate::app::notices::Level;
use crate::app::surface::{Reference, SurfaceEvent};
use crate::link::DecodedChunk;
use crate::model::ModelChange;
use crate::surface::{MeshWorker, Order, Reply};
use leptos::prelude::*;
use semascan_model::SemanticMesh;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::File;

/// What the page has of the mesh.
#[derive(Default)]
pub(super) struct MeshOfModel {
    worker: RefCell<Option<MeshWorker>>,
    /// What the worker does not know of the model yet.
    unsent: RefCell<Unsent>,
    mesh: RefCell<Option<SemanticMesh>>,
    deviations: RefCell<Vec<f32>>,
}

#[derive(Default)]
struct Unsent {
    everything: bool,
    chunks: BTreeSet<[i32; 3]>,
}

impl MeshOfModel {
    /// Notes what of the model the worker must hear of before the next mesh.
    pub(super) fn follow(&self, stage: &Stage, change: ModelChange) {
        let mut unsent = self.unsent.borrow_mut();
        match change {
            ModelChange::None => return,
            ModelChange::Cleared | ModelChange::Exchanged => {
                unsent.everything = true;
                unsent.chunks.clear();
            }
            ModelChange::Replaced(id) | ModelChange::Removed(id) => drop(unsent.chunks.insert(id)),
        }
        drop(unsent);
        if change == ModelChange::Cleared {
            self.mesh.borrow_mut().take();
            self.deviations.borrow_mut().clear();
            stage.graphics.show_mesh(None);
        }
        let (there, known) =
            stage.state.with_untracked(|s| (s.surface.triangles > 0 || s.surface.is_running(), s.surface.outdated));
        if there && !known {
            stage.send.run(Event::Surface(SurfaceEvent::Outdated));
        }
    }

    /// Puts the mesh into the renderer.
    pub(super) fn show(&self, stage: &Stage) {
        let (mesh, deviations) = (self.mesh.borrow(), self.deviations.borrow());
        stage.graphics.show_mesh(mesh.as_ref().map(|mesh| (mesh, deviations.as_slice())));
        stage.redraw();
    }

    /// The mesh, if it is made.
    pub(super) fn mesh(&self) -> Option<SemanticMesh> {
        self.mesh.borrow().clone()
    }

    /// Makes the mesh of the model as it is now.
    pub(super) fn make(stage: &Rc<Stage>) {
        let this = &stage.mesh;
        let unsent = std::mem::take(&mut *this.unsent.borrow_mut());
        let model = stage.model.borrow();
        // A worker that is new has heard of nothing.
        let fresh = this.worker.borrow().is_none();
        if fresh || unsent.everything {
            Self::tell(stage, Order::Clear);
        }
        let voxel = model.voxel();
        let order = |id: [i32; 3]| match model.chunk(id) {
            Some(c) => {
                let (revision, hash, cloud) = (c.revision, c.hash, c.cloud.clone());
                Order::Chunk(DecodedChunk { id, revision, epoch: 0, voxel, hash, cloud }.into())
            }
            None => Order::Gone(id),
        };
        let ids: Vec<[i32; 3]> = if fresh || unsent.everything {
            model.chunks().map(|(id, _)| id).collect()
        } else {
            unsent.chunks.into_iter().collect()
        };
        ids.into_iter().for_each(|id| Self::tell(stage, order(id)));
        Self::tell(stage, Order::Mesh);
    }

    /// Stops making the mesh.
    pub(super) fn cancel(stage: &Rc<Stage>) {
        Self::tell(stage, Order::Cancel);
    }

    /// Compares with nothing any more.
    pub(super) fn forget(stage: &Rc<Stage>) {
        stage.mesh.deviations.borrow_mut().clear();
        stage.mesh.show(stage);
        Self::tell(stage, Order::Forget);
        stage.send.run(Event::Surface(SurfaceEvent::Forgotten));
    }

    /// Compares with `file` from now on.
    pub(super) fn compare(stage: &Rc<Stage>, file: File) {
        let (stage, name) = (stage.clone(), file.name());
        stage.send.run(Event::Surface(SurfaceEvent::Reading(name.clone())));
        spawn_local(async move {
            match JsFuture::from(file.array_buffer()).await {
                Ok(buffer) => {
                    let bytes = js_sys::Uint8Array::new(&buffer).to_vec();
                    Self::tell(&stage, Order::Reference { name, bytes });
                }
                Err(error) => Self::hear(&stage, Reply::NoReference(format!("{name} could not be read: {error:?}"))),
            }
        });
    }

    fn tell(stage: &Rc<Stage>, order: Order) {
        let mut worker = stage.mesh.worker.borrow_mut();
        if worker.is_none() {
            let hears = Rc::downgrade(stage);
            let started = MeshWorker::start(move |reply| {
                if let Some(stage) = hears.upgrade() {
                    Self::hear(&stage, reply);
                }
            });
            match started {
                Ok(started) => *worker = Some(started),
                Err(error) => return Self::trouble(stage, "The mesh worker cannot start", &error),
            }
        }
        if let Some(Err(error)) = worker.as_ref().map(|w| w.tell(order)) {
            Self::trouble(stage, "The mesh worker cannot be reached", &error);
        }
    }

    fn hear(stage: &Rc<Stage>, reply: Reply) {
        let this = &stage.mesh;
        let event = match reply {
            Reply::Progress { done, total } => SurfaceEvent::Progress { done, total },
            Reply::Mesh(mesh) => {
                let triangles = mesh.triangles.len() as u64;
                this.deviations.borrow_mut().clear();
                this.mesh.borrow_mut().replace(*mesh);
                this.show(stage);
                SurfaceEvent::Made { triangles }
            }
            Reply::Cancelled => SurfaceEvent::Cancelled,
            Reply::Failed(reason) => {
                stage.send.run(Event::Notify { level: Level::Error, text: format!("There is no mesh: {reason}") });
                // A worker that failed may have lost what it knew.
                this.worker.borrow_mut().take();
                SurfaceEvent::Cancelled
            }
            Reply::Reference { name, triangles, points, millimetres } => {
                if stage.state.with_untracked(|s| s.surface.wants_mesh()) {
                    Self::make(stage);
                }
                SurfaceEvent::Reference(Reference { name, triangles, points, millimetres })
            }
            Reply::NoReference(reason) => {
                stage.send.run(Event::Notify { level: Level::Error, text: format!("No reference: {reason}") });
                SurfaceEvent::NoReference
            }
            Reply::Deviation { of_vertices, figures } => {
                *this.deviations.borrow_mut() = of_vertices;
                this.show(stage);
                SurfaceEvent::Compared(figures)
            }
        };
        stage.send.run(Event::Surface(event));
    }

    fn trouble(stage: &Rc<Stage>, what: &str, error: &JsValue) {
        stage.send.run(Event::Notify { level: Level::Error, text: format!("{what}: {error:?}") });
        stage.send.run(Event::Surface(SurfaceEvent::Cancelled));
    }
}
