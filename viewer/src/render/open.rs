//! Which graphics interface draws: it is opened, and counts only if it passes the self-test.

use super::error::RenderError;
use super::gpu::{Backend, Gpu, replace_canvas};
use super::renderer::Renderer;
use super::request::BackendChoice;
use super::self_test;
use web_sys::HtmlCanvasElement;

impl Renderer {
    /// Starts to draw on `canvas`. A graphics interface counts only if it passes the self-test; before another one is
    /// tried the canvas element is replaced by a fresh one with the same attributes, so ask for [`Renderer::canvas`]
    /// before adding listeners.
    ///
    /// # Errors
    /// [`RenderError`] if no interface, or not the one chosen, draws.
    pub async fn new(canvas: HtmlCanvasElement, choice: BackendChoice) -> Result<Self, RenderError> {
        let first = match choice {
            BackendChoice::Auto => Backend::WebGpu,
            BackendChoice::WebGpu => return Self::open(canvas, Backend::WebGpu).await,
            BackendChoice::WebGl2 => return Self::open(canvas, Backend::WebGl2).await,
        };
        let webgpu = match Self::open(canvas.clone(), first).await {
            Ok(renderer) => return Ok(renderer),
            Err(error) => error.to_string(),
        };
        web_sys::console::warn_1(&format!("semascan: {webgpu}; trying webgl2").into());
        let fresh = replace_canvas(&canvas)?;
        match Self::open(fresh, Backend::WebGl2).await {
            Ok(renderer) => Ok(renderer),
            Err(error) => Err(RenderError::Nothing { webgpu, webgl2: error.to_string() }),
        }
    }

    /// A new renderer on a fresh canvas in the place of one whose device was lost. With [`BackendChoice::Auto`] it takes
    /// WebGL2: WebGPU has failed already, now or at the start. Set every chunk again.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub async fn rebuild(self, choice: BackendChoice) -> Result<Self, RenderError> {
        let fresh = replace_canvas(self.canvas())?;
        drop(self);
        let backend = match choice {
            BackendChoice::Auto | BackendChoice::WebGl2 => Backend::WebGl2,
            BackendChoice::WebGpu => Backend::WebGpu,
        };
        Self::open(fresh, backend).await
    }

    async fn open(canvas: HtmlCanvasElement, backend: Backend) -> Result<Self, RenderError> {
        let mut renderer = Self::on(Gpu::open(canvas, backend).await?);
        self_test::run(&mut renderer).await?;
        renderer.restart_counts();
        Ok(renderer)
    }
}
