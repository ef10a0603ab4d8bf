//! The 3D picture: one primitive = one `.rs` + one `.wgsl`.
//!
//! | module | what |
//! |---|---|
//! | [`request`] | what a frame shall show: pure data |
//! | [`record`], [`mesh_vertex`] | a point and a mesh as the GPU reads them |
//! | [`pool`], [`thinning`], [`point_counts`] | where a chunk's points lie, in which order, how many of them show |
//! | [`pick_window`], [`seen`] | the pixels that a pick reads back, what it found |
//! | [`frustum`], [`axes`] | camera poses and the table frame as line [`segment`]s |
//! | [`photograph_camera`] | where a place lies in a photograph |
//! | [`scale`] | round distances of grid lines |
//! | [`device_lost`], `error` | the loss of the device; why there is no picture |
//! | `points`, `mesh`, `background`, `turntable`, `floor`, `lines` | the primitives (browser only) |
//! | `photograph`, `photo_layers` | a photograph on the mesh, several as its colours (browser only) |
//! | `photograph_distances` | the mesh as a photograph's camera sees it (browser only) |
//! | `cap` | what a section encloses (browser only) |
//! | `pick` | what lies at a place of the picture: the primitives as numbers (browser only) |
//! | `picture` | the frame's samples, shaded by their depth, on the canvas (browser only) |
//! | `frame`, `pipeline`, `lookup` | what primitives share (browser only) |
//! | `gpu`, `frames_in_flight`, `renderer` | device and canvas, frames not finished yet, the frame (browser only) |
//! | `self_test`, `open` | whether a device draws, and the fallback to another (browser only) |
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
//! if !renderer.is_busy() {                            // else in the next animation frame
//!     renderer.draw(&request, None)?;                 // on demand, at most once per animation frame; or the first step of it:
//! }                                                   // while renderer.is_unfinished() { renderer.go_on(most)?; } in later ones
//! renderer.pick(at);                                  // what lies there? then, with each animation frame:
//! if let Some(seen) = renderer.picked() { .. }
//! ```

pub mod axes;
pub mod device_lost;
mod error;
pub mod frustum;
pub mod mesh_vertex;
pub mod photograph_camera;
pub mod pick_window;
pub mod point_counts;
pub mod pool;
pub mod record;
pub mod request;
pub mod scale;
pub mod seen;
pub mod segment;
pub mod thinning;

#[cfg(target_arch = "wasm32")]
mod background;
#[cfg(target_arch = "wasm32")]
mod cap;
#[cfg(target_arch = "wasm32")]
mod floor;
#[cfg(target_arch = "wasm32")]
mod frame;
#[cfg(target_arch = "wasm32")]
mod frames_in_flight;
#[cfg(target_arch = "wasm32")]
mod gpu;
#[cfg(target_arch = "wasm32")]
mod lines;
#[cfg(target_arch = "wasm32")]
mod lookup;
#[cfg(target_arch = "wasm32")]
mod mesh;
#[cfg(target_arch = "wasm32")]
mod open;
#[cfg(target_arch = "wasm32")]
mod photo_layers;
#[cfg(target_arch = "wasm32")]
mod photograph;
#[cfg(target_arch = "wasm32")]
mod photograph_distances;
#[cfg(target_arch = "wasm32")]
mod pick;
#[cfg(target_arch = "wasm32")]
mod picture;
#[cfg(target_arch = "wasm32")]
mod pipeline;
#[cfg(target_arch = "wasm32")]
mod points;
#[cfg(target_arch = "wasm32")]
mod renderer;
#[cfg(target_arch = "wasm32")]
mod self_test;
#[cfg(target_arch = "wasm32")]
mod turntable;

pub use request::{
    BackendChoice, CameraFrustum, DrawRequest, FrameContent, PhotoLayer, ProjectedPhotograph, SectionPicture, Turntable,
};

pub use error::RenderError;
#[cfg(target_arch = "wasm32")]
pub use gpu::Backend;
#[cfg(target_arch = "wasm32")]
pub use renderer::Renderer;
