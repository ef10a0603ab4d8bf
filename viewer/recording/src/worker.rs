//! The module's only way in from the page: its worker (`www/recording_worker.js`) reads one recording and ends.

use crate::read;
use js_sys::{Array, Object, Reflect, Uint8Array};
use wasm_bindgen::prelude::*;

/// Reads a recording: an object with `name`, `bytes` and `remarks`.
///
/// # Errors
/// The reason, as a text.
#[wasm_bindgen]
#[allow(unreachable_pub)] // Its caller is the page.
pub fn read_recording(name: &str, bytes: &[u8]) -> Result<Object, JsValue> {
    console_error_panic_hook::set_once();
    let opened = read(name, bytes).map_err(|error| JsValue::from(error.to_string()))?;
    let remarks: Array = opened.remarks.iter().map(JsValue::from).collect();
    let object = Object::new();
    Reflect::set(&object, &"name".into(), &opened.name.into())?;
    Reflect::set(&object, &"bytes".into(), &Uint8Array::from(opened.bytes.as_slice()))?;
    Reflect::set(&object, &"remarks".into(), &remarks)?;
    Ok(object)
}
