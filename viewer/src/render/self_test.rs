//! Proof that a device really draws on its canvas, before people see it.
//!
//! Some browsers hand out a WebGPU device that works offscreen and then shows black, or loses the device with the first
//! frame on the canvas, without any error. So the test draws one green splat through the whole path (data texture,
//! shaders, surface), reads the canvas's middle pixel back through a 2D canvas, and waits a moment for a loss.

use super::error::RenderError;
use super::renderer::Renderer;
use super::request::{DrawRequest, FrameContent};
use crate::camera::{Bounds, OrbitCamera};
use crate::display::{ColorMode, Palette};
use glam::Vec3;
use js_sys::{Function, Promise};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

/// How long a device may take to be lost over its first frame, milliseconds.
const GRACE_MS: i32 = 120;

const GREEN: [u8; 3] = [0, 255, 0];

/// Draws and looks; the renderer is left without points.
pub(super) async fn run(renderer: &mut Renderer) -> Result<(), RenderError> {
    renderer.set_chunk([0; 3], &one_point());
    let bounds = Bounds::from_corners(Vec3::splat(-0.01), Vec3::splat(0.01));
    let mut camera = OrbitCamera::default();
    camera.frame(Vec3::ZERO, 0.01);
    let mut request = DrawRequest {
        camera,
        focus: Some(bounds),
        bounds: Some(bounds),
        voxel: 0.02,
        point_budget: None,
        is_still: false,
        content: FrameContent {
            color_mode: ColorMode::Component,
            palette: Palette { components: vec![[0; 3], GREEN], defects: Vec::new() },
            ..FrameContent::default()
        },
    };
    let mut last = Err(failed(renderer, "no frame was drawn".to_owned()));
    // The second frame is what a device that dies over its first one does not survive.
    for is_still in [false, true] {
        request.is_still = is_still;
        last = renderer.draw(&request, None).and_then(|_| middle_is_green(renderer));
        sleep(GRACE_MS / 2).await;
        if let Some(reason) = renderer.lost() {
            return Err(failed(renderer, format!("the device was lost: {reason}")));
        }
    }
    renderer.clear();
    last
}

fn failed(renderer: &Renderer, reason: String) -> RenderError {
    RenderError::SelfTest { backend: renderer.backend().name(), reason }
}

fn one_point() -> SemanticCloud {
    std::iter::once(SemanticPoint {
        position: [0.0; 3],
        normal: [0.0; 3],
        color: GREEN,
        label: 1,
        confidence: 1.0,
        defect: 0,
        defect_confidence: 0.0,
        sigma: 0.0,
        defect_sigma: 0.0,
        instance: 0,
        views: 1,
        flags: PointFlags::default(),
    })
    .collect()
}

fn middle_is_green(renderer: &Renderer) -> Result<(), RenderError> {
    let canvas = renderer.canvas();
    let [r, g, b, _] =
        middle_pixel(canvas).map_err(|e| failed(renderer, format!("the canvas cannot be read: {e:?}")))?;
    if g > 150 && r < 100 && b < 100 {
        return Ok(());
    }
    Err(failed(renderer, format!("drew green, the canvas shows ({r}, {g}, {b})")))
}

/// The pixel in the middle; must be asked for in the task that drew the frame.
fn middle_pixel(canvas: &HtmlCanvasElement) -> Result<[u8; 4], JsValue> {
    let page = canvas.owner_document().ok_or("no document")?;
    let flat: HtmlCanvasElement = page.create_element("canvas")?.unchecked_into();
    flat.set_width(1);
    flat.set_height(1);
    let context: CanvasRenderingContext2d = flat.get_context("2d")?.ok_or("no 2D canvas")?.unchecked_into();
    let (x, y) = (f64::from(canvas.width() / 2), f64::from(canvas.height() / 2));
    context.draw_image_with_html_canvas_element(canvas, -x, -y)?;
    let data = context.get_image_data(0.0, 0.0, 1.0, 1.0)?.data().0;
    data.as_slice().try_into().map_err(|_| "no pixel".into())
}

async fn sleep(ms: i32) {
    let mut start = |resolve: Function, _reject: Function| {
        let timer = web_sys::window().map(|w| w.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, ms));
        if !matches!(timer, Some(Ok(_))) {
            // Without a clock there is nothing to wait for.
            let _ = resolve.call0(&JsValue::UNDEFINED);
        }
    };
    // The promise is only ever resolved.
    let _ = JsFuture::from(Promise::new(&mut start)).await;
}
