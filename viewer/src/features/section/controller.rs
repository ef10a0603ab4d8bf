//! Has a mesh made where there is none, cuts it when plane, box, mesh or legend change, and knows where the camera is.

use super::{Direction, SectionEvent, Shown, Style};
use crate::display::{ClassMask, Palette};
use crate::features::FeatureEvent;
use crate::features::measure::MeasureEvent;
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::state::AppState;
use leptos::prelude::*;
use semascan_geometry::section::Plane;
use semascan_protocol::Phase;
use std::cell::Cell;
use std::rc::{Rc, Weak};
use std::sync::Arc;

/// See the module.
pub(super) struct SectionController {
    host: Host,
    /// A link led to a plane, and there was no whole model to mesh yet.
    lacks_mesh: Cell<bool>,
    this: Weak<Self>,
}

/// All that the section depends on besides the mesh.
#[derive(Clone, Debug, PartialEq)]
struct Wanted {
    plane: Option<Plane>,
    limits: Option<[[f64; 3]; 2]>,
    visible: ClassMask,
    style: Style,
}

impl Wanted {
    fn of(state: &AppState) -> Self {
        let mut visible = ClassMask::ALL;
        state.legend.rows.iter().for_each(|row| visible.set(row.class.id, row.visible));
        let section = &state.features.section;
        Self {
            plane: section.plane(),
            limits: section.limits,
            visible,
            style: Style {
                palette: Palette::from_taxonomy(&state.inspection.taxonomy()),
                color_scheme: state.display.color_scheme(),
            },
        }
    }
}

impl SectionController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self { host: host.clone(), lacks_mesh: Cell::default(), this: this.clone() })
    }

    /// Cuts the mesh as it is.
    fn cut(&self) {
        let ui = self.host.ui;
        let Wanted { plane, limits, visible, style } = ui.read(Wanted::of);
        let voxel = self.host.model.borrow().voxel().into();
        let shown = {
            let mesh = self.host.mesh.borrow();
            let of = |plane| {
                let shown = Shown::of(mesh.mesh()?, plane, limits, voxel, &style, |label| visible.has(label));
                Some(Arc::new(shown))
            };
            plane.and_then(of)
        };
        if shown.is_some() || ui.read(|s| s.features.section.shown.is_some()) {
            ui.send_feature(SectionEvent::Cut(shown));
        }
    }

    /// The plane is wanted: it is to be seen from its open side, and needs a mesh.
    fn open(&self) {
        let ui = self.host.ui;
        ui.send_feature(SectionEvent::Toward(self.host.camera.get().eye().as_dvec3().into()));
        if ui.read(|s| s.has_model() && s.features.mesh.is_wanted()) {
            ui.send_feature(MeshEvent::Requested);
        }
    }

    /// The plane of a link needs a mesh as soon as the model is whole.
    fn mesh_for_link(&self) {
        if self.host.ui.read(can_mesh_whole) && self.lacks_mesh.take() {
            self.host.ui.send_feature(MeshEvent::Requested);
        }
    }

    /// Turns the plane toward the camera.
    fn face_camera(&self) {
        let camera = self.host.camera.get();
        let focus = self.host.model.borrow().focus();
        let normal = (-camera.forward().as_dvec3()).normalize().into();
        let through = focus.map_or(camera.target(), |focus| focus.center()).as_dvec3().into();
        self.host.ui.send_feature(SectionEvent::Turn(Direction::Camera { normal, through }));
    }

    /// Says how large the model is.
    fn measure(&self) {
        let focus = self.host.model.borrow().focus();
        let extent = focus.map(|focus| [focus.min, focus.max].map(|corner| corner.as_dvec3().into()));
        if self.host.ui.read(|s| s.features.section.extent != extent) {
            self.host.ui.send_feature(SectionEvent::Extent(extent));
        }
    }
}

/// Whether the model is whole and a mesh of it can be made.
fn can_mesh_whole(state: &AppState) -> bool {
    let is_over = matches!(state.progress.phase, Phase::Finished | Phase::Failed);
    is_over && state.has_model() && state.features.mesh.is_wanted()
}

impl Controller for SectionController {
    fn begin(&self) {
        let ui = self.host.ui;
        let points = ui.part(|s| s.legend.held_points());
        let this = self.this.clone();
        Effect::new(move |_| {
            // Read, not only tracked: a memo that nobody reads never learns what it depends on.
            points.with(|_| ());
            this.upgrade().inspect(|this| this.measure());
        });
        let is_whole = ui.part(can_mesh_whole);
        let this = self.this.clone();
        Effect::new(move |_| {
            is_whole.get();
            this.upgrade().inspect(|this| this.mesh_for_link());
        });
        let wanted = ui.part(Wanted::of);
        let this = self.this.clone();
        Effect::new(move |_| {
            wanted.with(|_| ());
            this.upgrade().inspect(|this| this.cut());
        });
    }

    fn handle(&self, event: &FeatureEvent) {
        let ui = self.host.ui;
        match event {
            FeatureEvent::Section(SectionEvent::Show(true) | SectionEvent::Turn(_)) => self.open(),
            FeatureEvent::Section(SectionEvent::Follow { plane, .. }) => {
                self.lacks_mesh.set(plane.is_some());
                self.mesh_for_link();
            }
            FeatureEvent::Section(SectionEvent::FaceCamera) => self.face_camera(),
            // A click does one thing.
            FeatureEvent::Section(SectionEvent::Read(true)) if ui.read(|s| s.features.measure.kind.is_some()) => {
                ui.send_feature(MeasureEvent::Choose(None));
            }
            FeatureEvent::Measure(MeasureEvent::Choose(Some(_))) if ui.read(|s| s.features.section.is_reading) => {
                ui.send_feature(SectionEvent::Read(false));
            }
            FeatureEvent::Mesh(MeshEvent::Made { .. }) => self.cut(),
            _ => {}
        }
    }
}
