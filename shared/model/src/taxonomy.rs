//! Component and defect classes, known at run time: a source or a network brings its own.

use serde::{Deserialize, Serialize};

/// An sRGB colour, one byte a channel.
pub type Color = [u8; 3];

/// One class of a taxonomy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassDef {
    /// Index of the class; 0 always means none.
    pub id: u16,
    /// Lower-case name as people read it: `electrical connection`.
    pub name: String,
    /// Colour in every picture and export.
    pub color: Color,
}

impl ClassDef {
    /// A class from its parts.
    pub fn new(id: u16, name: impl Into<String>, color: Color) -> Self {
        Self { id, name: name.into(), color }
    }
}

/// The component classes (column K of [Remanufacturing paper], Eq. 2) and defect classes (column D, Eq. 3) of an
/// inspection.
///
/// Both lists are dense: `list[i].id == i`, and entry 0 is `none`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Taxonomy {
    /// Component classes.
    pub components: Vec<ClassDef>,
    /// Defect classes.
    pub defects: Vec<ClassDef>,
}

/// Colours for classes that bring none: told apart by people with colour-vision deficiency (after Okabe and Ito).
const PALETTE: [Color; 12] = [
    [0x3b, 0x82, 0xc4],
    [0xe6, 0x9f, 0x00],
    [0x2a, 0x9d, 0x76],
    [0xd5, 0x5e, 0x3a],
    [0xb6, 0x6d, 0xb0],
    [0x56, 0xb4, 0xe9],
    [0xc9, 0xb8, 0x2f],
    [0x7a, 0x5c, 0xc7],
    [0x8a, 0xa8, 0x3a],
    [0xe0, 0x7b, 0x9a],
    [0x4f, 0x8a, 0x8b],
    [0xa6, 0x76, 0x4a],
];

/// Grey of everything without a class.
const NONE_COLOR: Color = [0x8c, 0x93, 0x9c];

impl Taxonomy {
    /// A taxonomy from names; class 0 (`none`) is put in front and colours come from a fixed palette.
    pub fn from_names<S: AsRef<str>>(components: &[S], defects: &[S]) -> Self {
        Self { components: numbered(components, 0), defects: numbered(defects, 6) }
    }

    /// Number of component classes, `none` included.
    pub fn component_count(&self) -> usize {
        self.components.len()
    }

    /// Number of defect classes, `none` included.
    pub fn defect_count(&self) -> usize {
        self.defects.len()
    }
}

fn numbered<S: AsRef<str>>(names: &[S], first_color: usize) -> Vec<ClassDef> {
    let mut classes = vec![ClassDef::new(0, "none", NONE_COLOR)];
    for (i, name) in names.iter().enumerate() {
        classes.push(ClassDef::new(i as u16 + 1, name.as_ref(), PALETTE[(first_color + i) % PALETTE.len()]));
    }
    classes
}
