//! The 3D picture: one primitive = one `.rs` + one `.wgsl`.
//!
//! | module | what |
//! |---|---|
//! | [`request`] | what a frame shall show: pure data |
//! | [`colormap`] | the ramps of confidence and views, shared with the legend |
//! | [`record`] | a point as the GPU reads it |
//! | [`pool`] | which part of which data texture belongs to which chunk |
//! | [`frustum`] | a camera pose as line segments |
//! | `points`, `background`, `turntable`, `floor`, `lines` | the primitives (browser only) |
//! | `gpu`, `self_test`, `renderer` | device and canvas, fallback, the frame (browser only) |
//!
//! How a page uses it:
//!
//! ```text
//! let mut renderer = Renderer::new(canvas, BackendChoice::Auto).await?;   // may replace the canvas element:
//! let pointer = CameraPointer::attach(renderer.canvas(), move |input| ..)?;    // so ask for it afterwards
//! renderer.on_lost(|reason| ..);                      // then: Renderer::rebuild(renderer, choice).await, set every chunk again
//! match model.apply(&event) {                         // ModelChange
//!     Cleared => renderer.clear(),
//!     Replaced(id) => renderer.set_chunk(id, &chunk.cloud),
//!     Removed(id) => renderer.remove_chunk(id),
//!     None => {}
//! }
//! renderer.resize(css_width, css_height, device_pixel_ratio);
//! let stats: FrameStats = renderer.draw(&request)?;   // on demand, at most once per animation frame
//! ```

pub mod request;

pub use request::{
    BackendChoice, CameraFrustum, ClassMask, ColorMode, DrawRequest, HiddenFlags, Palette, Theme,
    Turntable,
};
