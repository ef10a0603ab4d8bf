//! Semascan's viewer: watches the semantic model grow, in any browser.

pub mod app;
pub mod link;
pub mod model;
pub mod page;
#[cfg(target_arch = "wasm32")]
pub mod panels;
pub mod render;
pub mod tools;
