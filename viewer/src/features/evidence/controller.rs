//! Finds the photographs of the picked point, and gets the pixels of the one that is shown.

use super::pixels::pixels_at;
use super::{EvidenceEvent, sights};
use crate::features::FeatureEvent;
use crate::features::inspect::{InspectEvent, PickedPoint};
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use crate::state::AppState;
use crate::state::connection::Connection;
use crate::ui::object_url::ObjectUrl;
use glam::Vec3;
use semascan_geometry::occupancy::Occupancy;
use semascan_model::PointFlags;
use std::cell::{Cell, RefCell};
use std::rc::{Rc, Weak};
use wasm_bindgen_futures::spawn_local;

/// See the module.
pub(super) struct EvidenceController {
    host: Host,
    /// Where surface is, of the model as it is; made with the first point that is picked of it.
    surface: RefCell<Option<Occupancy>>,
    /// The view whose pixels are on their way.
    loading: Cell<Option<u32>>,
    this: Weak<Self>,
}

impl EvidenceController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            surface: RefCell::default(),
            loading: Cell::default(),
            this: this.clone(),
        })
    }

    /// Says which photographs show a point.
    fn find(&self, point: PickedPoint) {
        let mut surface = self.surface.borrow_mut();
        if surface.is_none() {
            *surface = self.surface_of_model();
        }
        let (place, normal) = (Vec3::from(point.position), Vec3::from(point.normal));
        let sights = self.host.ui.read(|s| sights(place, normal, s.views.iter(), surface.as_ref()));
        drop(surface);
        self.host.ui.send_feature(EvidenceEvent::Found { point, sights });
    }

    fn surface_of_model(&self) -> Option<Occupancy> {
        let model = self.host.model.borrow();
        let all = model.chunks().flat_map(|(_, chunk)| chunk.cloud.positions.iter().zip(&chunk.cloud.flags));
        let points: Vec<[f32; 3]> =
            all.filter(|(_, flags)| !flags.has(PointFlags::LEFT_OUT)).map(|(position, _)| *position).collect();
        Occupancy::of(&points, model.voxel().into())
    }

    /// Gets the pixels of the photograph that is shown, once.
    fn load(&self) {
        let wanted = self.host.ui.read(|s| s.features.evidence.wanted());
        let Some(view) = wanted.filter(|view| self.loading.get() != Some(*view)) else { return };
        self.loading.set(Some(view));
        let (full, small) = self.host.ui.read(|s| (full_size(s, view), small(s, view)));
        let Some(this) = self.this.upgrade() else { return };
        spawn_local(async move {
            let mut loaded = None;
            if let Some(address) = full {
                loaded = pixels_at(&address).await.ok().map(|pixels| (pixels, true));
            }
            if loaded.is_none()
                && let Some(address) = small
            {
                loaded = pixels_at(address.address()).await.ok().map(|pixels| (pixels, false));
            }
            // The person may have gone on to another.
            if this.loading.get() != Some(view) {
                return;
            }
            this.loading.set(None);
            let event = match &loaded {
                Some((_, is_full)) => EvidenceEvent::Loaded { view, is_full: *is_full },
                None => EvidenceEvent::NotLoaded(view),
            };
            this.host.photograph.borrow_mut().set(loaded.map(|(pixels, _)| pixels));
            this.host.ui.send_feature(event);
            (this.host.redraw)();
        });
    }
}

/// Address of a view's photograph in full size; `None` where neither the file nor the page's own agent has one.
pub(crate) fn full_size(state: &AppState, view: u32) -> Option<String> {
    if let Connection::File { .. } = state.connection {
        return state.photographs.get(&view).cloned();
    }
    let id = &state.inspection.id;
    let keeps = state.account.as_ref().is_some_and(|account| account.keeps);
    (keeps && !id.is_empty()).then(|| format!("/api/v1/inspections/{id}/views/{view}/color.png"))
}

/// The small picture of a view that came over the stream.
pub(crate) fn small(state: &AppState, view: u32) -> Option<ObjectUrl> {
    ObjectUrl::new(&state.views.get(view)?.thumbnail_jpeg, "image/jpeg")
}

impl Controller for EvidenceController {
    fn handle(&self, event: &FeatureEvent) {
        let ui = self.host.ui;
        match event {
            FeatureEvent::Inspect(InspectEvent::Picked(Some(point))) => self.find(*point),
            FeatureEvent::Inspect(InspectEvent::Picked(None) | InspectEvent::Close)
                if ui.read(|s| s.features.evidence.point.is_some()) =>
            {
                ui.send_feature(EvidenceEvent::Lost);
            }
            FeatureEvent::Evidence(event) => {
                if *event == EvidenceEvent::Project(true) && ui.read(|s| s.features.mesh.is_wanted()) {
                    ui.send_feature(MeshEvent::Requested);
                }
                self.load();
            }
            _ => {}
        }
    }

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None {
            self.surface.take();
        }
        if change == ModelChange::Cleared {
            self.loading.set(None);
            self.host.photograph.borrow_mut().set(None);
        }
    }
}
