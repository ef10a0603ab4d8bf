//! Elements of the page that stay at a point of the model: those of class `anchored`, with the point in `data-place` (metres,
//! table frame). With every frame they are put where the camera sees it. What is behind the eye or outside the picture is
//! hidden at once (`data-behind`); what has a name (`data-anchor`) is also probed, and hidden where something of the model is
//! in front of it (`data-occluded`).

use crate::camera::OrbitCamera;
use glam::{Vec2, Vec3};
use wasm_bindgen::JsCast;
use web_sys::{Document, HtmlElement};

/// An element to be probed.
pub(super) struct Anchor {
    /// Its name.
    pub(super) name: String,
    /// Where it is in the picture, CSS pixels.
    pub(super) at: Vec2,
}

/// Puts every element to its place; those in the picture that have a name are given back.
pub(super) fn place(document: &Document, camera: &OrbitCamera) -> Vec<Anchor> {
    let mut anchors = Vec::new();
    for element in anchored(document, ".anchored[data-place]") {
        let data = element.dataset();
        let seen = data.get("place").as_deref().and_then(point).and_then(|point| camera.project(point));
        let share = seen.map(|(at, _)| at / camera.viewport());
        let inside = share.filter(|s| s.cmpge(Vec2::ZERO).all() && s.cmple(Vec2::ONE).all());
        // Fails only for names that are no identifiers or styles.
        let _ = data.set("behind", if inside.is_some() { "false" } else { "true" });
        let (Some(share), Some((at, _))) = (inside, seen) else { continue };
        let style = element.style();
        let _ = style.set_property("left", &format!("{:.3}%", share.x * 100.0));
        let _ = style.set_property("top", &format!("{:.3}%", share.y * 100.0));
        if let Some(name) = data.get("anchor") {
            anchors.push(Anchor { name, at });
        }
    }
    anchors
}

/// Says of the element of this name whether it is hidden by the model.
///
/// * `seen_at`: distance of what the picture shows where it is, metres; `None` where it shows nothing.
/// * `tolerance`: by how much the surface may seem to be in front of a point on it, metres.
pub(super) fn probed(document: &Document, camera: &OrbitCamera, name: &str, seen_at: Option<f32>, tolerance: f32) {
    for element in anchored(document, ".anchored[data-anchor]") {
        let data = element.dataset();
        if data.get("anchor").as_deref() != Some(name) {
            continue;
        }
        let projected = data.get("place").as_deref().and_then(point).and_then(|point| camera.project(point));
        let Some((_, distance)) = projected else { continue };
        let occluded = seen_at.is_some_and(|seen| seen < distance - tolerance);
        let _ = data.set("occluded", if occluded { "true" } else { "false" });
    }
}

fn anchored(document: &Document, selector: &str) -> Vec<HtmlElement> {
    // The selectors are valid.
    let Ok(found) = document.query_selector_all(selector) else { return Vec::new() };
    (0..found.length()).filter_map(|i| found.get(i)?.dyn_into().ok()).collect()
}

fn point(text: &str) -> Option<Vec3> {
    let mut numbers = text.split(' ').map_while(|number| number.parse::<f32>().ok());
    Some(Vec3::new(numbers.next()?, numbers.next()?, numbers.next()?))
}
