//! A folder of labelled training data: one BOP scene a part, drawn by a [`PartGenerator`]; and labelled pictures in other
//! formats ([`LabelmeWriter`], [`CocoWriter`]).
//!
//! ```text
//! DIR/dataset.json      what the set is made of: see [`Manifest`]
//! DIR/000000/           a part: rgb/ depth/ mask_visib/ scene_camera.json scene_gt.json objects.json (BOP),
//!                       labels/ defects/ (one class a pixel) defects.json, part.json (the part's own seed)
//! ```
//!
//! A part is written beside its place and moved there when it is whole, so a part that is there is complete; a run that
//! was stopped is taken up by the same command. Part and view depend on the set's seed and their numbers alone: several
//! processes may write different parts of one set.

mod coco;
mod labelled_picture;
mod labelme;
mod manifest;
mod polygons;

pub use coco::CocoWriter;
pub use labelled_picture::LabelledPicture;
pub use labelme::{IGNORE_LABEL, LabelmeWriter};
pub use manifest::Manifest;

use crate::bop::{SceneEntry, SceneWriter, write_json};
use nalgebra::Isometry3;
use rayon::prelude::*;
use semascan_inspection::source::SourceError;
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use serde_json::Value;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Draws the labelled parts that training sets are made of.
pub trait PartGenerator: Sync {
    /// What it draws, and how: two runs that agree on it draw the same.
    fn description(&self) -> Description;

    /// Part `part`: depends on the generator's seed and this number alone.
    fn part(&self, part: u32) -> Box<dyn GeneratedPart + '_>;
}

/// What a [`PartGenerator`] draws, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// What draws the pictures, and its version.
    pub generator: String,
    /// Everything random depends on it.
    pub seed: u64,
    /// Columns and rows of the camera's picture.
    pub size: (u32, u32),
    /// Columns and rows of the window of it that the pictures show.
    pub window: (u32, u32),
    /// Cells of the parts' meshes in millimetres.
    pub cell: f32,
    /// Classes of the labels.
    pub taxonomy: Taxonomy,
}

/// One part of a training set.
pub trait GeneratedPart: Sync {
    /// The part's pose in the table frame.
    fn table_from_part(&self) -> Isometry3<f64>;

    /// View `index` with its labels: depends on the part and this number alone.
    fn view(&self, index: u32) -> View;

    /// What people may want to know of the part, for `part.json`.
    fn about(&self) -> Value;
}

/// A training set on disk.
pub struct TrainingSet<G> {
    folder: PathBuf,
    manifest: Manifest,
    generator: G,
}

impl<G: PartGenerator> TrainingSet<G> {
    /// Begins the set in `folder`, or goes on with the one that is there, to hold `parts` parts of `views` views.
    ///
    /// # Errors
    /// [`SourceError::Io`] if the folder cannot be written; [`SourceError::Field`] if the set that is there was made
    /// otherwise, naming in what.
    pub fn open(folder: &Path, parts: u32, views: u32, generator: G) -> Result<Self, SourceError> {
        fs::create_dir_all(folder).map_err(|source| SourceError::Io { path: folder.to_owned(), source })?;
        let path = folder.join("dataset.json");
        let mut manifest = Manifest::new(parts, views, generator.description());
        if let Some(there) = Manifest::read(&path)? {
            if let Some((field, has, wants)) = there.difference(&manifest) {
                let reason = format!("the set that is there has {has}, asked for is {wants}: name another folder");
                return Err(SourceError::Field { path, field: field.into(), reason });
            }
            manifest.parts = parts.max(there.parts);
        }
        manifest.write(&path)?;
        Ok(Self { folder: folder.to_owned(), manifest, generator })
    }

    /// The set's description.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The folder of a part.
    pub fn part_folder(&self, part: u32) -> PathBuf {
        self.folder.join(format!("{part:06}"))
    }

    /// Whether a part is there, which is to say: whole.
    pub fn has(&self, part: u32) -> bool {
        self.part_folder(part).exists()
    }

    /// Parts of `range` that are not there yet.
    pub fn missing(&self, range: Range<u32>) -> Vec<u32> {
        range.filter(|part| !self.has(*part)).collect()
    }

    /// Draws and writes a part; `on_view` is called after every view, from any thread.
    ///
    /// # Errors
    /// [`SourceError`] naming the file that cannot be written; the part is not there then.
    pub fn write_part(&self, part: u32, on_view: &(dyn Fn() + Sync)) -> Result<(), SourceError> {
        let draft = self.folder.join(format!(".{part:06}.partial"));
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| SourceError::Io { path, source }
        };
        if draft.exists() {
            // What an earlier run left half done.
            fs::remove_dir_all(&draft).map_err(io(&draft))?;
        }
        let generated = self.generator.part(part);
        let writer = SceneWriter::create(&draft, &self.generator.description().taxonomy, generated.table_from_part())?;
        let write = |index| {
            let entry = writer.write(&generated.view(index));
            on_view();
            entry
        };
        let entries: Result<Vec<SceneEntry>, SourceError> =
            (0..self.manifest.views).into_par_iter().map(write).collect();
        writer.finish(&entries?)?;
        write_json(&draft.join("part.json"), &generated.about())?;
        let place = self.part_folder(part);
        fs::rename(&draft, &place).map_err(io(&place))
    }
}

#[cfg(test)]
mod tests;
