//! Bytes as an address (`blob:`), which the page's content policy allows for pictures. It is given back when nobody holds it any
//! more, or the browser would keep the bytes for as long as the page lives.

use web_sys::{Blob, BlobPropertyBag, Url};

/// Address of bytes in the browser's memory; given back on drop.
pub(crate) struct ObjectUrl(String);

impl ObjectUrl {
    /// `None` without bytes.
    pub(crate) fn new(bytes: &[u8], mime: &str) -> Option<Self> {
        if bytes.is_empty() {
            return None;
        }
        let parts = js_sys::Array::of1(&js_sys::Uint8Array::from(bytes).into());
        let options = BlobPropertyBag::new();
        options.set_type(mime);
        let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &options).ok()?;
        Url::create_object_url_with_blob(&blob).ok().map(Self)
    }

    /// The address.
    pub(crate) fn address(&self) -> &str {
        &self.0
    }
}

impl Drop for ObjectUrl {
    fn drop(&mut self) {
        // Fails for an address that is not one; this one was made by the browser.
        let _ = Url::revoke_object_url(&self.0);
    }
}
