//! A folder of labelled training data: one BOP scene a part, drawn by the virtual cell.
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

mod manifest;

pub use manifest::Manifest;

use super::AcquireError;
use super::bop::{SceneEntry, SceneWriter, write_json};
use super::virtual_cell::{Randomisation, TrainingCell, TrainingOptions};
use rayon::prelude::*;
use serde_json::json;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A training set on disk.
#[derive(Debug)]
pub struct TrainingSet {
    folder: PathBuf,
    manifest: Manifest,
    options: TrainingOptions,
}

impl TrainingSet {
    /// Begins the set in `folder`, or goes on with the one that is there, to hold `parts` parts of `views` views.
    ///
    /// # Errors
    /// [`AcquireError::Io`] if the folder cannot be written; [`AcquireError::Field`] if the set that is there was made
    /// otherwise, naming in what.
    pub fn open(
        folder: &Path,
        seed: u64,
        parts: u32,
        views: u32,
        options: TrainingOptions,
    ) -> Result<Self, AcquireError> {
        fs::create_dir_all(folder).map_err(|source| AcquireError::Io { path: folder.to_owned(), source })?;
        let path = folder.join("dataset.json");
        let mut manifest = Manifest::new(seed, parts, views, &options, &TrainingCell::taxonomy());
        if let Some(there) = Manifest::read(&path)? {
            if let Some((field, has, wants)) = there.difference(&manifest) {
                let reason = format!("the set that is there has {has}, asked for is {wants}: name another folder");
                return Err(AcquireError::Field { path, field: field.into(), reason });
            }
            manifest.parts = parts.max(there.parts);
        }
        manifest.write(&path)?;
        Ok(Self { folder: folder.to_owned(), manifest, options })
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

    /// Draws and writes a part; `on_view` hears of every finished view, from any thread.
    ///
    /// # Errors
    /// [`AcquireError`] naming the file that cannot be written; the part is not there then.
    pub fn write_part(&self, part: u32, on_view: &(dyn Fn() + Sync)) -> Result<(), AcquireError> {
        let draft = self.folder.join(format!(".{part:06}.partial"));
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| AcquireError::Io { path, source }
        };
        if draft.exists() {
            // What an earlier run left half done.
            fs::remove_dir_all(&draft).map_err(io(&draft))?;
        }
        let cell = TrainingCell::new(self.manifest.seed, part, self.options, Randomisation::TRAINING);
        let writer = SceneWriter::create(&draft, &TrainingCell::taxonomy(), cell.table_from_part())?;
        let write = |index| {
            let entry = writer.write(&cell.view(index));
            on_view();
            entry
        };
        let entries: Result<Vec<SceneEntry>, AcquireError> =
            (0..self.manifest.views).into_par_iter().map(write).collect();
        writer.finish(&entries?)?;
        let about = json!({ "part_seed": cell.part_seed(), "part": cell.description() });
        write_json(&draft.join("part.json"), &about)?;
        let place = self.part_folder(part);
        fs::rename(&draft, &place).map_err(io(&place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::Source;
    use crate::acquire::bop::{BopSource, CameraMask};

    const SMALL: TrainingOptions = TrainingOptions { size: (160, 120), window: (96, 64), cell: 3.0 };

    fn bytes_of(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let mut files = Vec::new();
        let mut folders = vec![folder.to_owned()];
        while let Some(next) = folders.pop() {
            for entry in fs::read_dir(next).expect("a folder").map(|e| e.expect("an entry").path()) {
                if entry.is_dir() {
                    folders.push(entry);
                } else {
                    let name = entry.strip_prefix(folder).expect("inside").to_owned();
                    files.push((name, fs::read(&entry).expect("reads")));
                }
            }
        }
        files.sort();
        files
    }

    #[test]
    fn a_part_is_the_same_bytes_again_and_a_scene_of_its_own() {
        let (a, b) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
        let make = |folder: &Path, parts: &[u32]| {
            let set = TrainingSet::open(folder, 5, 2, 3, SMALL).expect("begun");
            parts.iter().for_each(|p| set.write_part(*p, &|| ()).expect("written"));
        };
        make(a.path(), &[0, 1]);
        make(b.path(), &[1]);
        let one = bytes_of(&a.path().join("000001"));
        // Three views with four pictures each and some masks, five JSON files.
        assert!(one.len() > 3 * 4 + 5 && one == bytes_of(&b.path().join("000001")));
        assert_ne!(one, bytes_of(&a.path().join("000000")));
        let mut scene = BopSource::open(&a.path().join("000001"), &CameraMask::None).expect("a scene");
        assert_eq!(scene.info().view_count, Some(3));
        let cell = TrainingCell::new(5, 1, SMALL, Randomisation::TRAINING);
        for index in 0..3 {
            let (read, drawn) = (scene.next_view().expect("three views").expect("readable"), cell.view(index));
            assert_eq!(read.rgb, drawn.rgb);
            assert_eq!(read.labels.map(|l| l.components), drawn.labels.map(|l| l.components));
        }
    }

    #[test]
    fn a_stopped_run_leaves_no_half_part_and_is_taken_up() {
        let dir = tempfile::tempdir().expect("a folder");
        let set = TrainingSet::open(dir.path(), 5, 2, 1, SMALL).expect("begun");
        // What a killed run leaves behind.
        let left = dir.path().join(".000000.partial");
        fs::create_dir_all(left.join("rgb")).expect("made");
        fs::write(left.join("rgb/000099.png"), b"half").expect("written");
        assert_eq!(set.missing(0..2), [0, 1]);
        set.write_part(0, &|| ()).expect("written");
        assert!(!left.exists() && !set.part_folder(0).join("rgb/000099.png").exists());
        let again = TrainingSet::open(dir.path(), 5, 3, 1, SMALL).expect("the same set, larger");
        assert_eq!((again.missing(0..3), again.manifest().parts), (vec![1, 2], 3));
        let smaller = TrainingSet::open(dir.path(), 5, 1, 1, SMALL).expect("the same set");
        assert_eq!(smaller.manifest().parts, 3, "asking for less takes nothing away");
    }

    #[test]
    fn a_set_made_otherwise_is_not_added_to() {
        let dir = tempfile::tempdir().expect("a folder");
        TrainingSet::open(dir.path(), 5, 2, 1, SMALL).expect("begun");
        let larger = TrainingOptions { window: (128, 64), ..SMALL };
        for (attempt, field, value) in [
            (TrainingSet::open(dir.path(), 6, 2, 1, SMALL), "seed", "6"),
            (TrainingSet::open(dir.path(), 5, 2, 9, SMALL), "views", "9"),
            (TrainingSet::open(dir.path(), 5, 2, 1, larger), "window", "128"),
        ] {
            let message = attempt.expect_err(field).to_string();
            assert!(
                message.contains("dataset.json") && message.contains(field) && message.contains(value),
                "{message}"
            );
        }
        fs::write(dir.path().join("dataset.json"), "{").expect("written");
        let message = TrainingSet::open(dir.path(), 5, 2, 1, SMALL).expect_err("broken").to_string();
        assert!(message.contains("dataset.json"), "{message}");
    }
}
