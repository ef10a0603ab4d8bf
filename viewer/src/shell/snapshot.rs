//! Saves the picture as people show it to others: with the part's name, and what the colours mean.

use super::save::download;
use super::viewport::Viewport;
use crate::display::{ColorMode, ColorScheme, css_color};
use crate::state::color_key::ColorKey;
use crate::state::notices::{Level, Topic};
use crate::state::units;
use crate::words::t;
use js_sys::Uint8Array;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Blob, CanvasRenderingContext2d, HtmlCanvasElement};

/// Sizes in CSS pixels: of the strip below the picture, of its text, and of its margin.
const STRIP: f64 = 64.0;
const TEXT: f64 = 14.0;
const MARGIN: f64 = 16.0;
/// Length and height of a ramp.
const RAMP: [f64; 2] = [240.0, 10.0];

/// Saves the picture.
pub(super) fn save_picture(viewport: &Viewport) {
    let composed = compose(viewport);
    let (ui, document) = (viewport.ui, viewport.document.clone());
    let name = ui.read(|s| format!("{}.png", units::file_stem(&s.inspection.part)));
    spawn_local(async move {
        ui.retract(Topic::Export);
        let saved = async {
            let bytes = png(&composed?).await?;
            download(&document, &name, &bytes, "image/png").map(|()| (name, bytes.length()))
        };
        match saved.await {
            Ok((name, size)) => {
                ui.notify(Level::Info, Topic::Export, t!("snapshot.saved", name, size = units::bytes(size.into())));
            }
            Err(error) => {
                web_sys::console::error_1(&error);
                ui.notify(Level::Error, Topic::Export, t!("snapshot.failed"));
            }
        }
    });
}

/// The picture of now, and the strip below it, on a canvas of its own.
fn compose(viewport: &Viewport) -> Result<HtmlCanvasElement, JsValue> {
    // What a canvas of the graphics device shows can be read in the task that draws it, and not later.
    viewport.draw_finely();
    let shown = viewport.canvas().ok_or("there is no picture")?;
    let scale = f64::from(shown.width()) / f64::from(shown.client_width().max(1));
    let canvas: HtmlCanvasElement = viewport.document.create_element("canvas")?.dyn_into()?;
    canvas.set_width(shown.width());
    canvas.set_height(shown.height() + (STRIP * scale) as u32);
    let context: CanvasRenderingContext2d = canvas.get_context("2d")?.ok_or("no canvas")?.dyn_into()?;
    context.draw_image_with_html_canvas_element(&shown, 0.0, 0.0)?;
    let (title, key, mode, scheme) = viewport.ui.read(|s| {
        let id = Some(s.inspection.id.as_str()).filter(|id| !id.is_empty());
        let title: Vec<&str> = [s.inspection.part.as_str()].into_iter().chain(id).collect();
        (title.join(" · "), ColorKey::of(s), s.display.color_mode, s.display.color_scheme())
    });
    let (paper, ink) = match scheme {
        ColorScheme::Dark => ("#14181e", "#e6e9ee"),
        ColorScheme::Light => ("#ffffff", "#1b2026"),
    };
    let top = f64::from(shown.height());
    context.set_fill_style_str(paper);
    context.fill_rect(0.0, top, f64::from(canvas.width()), STRIP * scale);
    // From here on in CSS pixels of the strip.
    context.translate(0.0, top)?;
    context.scale(scale, scale)?;
    context.set_font(&format!("{TEXT}px system-ui, sans-serif"));
    context.set_text_baseline("middle");
    context.set_fill_style_str(ink);
    context.fill_text(&title, MARGIN, STRIP * 0.3)?;
    draw_key(&context, &key, mode, ink)?;
    Ok(canvas)
}

/// What the colours mean, in the second line of the strip.
fn draw_key(context: &CanvasRenderingContext2d, key: &ColorKey, mode: ColorMode, ink: &str) -> Result<(), JsValue> {
    let (mut x, y) = (MARGIN, STRIP * 0.7);
    let write = |x: &mut f64, text: &str| -> Result<(), JsValue> {
        context.set_fill_style_str(ink);
        context.fill_text(text, *x, y)?;
        *x += context.measure_text(text)?.width() + TEXT;
        Ok(())
    };
    match key {
        ColorKey::Appearance | ColorKey::Photographs => write(&mut x, mode.label())?,
        ColorKey::Classes { title, .. } | ColorKey::Nothing { title, .. } => write(&mut x, title)?,
        ColorKey::Ramp { title, ticks: [low, _, high], .. } => {
            write(&mut x, title)?;
            write(&mut x, low)?;
            let [length, height] = RAMP;
            let steps = length as u32;
            for step in 0..steps {
                let share = (step as f32 + 0.5) / steps as f32;
                context.set_fill_style_str(&css_color(ColorKey::ramp(mode, share)));
                // To the end, the next over it: edges between pixels would let the paper through.
                context.fill_rect(x + f64::from(step), y - height / 2.0, length - f64::from(step), height);
            }
            x += length + TEXT;
            write(&mut x, high)?;
        }
    }
    for (color, name) in key.entries() {
        context.set_fill_style_str(&css_color(color));
        context.fill_rect(x, y - TEXT / 2.0, TEXT, TEXT);
        x += 1.5 * TEXT;
        write(&mut x, &name)?;
    }
    Ok(())
}

/// The canvas as a PNG file.
async fn png(canvas: &HtmlCanvasElement) -> Result<Uint8Array, JsValue> {
    let (canvas, mut refused) = (canvas.clone(), None);
    let promise = js_sys::Promise::new(&mut |resolve, _| {
        let done = Closure::once_into_js(move |blob: JsValue| drop(resolve.call1(&JsValue::NULL, &blob)));
        refused = canvas.to_blob(done.unchecked_ref()).err();
    });
    if let Some(error) = refused {
        return Err(error);
    }
    let blob: Blob = JsFuture::from(promise).await?.dyn_into()?;
    let bytes = JsFuture::from(blob.array_buffer()).await?;
    Ok(Uint8Array::new(&bytes))
}
