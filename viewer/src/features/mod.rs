//! The tools: each is one folder that owns its state, its events, its panel and what it lays over the 3D view.
//!
//! | module | what | runs |
//! |---|---|---|
//! | `feature` | [`Feature`]: what a tool is to the state | anywhere |
//! | `registry` | [`Features`], [`FeatureEvent`]: all tools' states and events, made of the table | anywhere |
//! | `view` | `FeatureView`: what a tool is to the page | in a browser |
//! | `mounted` | all tools' panels, overlays and controllers, made of the table | in a browser |
//!
//! To add a tool, write its folder and enter it here, as a module and as a row of the table. The folder's `mod.rs` exports
//! the type of the tool's state, which implements [`Feature`] and, for the browser, `FeatureView`; methods that the tool has
//! no use for keep their defaults. A tool may know another one, in one direction: deviations are those of the mesh,
//! photographs those of the inspected point, or of the mesh as a whole, a section goes through it, corrections are sent as reviews, others
//! are told what is inspected.

/// The table of tools, in the order of their panels. A row is the tool's module and the type of its state there; `$then`
/// is a macro that gets all rows.
macro_rules! for_each_feature {
    ($then:ident) => {
        $then! {
            tour: Tour,
            timeline: Timeline,
            review: Review,
            correct: Correct,
            measure: Measure,
            section: Section,
            inspect: Inspect,
            evidence: Evidence,
            mesh: Mesh,
            deviation: Deviation,
            photo: Photo,
            others: Others,
        }
    };
}

pub mod correct;
pub mod deviation;
pub mod evidence;
pub mod inspect;
pub mod measure;
pub mod mesh;
pub mod others;
pub mod photo;
pub mod review;
pub mod section;
pub mod timeline;
pub mod tour;

mod feature;
mod registry;

#[cfg(target_arch = "wasm32")]
pub mod mounted;
#[cfg(target_arch = "wasm32")]
pub mod view;

pub use feature::Feature;
pub use registry::{FeatureEvent, Features};
