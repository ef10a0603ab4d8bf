//! The mesh of another inspection, which the address names, as the reference of deviations.

use super::open_file::fetched;
use super::viewport::Viewport;
use crate::features::deviation::DeviationEvent;
use crate::state::notices::{Level, Topic};
use crate::words::t;
use js_sys::Uint8Array;
use leptos::prelude::{Effect, Get};
use semascan_model::InspectionId;
use semascan_protocol::Phase;
use std::cell::Cell;
use std::rc::Rc;
use wasm_bindgen_futures::spawn_local;

/// Compares the model with the mesh of inspection `id`, once it is whole.
pub(super) fn compare_with(viewport: &Rc<Viewport>, id: InspectionId) {
    let ui = viewport.ui;
    let is_whole = ui.part(|s| s.progress.phase == Phase::Finished && s.has_model());
    let is_asked = Cell::new(false);
    Effect::new(move |_| {
        if !is_whole.get() || is_asked.replace(true) {
            return;
        }
        spawn_local(async move {
            let name = format!("{id}.ply");
            ui.send_feature(DeviationEvent::Reading(name.clone()));
            match fetched(&format!("/api/v1/inspections/{id}/exports/mesh.ply")).await {
                Ok(buffer) => {
                    let bytes = Uint8Array::new(&buffer).to_vec().into();
                    ui.send_feature(DeviationEvent::FileRead { name, bytes });
                }
                Err(error) => {
                    ui.send_feature(DeviationEvent::NoReference);
                    let text = t!("reference.not_had", id, reason = error.reason());
                    ui.notify(Level::Error, Topic::Reference, text);
                }
            }
        });
    });
}
