//! What the canvas says in its data attributes, for scripts that watch a page, beside what the renderer writes there itself
//! (backend, points, frames): the link, the inspection, the hash of the model, and whether a stroke is being picked.

use crate::state::AppState;
use wasm_bindgen::JsCast;
use web_sys::{Document, HtmlElement};

/// Where the inspection and the link stand, and whether the 3D view works.
pub(super) fn write_state(document: &Document, state: &AppState) {
    set(document, "phase", state.progress.phase_key());
    set(document, "connection", state.connection.key());
    set(document, "inspection", &state.inspection.id);
    set(document, "resumed", &state.resumptions.to_string());
    // The agent's own hash of the finished model: what `data-hash` must come to.
    set(document, "agentHash", &format!("{:016x}", state.progress.model_hash));
}

/// Hash of the model as held, comparable with the agent's.
pub(super) fn write_hash(document: &Document, hash: u64) {
    set(document, "hash", &format!("{hash:016x}"));
}

/// Whether the picture lacks places of a stroke: they are still being picked.
pub(super) fn write_drawing(document: &Document, is_drawing: bool) {
    set(document, "drawing", if is_drawing { "true" } else { "false" });
}

/// There is no 3D view.
pub(super) fn write_no_backend(document: &Document) {
    set(document, "backend", "none");
}

fn set(document: &Document, name: &str, value: &str) {
    // The renderer may have put a fresh canvas in the place of the old one, so it is looked up every time.
    if let Some(canvas) = document.get_element_by_id("viewport").and_then(|c| c.dyn_into::<HtmlElement>().ok()) {
        // Fails only for names that are no identifiers.
        let _ = canvas.dataset().set(name, value);
    }
}
