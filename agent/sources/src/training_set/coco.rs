//! Labelled pictures in the format of COCO: `images/NAME.png` and one `annotations.json`.
//!
//! An object of a component, and each connected region of a defect, is an annotation with a run-length mask, which can have
//! holes. What is not known is marked as COCO marks it: an annotation with `iscrowd` 1 for each category that could be there;
//! evaluation neither asks for it nor counts what is found in it. An image names its `part`: two inspections of one part belong
//! on one side of a split.

use super::labelled_picture::{ClassPixels, LabelledPicture};
use super::polygons::connected;
use crate::bop::{write_json, write_png};
use image::ExtendedColorType;
use semascan_inspection::source::SourceError;
use semascan_labelling::IGNORE;
use semascan_model::{ClassDef, Taxonomy};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Categories of defects have this and the number of their class.
const DEFECTS: u32 = 1000;

/// A folder of labelled pictures.
#[derive(Debug)]
pub struct CocoWriter {
    folder: PathBuf,
    taxonomy: Taxonomy,
    images: Vec<Value>,
    annotations: Vec<Value>,
}

impl CocoWriter {
    /// Makes the folders in `folder`.
    ///
    /// # Errors
    /// [`SourceError::Io`] naming the folder that cannot be made.
    pub fn create(folder: &Path, taxonomy: &Taxonomy) -> Result<Self, SourceError> {
        let path = folder.join("images");
        fs::create_dir_all(&path).map_err(|source| SourceError::Io { path, source })?;
        let (images, annotations) = (Vec::new(), Vec::new());
        Ok(Self { folder: folder.to_owned(), taxonomy: taxonomy.clone(), images, annotations })
    }

    /// Writes a picture, and keeps its annotations for [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub fn write(&mut self, picture: &LabelledPicture<'_>) -> Result<(), SourceError> {
        let name = format!("{}.png", picture.name);
        let path = self.folder.join("images").join(&name);
        write_png(&path, picture.rgb.as_raw(), picture.rgb.dimensions(), ExtendedColorType::Rgb8)?;
        let size = (picture.masks.width, picture.masks.height);
        let image = self.images.len() as u32 + 1;
        let entry = json!({ "id": image, "file_name": name, "width": size.0, "height": size.1, "part": picture.part });
        self.images.push(entry);
        let mut annotate = |category: u32, is_crowd: bool, mask: &[bool]| {
            let id = self.annotations.len() as u32 + 1;
            self.annotations.extend(annotation([id, image, category], is_crowd, mask, size));
        };
        for ClassPixels { class, mask } in picture.components() {
            annotate(u32::from(class.id), false, &mask);
        }
        for ClassPixels { class, mask } in picture.defects() {
            for region in connected(&mask, size.0) {
                annotate(DEFECTS + u32::from(class.id), false, &region);
            }
        }
        for (labels, classes, first) in [
            (&picture.masks.components, &self.taxonomy.components, 0),
            (&picture.masks.defects, &self.taxonomy.defects, DEFECTS),
        ] {
            let unknown: Vec<bool> = labels.iter().map(|label| *label == IGNORE).collect();
            for class in classes.iter().filter(|class| class.id != 0) {
                annotate(first + u32::from(class.id), true, &unknown);
            }
        }
        Ok(())
    }

    /// Writes `annotations.json`: after this the folder is whole.
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub fn finish(self) -> Result<(), SourceError> {
        let categories = |classes: &[ClassDef], first: u32, kind: &str| -> Vec<Value> {
            let known = classes.iter().filter(|class| class.id != 0);
            known.map(|c| json!({ "id": first + u32::from(c.id), "name": c.name, "supercategory": kind })).collect()
        };
        let mut all = categories(&self.taxonomy.components, 0, "component");
        all.extend(categories(&self.taxonomy.defects, DEFECTS, "defect"));
        let description = "masks projected from corrected models; iscrowd 1 is what is not known";
        let file = json!({
            "info": { "description": description },
            "licenses": [],
            "images": self.images,
            "annotations": self.annotations,
            "categories": all,
        });
        write_json(&self.folder.join("annotations.json"), &file)
    }
}

/// An annotation of the pixels of a mask; `None` where there are none.
fn annotation([id, image, category]: [u32; 3], is_crowd: bool, mask: &[bool], size: (usize, usize)) -> Option<Value> {
    let (width, height) = size;
    let set = || (0..mask.len()).filter(|at| mask[*at]).map(|at| (at % width, at / width));
    let (left, right) = (set().map(|p| p.0).min()?, set().map(|p| p.0).max()?);
    let (top, bottom) = (set().map(|p| p.1).min()?, set().map(|p| p.1).max()?);
    Some(json!({
        "id": id,
        "image_id": image,
        "category_id": category,
        "iscrowd": u8::from(is_crowd),
        "area": set().count(),
        "bbox": [left, top, right - left + 1, bottom - top + 1],
        "segmentation": { "size": [height, width], "counts": runs(mask, size) },
    }))
}

/// Lengths of the runs of unset and set pixels by turns, column by column; the first is of unset ones.
fn runs(mask: &[bool], (width, height): (usize, usize)) -> Vec<u32> {
    let mut runs = vec![0];
    let mut is_set = false;
    for x in 0..width {
        for y in 0..height {
            if mask[y * width + x] != is_set {
                is_set = !is_set;
                runs.push(0);
            }
            if let Some(last) = runs.last_mut() {
                *last += 1;
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_down_the_columns_and_begin_with_unset_pixels() {
        // o x x
        // x x o
        let mask = [false, true, true, true, true, false];
        assert_eq!(runs(&mask, (3, 2)), [1, 4, 1]);
        assert_eq!(runs(&[true, false], (1, 2)), [0, 1, 1]);
        assert_eq!(runs(&[false; 4], (2, 2)), [4]);
        let one = annotation([7, 3, 2], false, &mask, (3, 2)).expect("there are pixels");
        assert_eq!(one["area"], 4);
        assert_eq!(one["bbox"], json!([0, 0, 3, 2]));
        assert!(annotation([7, 3, 2], true, &[false; 6], (3, 2)).is_none());
    }
}
