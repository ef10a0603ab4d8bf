//! Labelled pictures for LabelMe: `images/NAME.png` and, for components and defects each, `KIND/NAME.json` with polygons.
//!
//! Pieces of one object have the same `group_id`. What is not known has the label `__ignore__`, as LabelMe's own examples name
//! it; the training code leaves it out. `part`, which LabelMe keeps and does not read, names the part: two inspections of one
//! belong on one side of a split. Coordinates count from the corner of a pixel, as LabelMe's do.

use super::labelled_picture::{ClassPixels, LabelledPicture};
use super::polygons::{Polygon, polygons};
use crate::bop::{write_json, write_png};
use image::ExtendedColorType;
use semascan_inspection::source::SourceError;
use semascan_labelling::IGNORE;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Label of the pixels of which nothing is known.
pub const IGNORE_LABEL: &str = "__ignore__";
/// Version of LabelMe whose files these are.
const VERSION: &str = "5.5.0";

/// A folder of labelled pictures.
#[derive(Debug)]
pub struct LabelmeWriter {
    folder: PathBuf,
}

impl LabelmeWriter {
    /// Makes the folders in `folder`.
    ///
    /// # Errors
    /// [`SourceError::Io`] naming the folder that cannot be made.
    pub fn create(folder: &Path) -> Result<Self, SourceError> {
        for name in ["images", "components", "defects"] {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(|source| SourceError::Io { path, source })?;
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes a picture and its two files of labels.
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub fn write(&self, picture: &LabelledPicture<'_>) -> Result<(), SourceError> {
        let name = format!("{}.png", picture.name);
        let image = self.folder.join("images").join(&name);
        write_png(&image, picture.rgb.as_raw(), picture.rgb.dimensions(), ExtendedColorType::Rgb8)?;
        for (kind, labels, shown) in [
            ("components", &picture.masks.components, picture.components()),
            ("defects", &picture.masks.defects, picture.defects()),
        ] {
            let file = json!({
                "version": VERSION,
                "flags": {},
                "part": picture.part,
                "shapes": shapes(labels, &shown, picture.masks.width),
                "imagePath": format!("../images/{name}"),
                "imageData": null,
                "imageHeight": picture.masks.height,
                "imageWidth": picture.masks.width,
            });
            write_json(&self.folder.join(kind).join(format!("{}.json", picture.name)), &file)?;
        }
        Ok(())
    }
}

fn shapes(labels: &[u16], shown: &[ClassPixels<'_>], width: usize) -> Vec<Value> {
    let unknown: Vec<bool> = labels.iter().map(|label| *label == IGNORE).collect();
    let mut shapes = Vec::new();
    for (group, ClassPixels { class, mask }) in (1..).zip(shown) {
        let pieces = polygons(mask, width).into_iter().flatten();
        shapes.extend(pieces.map(|polygon| shape(&class.name, Some(group), &polygon)));
    }
    shapes.extend(polygons(&unknown, width).iter().flatten().map(|polygon| shape(IGNORE_LABEL, None, polygon)));
    shapes
}

fn shape(label: &str, group: Option<u32>, polygon: &Polygon) -> Value {
    let points: Vec<[f64; 2]> = polygon.iter().map(|p| p.map(|c| f64::from(c) + 0.5)).collect();
    json!({ "label": label, "points": points, "group_id": group, "shape_type": "polygon", "flags": {}, "description": "" })
}
