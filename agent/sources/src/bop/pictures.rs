//! The pictures of a BOP scene: which files there are, and what colour and depth they hold.
//!
//! Colour lies in `rgb/`, or in `gray/` where a camera has none (ITODD). Depth is a picture of whole numbers, 16 bits or
//! more, times `depth_scale`, or a TIFF of floating point numbers. What is not a length (0, NaN, infinite, negative, the
//! largest number of the type, which sensors and renderers write for out of range, or farther than any sensor measures)
//! is missing depth.

use super::listing::Listing;
use super::mask;
use super::raster::{self, GreyTiff};
use super::sensor::Sensor;
use crate::camera_model::DepthEncoding;
use image::{DynamicImage, ImageFormat, RgbImage};
use semascan_inspection::source::SourceError;
use semascan_perception::view::DepthImage;
use std::fmt;
use std::path::{Path, PathBuf};

/// No depth sensor measures this far, in metres.
const FARTHEST: f64 = 1e3;

/// The picture files of a scene.
#[derive(Debug)]
pub(super) struct Pictures {
    pub(super) color: Listing<u32>,
    pub(super) depth: Listing<u32>,
    pub(super) masks: Listing<(u32, u32)>,
    pub(super) defects: Listing<u32>,
    /// Components with one class a pixel, which say beside the masks of what nothing is known.
    pub(super) labels: Listing<u32>,
}

impl Pictures {
    /// Lists what `sensor` has.
    ///
    /// # Errors
    /// [`SourceError::Io`] naming the folder that cannot be listed, or that holds no colour pictures.
    pub(super) fn list(sensor: &Sensor) -> Result<Self, SourceError> {
        let mut color = Listing::read(sensor.pictures("rgb"))?;
        if color.is_empty() {
            let gray = Listing::read(sensor.pictures("gray"))?;
            if !gray.is_empty() {
                color = gray;
            }
        }
        if color.is_empty() {
            let path = color.folder().to_owned();
            let source = std::io::Error::new(std::io::ErrorKind::NotFound, "holds no numbered picture, nor does gray/");
            return Err(SourceError::Io { path, source });
        }
        let depth = Listing::read(sensor.pictures("depth"))?;
        let masks = Listing::read(sensor.pictures("mask_visib"))?;
        let [defects, labels] = ["defects", "labels"].map(|kind| Listing::read(sensor.pictures(kind)));
        Ok(Self { color, depth, masks, defects: defects?, labels: labels? })
    }
}

/// `folder/kind/000007.png`.
pub(super) fn path_of(folder: &Path, kind: &str, number: u32) -> PathBuf {
    folder.join(kind).join(format!("{number:06}.png"))
}

/// What the numbers of a scene's depth pictures are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthUnit {
    /// Metres of a whole number 1: `depth_scale`, unless something else is known.
    pub(crate) whole: f64,
    /// Metres of a floating point number 1.
    pub(crate) float: f64,
}

/// A depth picture as it is stored.
#[derive(Clone, Debug)]
pub(crate) struct StoredDepth {
    size: (u32, u32),
    values: Vec<f64>,
    /// The largest number of the type; `None` for floating point numbers.
    largest: Option<f64>,
}

/// Why pixels have no depth, in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unmeasured {
    /// Pixels of value 0.
    zero: usize,
    /// Pixels of the largest value of the type.
    saturated: usize,
    /// Pixels that hold no length.
    no_length: usize,
    /// Pixels of a value that the device does not measure.
    not_of_device: usize,
}

impl fmt::Display for Unmeasured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { zero, saturated, no_length, not_of_device } = self;
        write!(f, "{zero} pixels are 0, {saturated} saturated, {no_length} no length")?;
        if *not_of_device > 0 {
            write!(f, ", {not_of_device} beyond what the depth camera measures")?;
        }
        Ok(())
    }
}

impl StoredDepth {
    /// Reads a depth picture.
    ///
    /// # Errors
    /// [`SourceError`] naming the file.
    pub(crate) fn read(path: &Path) -> Result<Self, SourceError> {
        let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
        if raster::format(path)? == Some(ImageFormat::Tiff) {
            return match raster::read_grey_tiff(path)? {
                Some(GreyTiff { bits: 8, .. }) | None => Err(refuse(
                    "depth is not a grey picture of 16 bits or more, nor one of floating point numbers".into(),
                )),
                Some(GreyTiff { size, values, largest, .. }) => Ok(Self { size, values, largest }),
            };
        }
        match raster::read(path)? {
            DynamicImage::ImageLuma16(picture) => Ok(Self {
                size: picture.dimensions(),
                values: picture.into_raw().into_iter().map(f64::from).collect(),
                largest: Some(u16::MAX.into()),
            }),
            other => Err(refuse(format!("depth is not a 16-bit grey picture but {:?}", other.color()))),
        }
    }

    /// Whether the numbers are floating point numbers.
    pub(crate) fn is_float(&self) -> bool {
        self.largest.is_none()
    }

    /// Median of the numbers that may be lengths, as they are stored.
    pub(crate) fn median(&self) -> Option<f64> {
        let mut values: Vec<f64> = self.values.iter().copied().filter(|v| *v > 0.0 && *v < 1e9).collect();
        values.retain(|v| Some(*v) != self.largest);
        let middle = values.len() / 2;
        (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Depth in metres; what `device` does not measure is missing.
    pub(crate) fn in_metres(&self, unit: DepthUnit, device: Option<&DepthEncoding>) -> (DepthImage, Unmeasured) {
        let metres_per_one = if self.is_float() { unit.float } else { unit.whole };
        let mut unmeasured = Unmeasured::default();
        let metres = |value: &f64| {
            if *value == 0.0 {
                unmeasured.zero += 1;
                return 0.0;
            }
            if self.largest == Some(*value) {
                unmeasured.saturated += 1;
                return 0.0;
            }
            let z = value * metres_per_one;
            if device.is_some_and(|device| z > 0.0 && !device.measures(*value, z as f32)) {
                unmeasured.not_of_device += 1;
                return 0.0;
            }
            // NaN is no length either.
            if z > 0.0 && z < FARTHEST {
                return z as f32;
            }
            unmeasured.no_length += 1;
            0.0
        };
        let metres = self.values.iter().map(metres).collect();
        (DepthImage { width: self.size.0, height: self.size.1, metres }, unmeasured)
    }
}

/// The colour picture of a view.
pub(crate) fn read_color(path: &Path) -> Result<RgbImage, SourceError> {
    raster::read(path).map(DynamicImage::into_rgb8)
}

/// A mask of the size that the colour picture has.
pub(super) fn read_mask(path: &Path, size: (u32, u32)) -> Result<Vec<bool>, SourceError> {
    let mask = mask::read(path)?;
    check_size(path, mask.size, size)?;
    Ok(mask.inside)
}

/// The values of a picture with one class a pixel, in `defects/` or `labels/`.
pub(super) fn read_classes(path: &Path, size: (u32, u32)) -> Result<Vec<u8>, SourceError> {
    let DynamicImage::ImageLuma8(picture) = raster::read(path)? else {
        return Err(SourceError::Format {
            path: path.to_owned(),
            reason: "classes are not an 8-bit grey picture".into(),
        });
    };
    check_size(path, picture.dimensions(), size)?;
    Ok(picture.into_raw())
}

/// Refuses a picture that has another size than the colour picture.
pub(super) fn check_size(path: &Path, found: (u32, u32), (w, h): (u32, u32)) -> Result<(), SourceError> {
    if found == (w, h) {
        return Ok(());
    }
    Err(SourceError::Format {
        path: path.to_owned(),
        reason: format!("{}x{} pixels, but the colour picture has {w}x{h}", found.0, found.1),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_length_is_missing_depth() {
        let unit = DepthUnit { whole: 1e-4, float: 1e-3 };
        let whole = StoredDepth { size: (4, 1), values: vec![0.0, 5000.0, 65535.0, -3.0], largest: Some(65535.0) };
        let (depth, unmeasured) = whole.in_metres(unit, None);
        assert_eq!(depth.metres, [0.0, 0.5, 0.0, 0.0]);
        assert_eq!(unmeasured, Unmeasured { zero: 1, saturated: 1, no_length: 1, not_of_device: 0 });
        assert_eq!(whole.median(), Some(5000.0));
        let values = vec![500.0, f64::NAN, f64::INFINITY, -1.0, 1e10, 65535.0];
        let float = StoredDepth { size: (6, 1), values, largest: None };
        let (depth, unmeasured) = float.in_metres(unit, None);
        assert_eq!(depth.metres, [0.5, 0.0, 0.0, 0.0, 0.0, 65.535]);
        assert_eq!(unmeasured.no_length, 4);
        let device = DepthEncoding::of_device("d435").expect("a device");
        let near = StoredDepth { size: (2, 1), values: vec![50.0, 500.0], largest: Some(65535.0) };
        let (depth, unmeasured) = near.in_metres(DepthUnit { whole: 1e-3, float: 1e-3 }, Some(device));
        assert_eq!((depth.metres.as_slice(), unmeasured.not_of_device), (&[0.0, 0.5][..], 1));
        assert!(unmeasured.to_string().contains("1 beyond what the depth camera measures"), "{unmeasured}");
    }
}
