//! Semascan's viewer: watches the semantic model grow, in any browser.

pub mod app;
