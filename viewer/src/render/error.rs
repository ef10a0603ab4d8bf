//! Why there is no picture, for people: each names the graphics interface and what it said.

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A graphics interface is missing or refuses.
    #[error("{backend} is not available: {reason}")]
    Backend {
        /// `webgpu` or `webgl2`.
        backend: &'static str,
        /// What failed and why.
        reason: String,
    },
    /// A graphics interface is there but does not draw.
    #[error("{backend} failed its self-test: {reason}")]
    SelfTest {
        /// `webgpu` or `webgl2`.
        backend: &'static str,
        /// What the test saw.
        reason: String,
    },
    /// Every interface failed.
    #[error("no 3D graphics in this browser: {webgpu}; {webgl2}")]
    Nothing {
        /// How WebGPU failed.
        webgpu: String,
        /// How WebGL2 failed.
        webgl2: String,
    },
    /// The device is gone; see [`super::Renderer::rebuild`].
    #[error("the graphics device was lost: {0}")]
    Lost(String),
    /// The page does not let itself be changed.
    #[error("the canvas cannot be replaced: {0}")]
    Page(String),
}
