//! The colours of the classes.

use semascan_model::{ClassDef, Color, Taxonomy};

/// sRGB colours of the classes, by class.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Palette {
    /// Component classes.
    pub components: Vec<Color>,
    /// Defect classes.
    pub defects: Vec<Color>,
}

impl Palette {
    /// The colours of a taxonomy.
    pub fn from_taxonomy(taxonomy: &Taxonomy) -> Self {
        let colors = |classes: &[ClassDef]| classes.iter().map(|c| c.color).collect();
        Self { components: colors(&taxonomy.components), defects: colors(&taxonomy.defects) }
    }
}

/// A colour as style sheets have it: `#rrggbb`.
pub fn css_color([red, green, blue]: Color) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
