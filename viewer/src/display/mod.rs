//! How the model is shown, as plain data: what state, renderer and panels all speak of. It knows none of them.
//!
//! | module | what |
//! |---|---|
//! | `settings` | [`Display`]: how the person has set up the display |
//! | `color_mode` | what the colours mean |
//! | [`color_ramp`], [`deviation_colors`] | the colours of scalars and of deviations, the same in picture and legend |
//! | `cut` | what is cut away |
//! | `palette` | the colours of the classes |
//! | `scalar_scale` | from which share to which the ramp goes |
//! | `theme` | light or dark |
//! | `visibility` | which points are shown |

mod color_mode;
pub mod color_ramp;
mod cut;
pub mod deviation_colors;
mod palette;
mod scalar_scale;
mod settings;
mod theme;
mod visibility;

pub use color_mode::ColorMode;
pub use cut::Cut;
pub use palette::{Palette, css_color};
pub use scalar_scale::{ScalarScale, ShareHistogram, ShareScales};
pub use settings::{Display, Representation};
pub use theme::{ColorScheme, Theme};
pub use visibility::{ClassMask, HiddenFlags};
