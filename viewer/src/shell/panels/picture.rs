//! A view's picture with the class colours over it, from bytes that came over the link.

use crate::state::views::{ViewEntry, ViewOverlay};
use crate::ui::object_url::ObjectUrl;
use leptos::prelude::*;

/// The picture and an overlay, or nothing where the view has none.
#[component]
pub(super) fn Picture(view: ViewEntry, overlay: ViewOverlay, alt: String) -> impl IntoView {
    let photo = ObjectUrl::new(&view.thumbnail_jpeg, "image/jpeg");
    let overlay = view.overlay(overlay).and_then(|png| ObjectUrl::new(png, "image/png"));
    let sources = (photo.as_ref().map(|u| u.address().to_owned()), overlay.as_ref().map(|u| u.address().to_owned()));
    let kept = StoredValue::new((photo, overlay));
    on_cleanup(move || kept.dispose());
    view! {
        {sources.0.map(|src| view! { <img class="picture-photo" src=src alt=alt draggable="false" decoding="async"/> })}
        {sources.1.map(|src| view! { <img class="picture-overlay" src=src alt="" draggable="false" decoding="async"/> })}
    }
}
