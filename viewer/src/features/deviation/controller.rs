//! Compares the mesh: passes a reference on to the mesh worker, and takes what comes back.

use super::DeviationEvent;
use crate::features::FeatureEvent;
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::mesh_worker::{Reply, Request};
use crate::state::notices::{Level, Topic};
use crate::words::t;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// See the module.
pub(super) struct DeviationController {
    host: Host,
    /// Name and content of the file that is compared with, to be read again in another unit.
    file: RefCell<Option<(String, Arc<[u8]>)>>,
}

impl DeviationController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        let controller = Rc::new(Self { host: host.clone(), file: RefCell::default() });
        let receiver = Rc::downgrade(&controller);
        host.mesh_worker.subscribe(move |reply| {
            if let Some(controller) = receiver.upgrade() {
                controller.receive(reply);
            }
        });
        controller
    }

    fn receive(&self, reply: &Reply) {
        let ui = self.host.ui;
        let event = match reply {
            Reply::Mesh(_) => DeviationEvent::MeshReplaced,
            Reply::Reference(reference) => {
                if ui.read(|s| s.features.mesh.is_wanted()) {
                    ui.send_feature(MeshEvent::Requested);
                }
                DeviationEvent::Reference(reference.clone())
            }
            Reply::NoReference(reason) => {
                ui.notify(Level::Error, Topic::Reference, t!("deviation.no_reference", reason));
                DeviationEvent::NoReference
            }
            Reply::Deviation { of_vertices, figures } => {
                self.set_deviations(of_vertices.clone());
                DeviationEvent::Compared(*figures)
            }
            Reply::Progress { .. } | Reply::Cancelled | Reply::Failed(_) | Reply::Opened(_) | Reply::NotOpened(_) => {
                return;
            }
        };
        ui.send_feature(event);
    }

    fn set_deviations(&self, of_vertices: Vec<f32>) {
        self.host.mesh.borrow_mut().set_deviations(of_vertices);
        (self.host.redraw)();
    }

    fn request(&self, request: &Request) {
        if let Err(reason) = self.host.mesh_worker.send(request) {
            self.host.ui.notify(Level::Error, Topic::Reference, reason);
            self.host.ui.send_feature(DeviationEvent::NoReference);
        }
    }
}

impl Controller for DeviationController {
    fn handle(&self, event: &FeatureEvent) {
        match event {
            FeatureEvent::Deviation(DeviationEvent::FileRead { name, bytes }) => {
                *self.file.borrow_mut() = Some((name.clone(), bytes.clone()));
                self.request(&Request::Reference { name: name.clone(), unit: None, bytes: bytes.clone() });
            }
            FeatureEvent::Deviation(DeviationEvent::Unit(unit)) => {
                let file = self.file.borrow().clone();
                if let Some((name, bytes)) = file {
                    self.request(&Request::Reference { name, unit: *unit, bytes });
                }
            }
            FeatureEvent::Deviation(DeviationEvent::Removed) => {
                self.file.take();
                self.set_deviations(Vec::new());
                self.request(&Request::Forget);
            }
            _ => {}
        }
    }
}
