//! Small pictures of a view for the viewer's strip: the colour image, and the component classes over it.

use crate::acquire::View;
use crate::segment::Segmentation;
use image::codecs::jpeg::JpegEncoder;
use image::{ImageFormat, RgbImage, Rgba, RgbaImage, imageops};
use semascan_shared::model::Taxonomy;
use std::io::Cursor;

/// Width of a thumbnail in pixels.
const WIDTH: u32 = 192;
const JPEG_QUALITY: u8 = 80;
/// Opacity of the class colours.
const ALPHA: u8 = 140;

fn height_for(width: u32, height: u32) -> u32 {
    (height * WIDTH / width.max(1)).clamp(1, 4 * WIDTH)
}

/// The picture as a small JPEG; empty if it cannot be encoded (an empty picture).
pub(super) fn thumbnail(rgb: &RgbImage) -> Vec<u8> {
    let small = imageops::thumbnail(rgb, WIDTH, height_for(rgb.width(), rgb.height()));
    let mut bytes = Vec::new();
    match JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(&small) {
        Ok(()) => bytes,
        Err(_) => Vec::new(),
    }
}

/// Component classes of a view as a small PNG, transparent where there are none; empty if there are none at all.
pub(super) fn overlay(view: &View, segmentation: &Segmentation, taxonomy: &Taxonomy) -> Vec<u8> {
    let (width, height) = view.rgb.dimensions();
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let (columns, rows) = (WIDTH, height_for(width, height));
    let mut any = false;
    let picture = RgbaImage::from_fn(columns, rows, |x, y| {
        let (u, v) = (x * width / columns, y * height / rows);
        let class = usize::from(segmentation.components.best((v * width + u) as usize));
        match taxonomy.components.get(class) {
            Some(c) if class > 0 => {
                any = true;
                Rgba([c.color[0], c.color[1], c.color[2], ALPHA])
            }
            _ => Rgba([0; 4]),
        }
    });
    let mut bytes = Cursor::new(Vec::new());
    if any && picture.write_to(&mut bytes, ImageFormat::Png).is_ok() { bytes.into_inner() } else { Vec::new() }
}
