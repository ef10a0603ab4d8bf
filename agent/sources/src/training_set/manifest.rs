//! `dataset.json`: what a training set is made of. Two runs may add to one set only if they agree on it.

use super::Description;
use crate::bop;
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use semascan_model::ClassDef;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// Version of the file's layout.
const SCHEMA: u32 = 1;

/// The set's own description.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this file's layout.
    pub schema: u32,
    /// What drew the pictures, and its version.
    pub generator: String,
    /// Everything random depends on it.
    pub seed: u64,
    /// Number of parts that were asked for; while a run goes on fewer are there.
    pub parts: u32,
    /// Views of each part.
    pub views: u32,
    /// Columns and rows of the camera's picture.
    pub size: (u32, u32),
    /// Columns and rows of the window of it that the pictures show.
    pub window: (u32, u32),
    /// Cells of the parts' meshes in millimetres.
    pub cell: f32,
    /// Names of the component classes, `none` first: values of `labels/`.
    pub classes: Vec<String>,
    /// Names of the defect classes, `none` first: values of `defects/`.
    pub defects: Vec<String>,
}

impl Manifest {
    /// The description of a set of `parts` parts that is to be written.
    pub fn new(parts: u32, views: u32, description: Description) -> Self {
        let Description { generator, seed, size, window, cell, taxonomy } = description;
        let names = |classes: &[ClassDef]| classes.iter().map(|c| c.name.clone()).collect();
        Self {
            schema: SCHEMA,
            generator,
            seed,
            parts,
            views,
            size,
            window,
            cell,
            classes: names(&taxonomy.components),
            defects: names(&taxonomy.defects),
        }
    }

    /// Reads the file; `None` if there is none.
    ///
    /// # Errors
    /// [`SourceError`] naming the file if it cannot be read or is no such description.
    pub fn read(path: &Path) -> Result<Option<Self>, SourceError> {
        let text = match regular_file::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(SourceError::Io { path: path.to_owned(), source }),
        };
        let read = serde_json::from_str(&text);
        read.map(Some).map_err(|e| SourceError::Format { path: path.to_owned(), reason: e.to_string() })
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`SourceError::Io`] naming the file.
    pub fn write(&self, path: &Path) -> Result<(), SourceError> {
        let draft = path.with_extension(format!("json.{}", std::process::id()));
        bop::write_json(&draft, self)?;
        fs::rename(&draft, path).map_err(|source| SourceError::Io { path: path.to_owned(), source })
    }

    /// The first field, the number of parts aside, in which `self` differs from `other`, with both values.
    pub(super) fn difference(&self, other: &Self) -> Option<(&'static str, String, String)> {
        macro_rules! compare {
            ($($field:ident),*) => {
                $(if self.$field != other.$field {
                    return Some((stringify!($field), format!("{:?}", self.$field), format!("{:?}", other.$field)));
                })*
            };
        }
        compare!(schema, generator, seed, views, size, window, cell, classes, defects);
        None
    }
}
