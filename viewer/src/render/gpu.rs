//! The graphics device on a canvas, by one of the two interfaces a browser may offer.

use super::device_lost::DeviceLost;
use super::error::RenderError;
use glam::Vec2;
use std::sync::Arc;
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;
use wgpu::{
    Backends, CompositeAlphaMode, Device, DeviceDescriptor, Features, Instance, InstanceDescriptor, Limits,
    PresentMode, Queue, RequestAdapterOptions, Surface, SurfaceColorSpace, SurfaceConfiguration, TextureFormat,
    TextureUsages,
};

/// A graphics interface of the browser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// WebGPU.
    WebGpu,
    /// WebGL2.
    WebGl2,
}

impl Backend {
    /// Its name in the page's `renderer` parameter and in the canvas's `data-backend`.
    pub fn name(self) -> &'static str {
        match self {
            Self::WebGpu => "webgpu",
            Self::WebGl2 => "webgl2",
        }
    }
}

/// Device, queue and surface of a canvas.
pub(super) struct Gpu {
    pub(super) backend: Backend,
    pub(super) canvas: HtmlCanvasElement,
    pub(super) device: Device,
    pub(super) queue: Queue,
    pub(super) surface: Surface<'static>,
    pub(super) config: SurfaceConfiguration,
    pub(super) lost: DeviceLost,
    /// Whether the canvas does not have the size of the configuration yet.
    is_resized: bool,
    on_context_lost: Closure<dyn FnMut(JsValue)>,
}

impl Gpu {
    /// Opens `backend` on `canvas`. A canvas that has given out one kind of context gives no other: take a fresh one
    /// after a failure.
    pub(super) async fn open(canvas: HtmlCanvasElement, backend: Backend) -> Result<Self, RenderError> {
        let fail = |what: &str, why: String| RenderError::Backend {
            backend: backend.name(),
            reason: format!("{what}: {why}"),
        };
        if backend == Backend::WebGpu && !wgpu::util::is_browser_webgpu_supported().await {
            return Err(fail("WebGPU", "this browser offers no adapter".to_owned()));
        }
        let backends = match backend {
            Backend::WebGpu => Backends::BROWSER_WEBGPU,
            Backend::WebGl2 => Backends::GL,
        };
        let instance =
            Instance::new(InstanceDescriptor { backends, ..InstanceDescriptor::new_without_display_handle() });
        let target = wgpu::SurfaceTarget::Canvas(canvas.clone());
        let surface = instance.create_surface(target).map_err(|e| fail("surface", e.to_string()))?;
        let options = RequestAdapterOptions { compatible_surface: Some(&surface), ..RequestAdapterOptions::default() };
        let adapter = instance.request_adapter(&options).await.map_err(|e| fail("adapter", e.to_string()))?;
        let descriptor = DeviceDescriptor {
            label: Some("semascan"),
            required_features: Features::empty(),
            required_limits: Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits()),
            ..DeviceDescriptor::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|e| fail("device", e.to_string()))?;

        // Colours are encoded by the shaders: a plain format is the only kind that both interfaces offer.
        let formats = surface.get_capabilities(&adapter).formats;
        let plain = formats.iter().find(|f| matches!(f, TextureFormat::Rgba8Unorm | TextureFormat::Bgra8Unorm));
        let format = *plain.ok_or_else(|| fail("surface", format!("formats {formats:?}")))?;
        let config = SurfaceConfiguration {
            usage: TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: SurfaceColorSpace::Auto,
            width: canvas.width().max(1),
            height: canvas.height().max(1),
            present_mode: PresentMode::Fifo,
            desired_maximum_frame_latency: 2,
            alpha_mode: CompositeAlphaMode::Opaque,
            view_formats: Vec::new(),
        };
        surface.configure(&device, &config);

        let lost = DeviceLost::default();
        let reported = lost.clone();
        device.set_device_lost_callback(move |reason, message| reported.report(format!("{reason:?}: {message}")));
        device.on_uncaptured_error(Arc::new(|error: wgpu::Error| {
            web_sys::console::error_1(&format!("semascan: graphics error: {error}").into());
        }));
        let reported = lost.clone();
        let on_context_lost =
            Closure::<dyn FnMut(JsValue)>::new(move |_| reported.report("the WebGL2 context was lost".to_owned()));
        let listener = on_context_lost.as_ref().unchecked_ref();
        canvas
            .add_event_listener_with_callback(CONTEXT_LOST, listener)
            .map_err(|e| fail("canvas", format!("{e:?}")))?;
        Ok(Self { backend, canvas, device, queue, surface, config, lost, is_resized: false, on_context_lost })
    }

    /// Sets the size of the picture in device pixels.
    pub(super) fn resize(&mut self, width: u32, height: u32) {
        let most = self.device.limits().max_texture_dimension_2d;
        let (width, height) = (width.clamp(1, most), height.clamp(1, most));
        if (width, height) != (self.config.width, self.config.height) {
            (self.config.width, self.config.height) = (width, height);
            self.is_resized = true;
        }
    }

    /// Columns and rows of the picture.
    pub(super) fn size(&self) -> Vec2 {
        Vec2::new(self.config.width as f32, self.config.height as f32)
    }

    /// Gives the canvas the size of the picture that is about to come onto it: until then it shows the one before, of another size.
    pub(super) fn bring_to_size(&mut self) {
        if std::mem::take(&mut self.is_resized) {
            self.surface.configure(&self.device, &self.config);
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        let listener = self.on_context_lost.as_ref().unchecked_ref();
        // The canvas may be gone from the page; nothing is left to do then.
        let _ = self.canvas.remove_event_listener_with_callback(CONTEXT_LOST, listener);
    }
}

const CONTEXT_LOST: &str = "webglcontextlost";

/// Puts a fresh canvas with the same attributes in the place of `canvas`.
pub(super) fn replace_canvas(canvas: &HtmlCanvasElement) -> Result<HtmlCanvasElement, RenderError> {
    let fail = |e: JsValue| RenderError::Page(format!("{e:?}"));
    let fresh: HtmlCanvasElement = canvas.clone_node().map_err(fail)?.unchecked_into();
    canvas.replace_with_with_node_1(&fresh).map_err(fail)?;
    Ok(fresh)
}
