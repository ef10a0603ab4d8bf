//! The pixels of a picture at an address: the browser fetches and decodes it.

use crate::scene::photograph::Pixels;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, HtmlImageElement};

/// The pixels of the picture at `address`.
///
/// # Errors
/// What the browser says where there is no picture, or not the memory for it.
pub(super) async fn pixels_at(address: &str) -> Result<Pixels, JsValue> {
    let image = image_at(address).await?;
    pixels_of(&image, image.natural_width(), image.natural_height())
}

/// The picture at `address`, decoded.
///
/// # Errors
/// What the browser says where there is no picture.
pub(crate) async fn image_at(address: &str) -> Result<HtmlImageElement, JsValue> {
    let image = HtmlImageElement::new()?;
    image.set_src(address);
    JsFuture::from(image.decode()).await?;
    Ok(image)
}

/// The pixels of a picture, made as large as is asked for.
///
/// # Errors
/// What the browser says where it has not the memory for it.
pub(crate) fn pixels_of(image: &HtmlImageElement, width: u32, height: u32) -> Result<Pixels, JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or("there is no page")?;
    let canvas: HtmlCanvasElement = document.create_element("canvas")?.dyn_into()?;
    canvas.set_width(width);
    canvas.set_height(height);
    let context = canvas.get_context("2d")?.ok_or("the browser gives no canvas")?;
    let context: CanvasRenderingContext2d = context.dyn_into()?;
    let (columns, rows) = (f64::from(width), f64::from(height));
    context.draw_image_with_html_image_element_and_dw_and_dh(image, 0.0, 0.0, columns, rows)?;
    let data = context.get_image_data(0.0, 0.0, columns, rows)?;
    Ok(Pixels { width, height, rgba: data.data().0 })
}
