//! Makes the mesh: passes the model's changes on to the mesh worker, and takes what comes back.

use super::{Mesh, MeshEvent, part_counts};
use crate::features::FeatureEvent;
use crate::features::view::{Controller, Host};
use crate::mesh_worker::{Reply, Request};
use crate::scene::ModelChange;
use crate::state::notices::{Level, Topic};
use crate::words::t;
use semascan_geometry::measure::model_figures;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::rc::Rc;

/// What the worker does not know of the model yet.
#[derive(Default)]
struct Unsent {
    everything: bool,
    chunks: BTreeSet<[i32; 3]>,
}

/// See the module.
pub(super) struct MeshController {
    host: Host,
    unsent: RefCell<Unsent>,
    /// Which of the workers so far has been sent the model, from 1.
    sent_to: Cell<u32>,
}

impl MeshController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        let controller = Rc::new(Self { host: host.clone(), unsent: RefCell::default(), sent_to: Cell::default() });
        let receiver = Rc::downgrade(&controller);
        host.mesh_worker.subscribe(move |reply| {
            if let Some(controller) = receiver.upgrade() {
                controller.receive(reply);
            }
        });
        controller
    }

    /// Makes the mesh of the model as it is now.
    fn make(&self) -> Result<(), String> {
        if self.host.model.borrow().halvings() > 0 {
            // It would have holes, and areas would be of what is left.
            return Err(t!("mesh.thinned").into());
        }
        let worker = &self.host.mesh_worker;
        worker.start()?;
        let unsent = std::mem::take(&mut *self.unsent.borrow_mut());
        let anew = self.sent_to.replace(worker.starts()) != worker.starts() || unsent.everything;
        let model = self.host.model.borrow();
        let ids: Vec<[i32; 3]> = if anew {
            worker.send(&Request::Clear)?;
            model.chunks().map(|(id, _)| id).collect()
        } else {
            unsent.chunks.into_iter().collect()
        };
        for id in ids {
            worker.send(&match model.chunk(id) {
                Some(chunk) => Request::Chunk { id, voxel: model.voxel(), cloud: chunk.cloud.clone().into() },
                None => Request::Gone(id),
            })?;
        }
        worker.send(&Request::Mesh)
    }

    fn receive(&self, reply: &Reply) {
        let ui = self.host.ui;
        let event = match reply {
            Reply::Progress { done, total } => MeshEvent::Progress { done: *done, total: *total },
            Reply::Mesh(mesh) => {
                self.host.mesh.borrow_mut().set(mesh.clone());
                (self.host.redraw)();
                ui.retract(Topic::Mesh);
                ui.send_feature(MeshEvent::Counted(part_counts(mesh)));
                ui.send_feature(MeshEvent::Made { triangles: mesh.triangles.len() as u64 });
                let model = self.host.model.borrow();
                MeshEvent::Measured(Box::new(model_figures(&model.to_cloud(), mesh, model.voxel())))
            }
            Reply::Cancelled => MeshEvent::Cancelled,
            Reply::Failed(reason) => {
                ui.notify(Level::Error, Topic::Mesh, t!("mesh.failed", reason));
                // A worker that failed may have lost what it knew.
                self.host.mesh_worker.stop();
                MeshEvent::Cancelled
            }
            Reply::Reference(_)
            | Reply::NoReference(_)
            | Reply::Deviation { .. }
            | Reply::Opened(_)
            | Reply::NotOpened(_) => return,
        };
        ui.send_feature(event);
    }
}

impl Controller for MeshController {
    fn handle(&self, event: &FeatureEvent) {
        let done = match event {
            FeatureEvent::Mesh(MeshEvent::Requested) => self.make(),
            FeatureEvent::Mesh(MeshEvent::CancelRequested) => self.host.mesh_worker.send(&Request::Cancel),
            _ => return,
        };
        if let Err(reason) = done {
            self.host.ui.notify(Level::Error, Topic::Mesh, reason);
            self.host.ui.send_feature(MeshEvent::Cancelled);
        }
    }

    /// Notes what of the model the worker must be sent before the next mesh.
    fn model_changed(&self, change: ModelChange) {
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
            self.host.mesh.borrow_mut().clear();
            (self.host.redraw)();
        }
        let goes_out_of_date = self.host.ui.read(|s| {
            let mesh: &Mesh = &s.features.mesh;
            (mesh.triangles > 0 || mesh.is_running()) && !mesh.outdated
        });
        if goes_out_of_date {
            self.host.ui.send_feature(MeshEvent::Outdated);
        }
    }
}
