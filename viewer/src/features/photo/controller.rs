//! Chooses the photographs that colour the mesh when the camera rests or has turned, and gets their pixels: the small pictures of all,
//! then those in full size, one after the other.

use super::choice::{Candidate, Sample, choose, quality};
use super::pixels::levels;
use super::slots::Slots;
use super::surface::Surface;
use super::{PhotoEvent, ShownPhotograph};
use crate::camera::OrbitCamera;
use crate::device::{Memory, memory};
use crate::display::{ColorMode, Representation};
use crate::features::FeatureEvent;
use crate::features::evidence::{full_size, image_at, pixels_of, small};
use crate::features::mesh::MeshEvent;
use crate::features::view::{Controller, Host};
use crate::render::PhotoLayer;
use crate::render::photograph_camera::PhotographCamera;
use crate::scene::ModelChange;
use crate::scene::photo_layers::{LayerSize, MOST_LAYERS, Upload};
use crate::state::AppState;
use crate::state::views::ViewEntry;
use leptos::prelude::*;
use semascan_geometry::sight::Blur;
use semascan_protocol::Phase;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::rc::{Rc, Weak};
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::spawn_local;

/// Bytes of photographs on the graphics device, and how many colour the mesh at a time; less on small devices.
const BUDGET: (u64, usize) = (128 << 20, MOST_LAYERS);
const SMALL_BUDGET: (u64, usize) = (48 << 20, 4);
/// Photographs that are looked at for a choice: those from the directions nearest to the camera's.
const MOST_CANDIDATES: usize = 32;
/// While it moves, the camera has turned far enough for another choice at this cosine: 15 degrees.
const TURNED: f32 = 0.966;

/// What a choice was made for.
#[derive(Clone, Copy, PartialEq)]
struct Occasion {
    camera: OrbitCamera,
    /// Revision of the mesh, fingerprint of the views, generation of the pixels on the graphics device.
    of: (u64, u64, u64),
}

/// A picture to get.
#[derive(Clone, Copy)]
struct Order {
    view: u32,
    /// In full size, or the small one.
    is_full: bool,
    size: LayerSize,
    generation: u64,
}

/// See the module.
pub(super) struct PhotoController {
    host: Host,
    slots: RefCell<Slots>,
    /// The surface of the mesh of that revision.
    surface: RefCell<Option<(u64, Surface)>>,
    chosen_for: Cell<Option<Occasion>>,
    /// The views whose photographs shall colour the mesh, those that matter most first.
    wanted: RefCell<Vec<u32>>,
    /// Pictures that are not to be had: of which view, and whether in full size.
    failed: RefCell<BTreeSet<(u32, bool)>>,
    is_loading: Cell<bool>,
    /// A mesh was asked for, of the model as it is.
    asked_for_mesh: Cell<bool>,
    this: Weak<Self>,
}

impl PhotoController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new_cyclic(|this| Self {
            host: host.clone(),
            slots: RefCell::default(),
            surface: RefCell::default(),
            chosen_for: Cell::default(),
            wanted: RefCell::default(),
            failed: RefCell::default(),
            is_loading: Cell::default(),
            asked_for_mesh: Cell::default(),
            this: this.clone(),
        })
    }

    /// What a choice now would be for; `None` while photographs are not the colours of what is drawn.
    fn occasion(&self) -> Option<Occasion> {
        let views = self.host.ui.read(|s| {
            let is_shown = s.display.color_mode == ColorMode::Photo && s.features.mesh.is_drawn(&s.display);
            is_shown.then(|| fingerprint(s.views.iter()))
        })?;
        let of = (self.host.mesh.borrow().revision(), views, self.host.layers.borrow().generation());
        Some(Occasion { camera: self.host.camera.get(), of })
    }

    fn choose(&self, occasion: Occasion) {
        let (budget, most) = budget();
        let Some(mesh) = self.host.mesh.borrow().mesh().cloned() else { return };
        let (candidates, largest) = self.candidates(&occasion.camera);
        let Some(largest) = largest else { return };
        self.make_room(LayerSize::within(budget, largest, most as u32));
        let mut surface = self.surface.borrow_mut();
        if surface.as_ref().is_none_or(|(revision, _)| *revision != occasion.of.0) {
            *surface = Some((occasion.of.0, Surface::of(&mesh, self.host.model.borrow().voxel())));
        }
        let Some((_, surface)) = surface.as_mut() else { return };
        surface.look(&candidates);
        let before = surface.before(&occasion.camera);
        let samples: Vec<Sample> = before.iter().map(|s| surface.sample(*s)).collect();
        let is_seen = |c: usize, s: usize| surface.is_seen(candidates[c].view, before[s]);
        let chosen = choose(&candidates, &samples, is_seen, occasion.camera.eye(), most);
        *self.wanted.borrow_mut() = chosen.iter().map(|c| candidates[*c].view).collect();
        self.slots.borrow_mut().touch(&self.wanted.borrow());
        // Making room has begun another generation.
        let of = (occasion.of.0, occasion.of.1, self.host.layers.borrow().generation());
        self.chosen_for.set(Some(Occasion { of, ..occasion }));
    }

    /// The photographs from directions near the camera's, and the size of the largest.
    fn candidates(&self, camera: &OrbitCamera) -> (Vec<Candidate>, Option<(u32, u32)>) {
        let toward = (camera.eye() - camera.target()).normalize_or_zero();
        let mut all: Vec<(f32, Candidate)> = self.host.ui.read(|s| {
            let views = s.views.iter().filter(|view| view.accepted);
            let blur = blur(s);
            views
                .filter(|view| [false, true].iter().any(|is_full| self.may_get(s, view.index, *is_full)))
                .filter_map(|view| {
                    let camera_of = PhotographCamera::from_wire(view.pose.as_ref()?, view.intrinsics.as_ref()?)?;
                    let closeness = (camera_of.eye() - camera.target()).normalize_or_zero().dot(toward);
                    let quality = quality(1.0, blur.leaves(view.sharpness));
                    Some((closeness, Candidate { view: view.index, camera: camera_of, quality }))
                })
                .collect()
        });
        let largest = all.iter().map(|(_, c)| c.camera.size).reduce(|a, b| a.max(b));
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.truncate(MOST_CANDIDATES);
        let candidates = all.into_iter().map(|(_, candidate)| candidate).collect();
        (candidates, largest.map(|size| (size.x as u32, size.y as u32)))
    }

    /// Has room of this size; where all pixels are gone, notes that.
    fn make_room(&self, size: LayerSize) {
        let mut layers = self.host.layers.borrow_mut();
        let is_new = layers.size() != Some(size);
        if is_new {
            layers.set_size(Some(size));
        }
        let is_gone = self.chosen_for.get().is_none_or(|before| before.of.2 != layers.generation());
        if is_new || is_gone {
            *self.slots.borrow_mut() = Slots::new(size.slots);
        }
    }

    /// Says which photographs colour the mesh: those that shall, as far as they are there, and those of before until all are.
    fn show(&self) {
        let (wanted, slots) = (self.wanted.borrow(), self.slots.borrow());
        let (photographs, missing) = self.host.ui.read(|s| {
            let blur = blur(s);
            let shown = |view: u32| {
                let (slot, held) = slots.of(view)?;
                let entry = s.views.get(view)?;
                let camera = PhotographCamera::from_wire(entry.pose.as_ref()?, entry.intrinsics.as_ref()?)?;
                let quality = quality(held.resolution, blur.leaves(entry.sharpness));
                Some(ShownPhotograph { view, layer: PhotoLayer { slot, camera, quality } })
            };
            let mut list: Vec<ShownPhotograph> = wanted.iter().filter_map(|view| shown(*view)).collect();
            let may_get = |view: &u32, is_full: bool| self.may_get(s, *view, is_full);
            let is_missing = |view: &&u32| match slots.of(**view) {
                None => may_get(view, false) || may_get(view, true),
                Some((_, held)) => !held.is_full && may_get(view, true),
            };
            let missing = wanted.iter().filter(is_missing).count();
            if list.len() < wanted.len() && missing > 0 {
                let before = s.features.photo.photographs.iter().map(|photograph| photograph.view);
                list.extend(before.filter(|view| !wanted.contains(view)).filter_map(shown));
                list.truncate(MOST_LAYERS);
            }
            (list, missing)
        });
        drop((wanted, slots));
        let is_new = self
            .host
            .ui
            .read(|s| s.features.photo.photographs != photographs || s.features.photo.missing != Some(missing));
        if is_new {
            self.host.ui.send_feature(PhotoEvent::Shown { photographs, missing });
        }
    }

    /// The picture to get next: a small one of each that has none yet, then the full sizes.
    fn next(&self) -> Option<Order> {
        let (wanted, slots) = (self.wanted.borrow(), self.slots.borrow());
        let (size, generation) = {
            let layers = self.host.layers.borrow();
            (layers.size()?, layers.generation())
        };
        let (view, is_full) = self.host.ui.read(|s| {
            let mut missing = wanted.iter().copied().filter(|view| slots.of(*view).is_none());
            let first = missing.find_map(|view| {
                let is_full = [false, true].into_iter().find(|is_full| self.may_get(s, view, *is_full))?;
                Some((view, is_full))
            });
            let mut coarse = wanted.iter().copied().filter(|v| slots.of(*v).is_some_and(|(_, held)| !held.is_full));
            first.or_else(|| coarse.find(|view| self.may_get(s, *view, true)).map(|view| (view, true)))
        })?;
        Some(Order { view, is_full, size, generation })
    }

    /// Whether a picture of a view is to be had, in full size or small.
    fn may_get(&self, state: &AppState, view: u32, is_full: bool) -> bool {
        let is_offered = match is_full {
            true => full_size(state, view).is_some(),
            false => state.views.get(view).is_some_and(|entry| !entry.thumbnail_jpeg.is_empty()),
        };
        is_offered && !self.failed.borrow().contains(&(view, is_full))
    }

    /// Gets one picture after the other, until none is missing.
    fn load(&self) {
        let Some(this) = self.this.upgrade() else { return };
        if self.is_loading.replace(true) {
            return;
        }
        spawn_local(async move {
            while let Some(order) = this.next() {
                if this.get(order).await.is_err() {
                    this.failed.borrow_mut().insert((order.view, order.is_full));
                    // Others may take its place.
                    if let Some(now) = this.occasion() {
                        this.choose(now);
                    }
                }
                // A frame with photographs costs much where there is no graphics processor: the small ones are shown together, and then
                // those in full size.
                if this.next().is_some_and(|next| next.is_full == order.is_full) {
                    continue;
                }
                this.show();
                // New pixels of the same photographs change nothing in the state.
                (this.host.redraw)();
            }
            this.is_loading.set(false);
        });
    }

    /// Gets a picture; it is dropped where it is not wanted any more.
    async fn get(&self, Order { view, is_full, size, generation }: Order) -> Result<(), JsValue> {
        let image = if is_full {
            let address = self.host.ui.read(|s| full_size(s, view)).ok_or("it is not kept")?;
            image_at(&address).await?
        } else {
            let picture = self.host.ui.read(|s| small(s, view)).ok_or("there is none")?;
            image_at(picture.address()).await?
        };
        let is_wanted = self.wanted.borrow().contains(&view);
        if !is_wanted || self.host.layers.borrow().generation() != generation {
            return Ok(());
        }
        let pixels = pixels_of(&image, size.width, size.height)?;
        let levels = levels(pixels, size).ok_or("it has no pixels")?;
        let resolution = (image.natural_width() as f32 / size.width as f32).min(1.0);
        if let Some(slot) = self.slots.borrow_mut().place(view, resolution, is_full) {
            self.host.layers.borrow_mut().put(Upload { slot, levels });
        }
        Ok(())
    }

    /// Lets go of all that was of another model.
    fn clear(&self) {
        self.host.layers.borrow_mut().set_size(None);
        *self.slots.borrow_mut() = Slots::default();
        self.surface.take();
        self.chosen_for.set(None);
        self.wanted.borrow_mut().clear();
        self.failed.borrow_mut().clear();
    }
}

impl Controller for PhotoController {
    fn begin(&self) {
        let resumes = self.host.ui.part(|s| {
            let is_pending = s.features.photo.is_pending && s.display.color_mode == ColorMode::Photo;
            is_pending && s.has_model() && s.has_photographs()
        });
        let ui = self.host.ui;
        Effect::new(move |_| {
            if resumes.get() {
                ui.send_feature(PhotoEvent::Resumed);
            }
        });
        let lacks_mesh = ui.part(lacks_mesh);
        let weak = self.this.clone();
        Effect::new(move |_| {
            if lacks_mesh.get()
                && let Some(controller) = weak.upgrade()
                && !controller.asked_for_mesh.replace(true)
            {
                ui.send_feature(MeshEvent::Requested);
            }
        });
    }

    fn handle(&self, _: &FeatureEvent) {}

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None {
            self.asked_for_mesh.set(false);
        }
        if change == ModelChange::Cleared {
            self.clear();
        }
    }

    fn drawn(&self, is_still: bool) {
        let Some(now) = self.occasion() else { return };
        let is_due = self.chosen_for.get().is_none_or(|before| {
            before.of != now.of
                || (before.camera != now.camera && (is_still || has_turned(&before.camera, &now.camera)))
        });
        if is_due {
            self.choose(now);
            self.show();
            self.load();
        }
    }
}

/// Whether a mesh is to be made for the photographs: at once while the model grows and there is none, and when the model is whole.
fn lacks_mesh(state: &AppState) -> bool {
    let (mesh, display) = (&state.features.mesh, &state.display);
    let phase = state.progress.phase;
    let is_over = matches!(phase, Phase::Finished | Phase::Failed);
    let is_shown = display.color_mode == ColorMode::Photo && display.representation == Representation::Mesh;
    // What was there before the page is not all here until it is said to be over.
    let is_due = is_over || phase == Phase::Running && mesh.triangles == 0;
    is_shown && is_due && state.has_model() && state.has_photographs() && mesh.is_wanted()
}

/// How blurred the photographs are against each other.
fn blur(state: &AppState) -> Blur {
    Blur::among(state.views.iter().filter(|view| view.accepted).map(|view| view.sharpness))
}

/// Another number when there are other views, or other poses of them.
fn fingerprint<'a>(views: impl Iterator<Item = &'a ViewEntry>) -> u64 {
    let mut hasher = DefaultHasher::new();
    for view in views.filter(|view| view.accepted) {
        let pose = view.pose.as_ref().map(|p| [p.tx, p.ty, p.tz, p.qx, p.qy, p.qz, p.qw].map(f64::to_bits));
        (view.index, pose, view.thumbnail_jpeg.len()).hash(&mut hasher);
    }
    hasher.finish()
}

fn has_turned(before: &OrbitCamera, now: &OrbitCamera) -> bool {
    before.forward().dot(now.forward()) < TURNED
}

/// The budget of this device.
fn budget() -> (u64, usize) {
    if memory() == Memory::Small { SMALL_BUDGET } else { BUDGET }
}
