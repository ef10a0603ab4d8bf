//! The tools: each is one folder that owns its state, its events, its panel and what it lays over the 3D view.
//!
//! | module | what | runs |
//! |---|---|---|
//! | [`mesh`] | the model's surface as a mesh | in part anywhere |
//! | [`deviation`] | how far the mesh is from a reference | in part anywhere |
//! | `feature` | [`Feature`]: what a tool is to the state | anywhere |
//! | `registry` | [`Features`], [`FeatureEvent`]: all tools' states and events, made of the table | anywhere |
//! | `view` | `FeatureView`: what a tool is to the page | in a browser |
//! | `mounted` | all tools' panels, overlays and controllers, made of the table | in a browser |
//!
//! To add a tool, write its folder and enter it below: its module, and its row in the table. Its `mod.rs` names the type
//! of its state, which implements [`Feature`] and, in a browser, `FeatureView`; whatever of these traits the tool has no
//! use for, it leaves out. A tool may know another one, in one direction: deviations are those of the mesh.

/// The table of tools, in the order of their panels. A row is the tool's module and the type of its state there; `$then`
/// is a macro that gets all rows.
macro_rules! for_each_feature {
    ($then:ident) => {
        $then! {
            mesh: Mesh,
            deviation: Deviation,
        }
    };
}

pub mod deviation;
pub mod mesh;

mod feature;
mod registry;

#[cfg(target_arch = "wasm32")]
pub mod mounted;
#[cfg(target_arch = "wasm32")]
pub mod view;

pub use feature::Feature;
pub use registry::{FeatureEvent, Features};
