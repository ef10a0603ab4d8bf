//! Keeps the painted surface in the picture: chunks and mesh as the renderer has them, with what people painted on them.

use super::graphics::Graphics;
use crate::scene::paint::{Paint, painted};
use crate::scene::{HeldMesh, HeldModel, HeldPaint, ModelChange};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The paint, and what of it the renderer has.
#[derive(Default)]
pub(super) struct Painting {
    pub(super) paint: Rc<RefCell<HeldPaint>>,
    /// Revision that the chunks have; `None` where some may be without.
    drawn: Cell<Option<u64>>,
    /// What is on each chunk that has any.
    chunks: RefCell<BTreeMap<[i32; 3], Vec<Paint>>>,
    /// Revision of the mesh that the renderer has, and of the paint on it; `None` with a new renderer.
    drawn_mesh: Cell<Option<(u64, u64)>>,
}

impl Painting {
    /// The renderer has been brought level with a change of the model, without paint.
    pub(super) fn follow(&self, change: ModelChange) {
        let mut chunks = self.chunks.borrow_mut();
        match change {
            ModelChange::None => return,
            ModelChange::Cleared | ModelChange::Exchanged => chunks.clear(),
            ModelChange::Replaced(id) | ModelChange::Removed(id) => drop(chunks.remove(&id)),
        }
        self.drawn.set(None);
    }

    /// There is a new renderer, which has the model and nothing else.
    pub(super) fn forget(&self) {
        self.follow(ModelChange::Cleared);
        self.drawn_mesh.set(None);
    }

    /// Puts what has changed into the renderer: paint, and the mesh.
    pub(super) fn bring(&self, graphics: &Graphics, model: &HeldModel, mesh: &HeldMesh) {
        let paint = self.paint.borrow();
        if self.drawn.replace(Some(paint.revision())) != Some(paint.revision()) {
            let mut chunks = self.chunks.borrow_mut();
            for (id, chunk) in model.chunks() {
                let near = paint.near(chunk.bounds());
                match chunks.get(&id) {
                    None if near.is_empty() => {}
                    Some(there) if *there == near => {}
                    _ if near.is_empty() => {
                        graphics.show_chunk(id, &chunk.cloud);
                        chunks.remove(&id);
                    }
                    _ => {
                        graphics.show_chunk(id, &painted(&chunk.cloud, &near));
                        chunks.insert(id, near);
                    }
                }
            }
        }
        let drawn = self.drawn_mesh.get();
        let on_mesh = match drawn {
            Some((_, on_mesh)) if paint.is_open() => on_mesh,
            _ => paint.revision(),
        };
        let now = Some((mesh.revision(), on_mesh));
        if drawn != now {
            self.drawn_mesh.set(now);
            let with_paint = mesh.mesh().and_then(|mesh| paint.on_mesh(mesh));
            let shown = with_paint.as_ref().or(mesh.mesh().map(AsRef::as_ref));
            graphics.show_mesh(shown.map(|shown| (shown, mesh.deviations())));
        }
    }
}
