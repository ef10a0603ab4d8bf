//! The pictures that a file of captures names: the board is looked for in each.

use crate::commands::Failure;
use anyhow::{Context, anyhow};
use image::{DynamicImage, GrayImage, ImageReader, imageops};
use rayon::prelude::*;
use semascan_boards::{DetectError, detect};
use semascan_calibration::{CaptureFile, ReadCaptures};
use semascan_formats::regular_file;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Largest file of captures: thousands of them with their corners.
const LARGEST: u64 = 256 << 20;
/// Largest picture.
const LARGEST_PICTURE: u64 = 256 << 20;
/// Columns of a picture in a report at most, and the quality of its JPEG.
const SHOWN: (u32, u8) = (800, 80);

/// A file of captures with what its pictures show.
pub(super) struct Opened {
    pub(super) file: CaptureFile,
    pub(super) read: ReadCaptures,
    /// Names of the pictures, and the pictures as JPEG where a report needs them, by capture.
    pub(super) pictures: BTreeMap<usize, (String, Option<Vec<u8>>)>,
}

/// Reads a file of captures and looks for the board in its pictures, which lie beside it.
///
/// * `is_shown`: whether the pictures are wanted for a report.
///
/// # Errors
/// [`Failure`] naming the file and the field.
pub(super) fn open(path: &Path, is_shown: bool) -> Result<Opened, Failure> {
    let name = path.display();
    let of_call = |error: anyhow::Error| Failure::Call(error.context(name.to_string()));
    let content = regular_file::read_at_most(path, LARGEST).with_context(|| name.to_string())?;
    let mut file = CaptureFile::parse(&content).map_err(|error| of_call(error.into()))?;
    let board = file.board().map_err(|error| of_call(error.into()))?.cloned();
    let camera = file.camera().map_err(|error| of_call(error.into()))?;
    let names: Vec<(usize, String)> = file.pictures().map(|(number, name)| (number, name.to_owned())).collect();
    let mut pictures = BTreeMap::new();
    if !names.is_empty() {
        let missing = |what: &str| of_call(anyhow!("{what}: captures with pictures need it"));
        let board = board.ok_or_else(|| missing("board"))?;
        let camera = camera.ok_or_else(|| missing("camera"))?;
        let size = (camera.intrinsics().width, camera.intrinsics().height);
        let folder = path.parent().unwrap_or(Path::new("."));
        let found: Vec<_> = names
            .par_iter()
            .map(|(number, picture)| {
                let grey = read(&folder.join(picture), size)?;
                let seen = match detect(&board, &grey) {
                    Ok(corners) => Ok(corners),
                    Err(DetectError::Unseen(reason)) => Err(format!("no board was found: {reason}")),
                    Err(error) => return Err(anyhow!("board: {error}")),
                };
                let shown = if is_shown { Some(jpeg(grey)?) } else { None };
                Ok((*number, picture.clone(), seen, shown))
            })
            .collect::<anyhow::Result<_>>()
            .map_err(of_call)?;
        for (number, picture, seen, shown) in found {
            file.see(number, seen);
            pictures.insert(number, (picture, shown));
        }
    }
    let read = file.captures().map_err(|error| of_call(error.into()))?;
    Ok(Opened { file, read, pictures })
}

/// A picture's grey values.
fn read(path: &Path, size: (u32, u32)) -> anyhow::Result<GrayImage> {
    let name = || path.display().to_string();
    let content = regular_file::read_at_most(path, LARGEST_PICTURE).with_context(name)?;
    let reader = ImageReader::new(Cursor::new(content)).with_guessed_format().with_context(name)?;
    let grey = reader.decode().with_context(name)?.into_luma8();
    if grey.dimensions() != size {
        let (width, height) = grey.dimensions();
        return Err(anyhow!("{}: is of {width} x {height} pixels, and the camera of {} x {}", name(), size.0, size.1));
    }
    Ok(grey)
}

/// The picture as a report shows it.
fn jpeg(grey: GrayImage) -> anyhow::Result<Vec<u8>> {
    let (width, height) = grey.dimensions();
    let shown = if width > SHOWN.0 {
        let height = (u64::from(height) * u64::from(SHOWN.0) / u64::from(width)).max(1) as u32;
        imageops::resize(&grey, SHOWN.0, height, imageops::FilterType::Triangle)
    } else {
        grey
    };
    let mut out = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, SHOWN.1);
    DynamicImage::ImageLuma8(shown).write_with_encoder(encoder).context("JPEG")?;
    Ok(out)
}
