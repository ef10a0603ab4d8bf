//! Pictures decoded by the browser, which knows PNG, JPEG and more; the worker's script asks it.

use crate::opened::Picture;
use js_sys::{Reflect, Uint8Array};
use wasm_bindgen::prelude::*;

/// Largest side of a picture, pixels: a larger one is made smaller. Vertices show no more.
const LARGEST: u32 = 4096;

#[wasm_bindgen]
extern "C" {
    /// The picture as `ImageData`, its longer side no longer than `largest` (`www/mesh_worker.js`).
    #[wasm_bindgen(js_name = decodePicture, catch)]
    async fn decode_picture(bytes: &[u8], largest: u32) -> Result<JsValue, JsValue>;
}

/// Decodes a picture.
///
/// # Errors
/// What the browser says of a picture that it does not know.
pub(super) async fn picture(bytes: &[u8]) -> Result<Picture, JsValue> {
    let decoded = decode_picture(bytes, LARGEST).await?;
    let get = |name: &str| Reflect::get(&decoded, &name.into());
    let [width, height] = [get("width")?, get("height")?].map(|side| side.as_f64().unwrap_or_default() as u32);
    let pixels = Uint8Array::new(&get("data")?).to_vec();
    Ok(Picture::new(width, height, &pixels).ok_or("no pixels")?)
}
