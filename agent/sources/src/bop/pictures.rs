//! The picture files of a BOP scene.

use super::metadata::SceneMetadata;
use image::{DynamicImage, ImageReader, Limits, RgbImage};
use semascan_inspection::source::SourceError;
use semascan_perception::view::DepthImage;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Largest picture edge that is read: beyond any camera, and a bound on what a broken header can ask for.
const MAX_EDGE: u32 = 16_384;

/// `folder/kind/000007.png`.
pub(super) fn path_of(folder: &Path, kind: &str, number: u32) -> PathBuf {
    folder.join(kind).join(format!("{number:06}.png"))
}

/// Numbers of the scene's views: every picture and every camera entry, so that a missing half is noticed.
pub(super) fn view_numbers(folder: &Path, metadata: &SceneMetadata) -> Result<Vec<u32>, SourceError> {
    let rgb = folder.join("rgb");
    let entries = std::fs::read_dir(&rgb).map_err(|source| SourceError::Io { path: rgb.clone(), source })?;
    let number = |e: std::fs::DirEntry| Path::new(&e.file_name()).file_stem()?.to_str()?.parse::<u32>().ok();
    let mut numbers: BTreeSet<u32> = entries.filter_map(Result::ok).filter_map(number).collect();
    numbers.extend(metadata.camera_numbers());
    Ok(numbers.into_iter().collect())
}

pub(super) fn read_rgb(folder: &Path, number: u32) -> Result<RgbImage, SourceError> {
    let png = path_of(folder, "rgb", number);
    let jpg = png.with_extension("jpg");
    read(if !png.exists() && jpg.exists() { &jpg } else { &png }).map(DynamicImage::into_rgb8)
}

/// Depth in metres; `size` is what it must measure, if that is known.
pub(super) fn read_depth(
    folder: &Path,
    number: u32,
    metres_per_unit: f64,
    size: Option<(u32, u32)>,
) -> Result<DepthImage, SourceError> {
    let path = path_of(folder, "depth", number);
    let DynamicImage::ImageLuma16(picture) = read(&path)? else {
        return Err(SourceError::Format { path, reason: "depth is not a 16-bit grey picture".into() });
    };
    check_size(&path, picture.dimensions(), size)?;
    let (width, height) = picture.dimensions();
    let metres = picture.into_raw().into_iter().map(|d| (f64::from(d) * metres_per_unit) as f32).collect();
    Ok(DepthImage { width, height, metres })
}

/// Mask of object `k` of a view; `None` if the scene holds no such file (the object is hidden there).
pub(super) fn read_object_mask(
    folder: &Path,
    number: u32,
    k: usize,
    width: u32,
    height: u32,
) -> Result<Option<Vec<bool>>, SourceError> {
    let path = folder.join("mask_visib").join(format!("{number:06}_{k:06}.png"));
    if !path.exists() {
        return Ok(None);
    }
    let mask = read(&path)?.into_luma8();
    check_size(&path, mask.dimensions(), Some((width, height)))?;
    Ok(Some(mask.into_raw().into_iter().map(|m| m > 0).collect()))
}

/// The values of a view's picture in `defects/`; `None` if the scene holds no such file.
pub(super) fn read_defects(
    folder: &Path,
    number: u32,
    width: u32,
    height: u32,
) -> Result<Option<Vec<u8>>, SourceError> {
    let path = path_of(folder, "defects", number);
    if !path.exists() {
        return Ok(None);
    }
    let DynamicImage::ImageLuma8(picture) = read(&path)? else {
        return Err(SourceError::Format { path, reason: "defects are not an 8-bit grey picture".into() });
    };
    check_size(&path, picture.dimensions(), Some((width, height)))?;
    Ok(Some(picture.into_raw()))
}

/// A camera mask: nonzero pixels are ignored.
pub(super) fn read_mask(path: &Path) -> Result<Vec<bool>, SourceError> {
    Ok(read(path)?.into_luma8().into_raw().into_iter().map(|m| m > 0).collect())
}

fn check_size(path: &Path, found: (u32, u32), expected: Option<(u32, u32)>) -> Result<(), SourceError> {
    match expected {
        Some((w, h)) if (w, h) != found => Err(SourceError::Format {
            path: path.to_owned(),
            reason: format!("{}x{} pixels, but the colour picture has {w}x{h}", found.0, found.1),
        }),
        _ => Ok(()),
    }
}

fn read(path: &Path) -> Result<DynamicImage, SourceError> {
    let io = |source| SourceError::Io { path: path.to_owned(), source };
    let mut reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EDGE);
    limits.max_image_height = Some(MAX_EDGE);
    reader.limits(limits);
    reader.decode().map_err(|e| SourceError::Format { path: path.to_owned(), reason: e.to_string() })
}
