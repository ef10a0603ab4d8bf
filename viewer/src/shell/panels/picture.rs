//! A view's picture with the class colours over it, from bytes that came over the link.
//!
//! The bytes become object addresses (`blob:`), which the page's content policy allows for pictures; each is given back
//! when the picture leaves the page, or the browser would keep the bytes for as long as the page lives.

use crate::state::views::{ViewEntry, ViewOverlay};
use leptos::prelude::*;
use web_sys::{Blob, BlobPropertyBag, Url};

/// Address of bytes in the browser's memory; given back on drop.
struct ObjectUrl(String);

impl ObjectUrl {
    fn new(bytes: &[u8], mime: &str) -> Option<Self> {
        if bytes.is_empty() {
            return None;
        }
        let parts = js_sys::Array::of1(&js_sys::Uint8Array::from(bytes).into());
        let options = BlobPropertyBag::new();
        options.set_type(mime);
        let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &options).ok()?;
        Url::create_object_url_with_blob(&blob).ok().map(Self)
    }
}

impl Drop for ObjectUrl {
    fn drop(&mut self) {
        // Fails for an address that is not one; this one was made by the browser.
        let _ = Url::revoke_object_url(&self.0);
    }
}

/// The picture and an overlay, or nothing where the view has none.
#[component]
pub(super) fn Picture(view: ViewEntry, overlay: ViewOverlay, alt: String) -> impl IntoView {
    let photo = ObjectUrl::new(&view.thumbnail_jpeg, "image/jpeg");
    let overlay = view.overlay(overlay).and_then(|png| ObjectUrl::new(png, "image/png"));
    let sources = (photo.as_ref().map(|u| u.0.clone()), overlay.as_ref().map(|u| u.0.clone()));
    let kept = StoredValue::new((photo, overlay));
    on_cleanup(move || kept.dispose());
    view! {
        {sources.0.map(|src| view! { <img class="picture-photo" src=src alt=alt draggable="false" decoding="async"/> })}
        {sources.1.map(|src| view! { <img class="picture-overlay" src=src alt="" draggable="false" decoding="async"/> })}
    }
}
