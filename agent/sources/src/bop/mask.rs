//! Which pixels of a mask picture are inside, however the mask is stored: grey of 1 to 16 bits, colours, a palette, or the
//! alpha channel; TIFF with numbers of any type.
//!
//! Inside is what is not 0. Where colours and alpha channel both vary and say different things, or where no pixel is 0,
//! what is meant cannot be known, and the mask is refused.

use super::raster::{self, GreyTiff};
use image::{DynamicImage, ImageFormat};
use semascan_inspection::source::SourceError;
use std::path::Path;

/// JPEG blurs the border of a mask: inside is the brighter half.
const LOSSY_LIMIT: f32 = 0.5;

/// A mask: columns, rows, and for each pixel whether it is inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mask {
    pub(crate) size: (u32, u32),
    pub(crate) inside: Vec<bool>,
}

/// Reads a mask picture.
///
/// # Errors
/// [`SourceError`] naming the file, if it is no picture or what it means cannot be known.
pub(crate) fn read(path: &Path) -> Result<Mask, SourceError> {
    let refuse = |reason: &str| SourceError::Format { path: path.to_owned(), reason: reason.into() };
    let format = raster::format(path)?;
    if format == Some(ImageFormat::Tiff)
        && let Some(GreyTiff { size, values, .. }) = raster::read_grey_tiff(path)?
    {
        return Ok(Mask { size, inside: values.into_iter().map(|v| v != 0.0).collect() });
    }
    if format == Some(ImageFormat::Png)
        && let Some(palette) = raster::read_palette_png(path)?
    {
        let inside = palette.inside().ok_or_else(|| {
            refuse("a mask with a palette of several colours none of which is black: which is outside cannot be known")
        })?;
        return Ok(Mask { size: palette.size, inside });
    }
    let picture = raster::read(path)?;
    let size = (picture.width(), picture.height());
    if format == Some(ImageFormat::Jpeg) {
        let grey = picture.to_luma32f();
        let inside = grey.as_raw().iter().map(|v| *v > LOSSY_LIMIT).collect();
        return Ok(Mask { size, inside });
    }
    let inside = inside(&picture).map_err(refuse)?;
    Ok(Mask { size, inside })
}

/// The pixels of a decoded picture that are inside, or why that cannot be known.
fn inside(picture: &DynamicImage) -> Result<Vec<bool>, &'static str> {
    // Sixteen bits hold every whole value of the formats that come here, so that a 1 stays a 1.
    let channels = usize::from(picture.color().channel_count());
    let has_alpha = picture.color().has_alpha();
    let values: Vec<u16> = match picture {
        DynamicImage::ImageLuma8(p) => p.as_raw().iter().map(|v| u16::from(*v)).collect(),
        DynamicImage::ImageLumaA8(p) => p.as_raw().iter().map(|v| u16::from(*v)).collect(),
        DynamicImage::ImageRgb8(p) => p.as_raw().iter().map(|v| u16::from(*v)).collect(),
        DynamicImage::ImageRgba8(p) => p.as_raw().iter().map(|v| u16::from(*v)).collect(),
        DynamicImage::ImageLuma16(p) => p.as_raw().clone(),
        DynamicImage::ImageLumaA16(p) => p.as_raw().clone(),
        DynamicImage::ImageRgb16(p) => p.as_raw().clone(),
        DynamicImage::ImageRgba16(p) => p.as_raw().clone(),
        _ => return Err("a mask is a picture of whole numbers, 8 or 16 bits a channel"),
    };
    let pixels = || values.chunks_exact(channels);
    if !has_alpha {
        let inside: Vec<bool> = pixels().map(|p| p.iter().any(|v| *v > 0)).collect();
        let varies = pixels().any(|p| !values.starts_with(p));
        return match varies && inside.iter().all(|i| *i) {
            true => Err("no pixel of the mask is 0, though they differ: which is outside cannot be known"),
            false => Ok(inside),
        };
    }
    let color: Vec<bool> = pixels().map(|p| p[..channels - 1].iter().any(|v| *v > 0)).collect();
    let alpha: Vec<bool> = pixels().map(|p| p[channels - 1] > 0).collect();
    let one_value = |mask: &[bool]| mask.windows(2).all(|w| w[0] == w[1]);
    match (one_value(&color), one_value(&alpha)) {
        (false, true) => Ok(color),
        (true, false) => Ok(alpha),
        // All one: inside only where neither says outside.
        (true, true) => Ok(color.iter().zip(&alpha).map(|(c, a)| *c && *a).collect()),
        (false, false) if color == alpha => Ok(color),
        (false, false) => Err("colours and alpha channel of the mask differ: which of them is meant cannot be known"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};

    fn picture<P: image::Pixel<Subpixel = S> + 'static, S: image::Primitive + 'static>(
        of: impl Fn(bool) -> P,
    ) -> ImageBuffer<P, Vec<S>> {
        ImageBuffer::from_fn(4, 1, |x, _| of(x >= 2))
    }

    #[test]
    fn a_mask_is_the_same_in_every_encoding() {
        let half = Ok(vec![false, false, true, true]);
        let pictures: [DynamicImage; 8] = [
            picture(|i| Luma([u8::from(i)])).into(),
            picture(|i| Luma([u16::from(i)])).into(),
            picture(|i| LumaA([255_u8, u8::from(i) * 255])).into(),
            picture(|i| LumaA([u8::from(i), 255])).into(),
            picture(|i| Rgb([0, 0, u8::from(i)])).into(),
            picture(|i| Rgba([255, 255, 255, u8::from(i)])).into(),
            picture(|i| Rgba([u16::from(i), 0, 0, 65535])).into(),
            picture(|i| Rgba([u8::from(i), 0, 0, u8::from(i)])).into(),
        ];
        for (i, picture) in pictures.iter().enumerate() {
            assert_eq!(inside(picture), half, "{i}");
        }
        let full = picture(|_| Luma([255_u8])).into();
        let empty = picture(|_| Rgba([0_u8, 0, 0, 255])).into();
        assert_eq!((inside(&full), inside(&empty)), (Ok(vec![true; 4]), Ok(vec![false; 4])));
    }

    #[test]
    fn what_cannot_be_known_is_refused() {
        let two = DynamicImage::from(picture(|i| Luma([if i { 255_u8 } else { 128 }])));
        assert!(inside(&two).is_err_and(|e| e.contains("0")));
        let differ = DynamicImage::from(ImageBuffer::from_fn(4, 1, |x, _| {
            Rgba([255 * u8::from(x == 1), 0, 0, 255 * u8::from(x > 1)])
        }));
        assert!(inside(&differ).is_err_and(|e| e.contains("alpha")));
    }
}
