//! Small pictures of a view for the viewer's strip: the colour image, and what is laid over it: component classes and how
//! uncertain they are.

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
/// Sigma that is drawn opaque.
const SIGMA_TOP: f32 = 0.5;
/// Share of that below which nothing is drawn.
const FAINTEST: f32 = 0.06;

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
    picture(view, |i| {
        let class = usize::from(segmentation.components.best(i));
        let known = taxonomy.components.get(class).filter(|_| class > 0)?;
        Some([known.color[0], known.color[1], known.color[2], ALPHA])
    })
}

/// Uncertainty of the component labels as a small PNG, the more opaque the less certain; empty if all are certain.
pub(super) fn sigma_overlay(view: &View, segmentation: &Segmentation) -> Vec<u8> {
    picture(view, |i| {
        let share = (segmentation.components.sigma(i) / SIGMA_TOP).min(1.0);
        let fire = [255.0, 220.0 * share, 40.0 * share].map(|c| c as u8);
        (share > FAINTEST).then(|| [fire[0], fire[1], fire[2], (255.0 * share) as u8])
    })
}

/// Where a two-stream network went by colour (warm) and where by depth (cool), P2's contribution map; empty without one.
pub(super) fn contribution_overlay(view: &View, segmentation: &Segmentation) -> Vec<u8> {
    let Some(detail) = &segmentation.network else { return Vec::new() };
    let Some((shares, window)) = detail.contribution.as_ref().zip(detail.window) else { return Vec::new() };
    picture(view, |i| {
        let inside = window.holds(i as u32 % view.rgb.width(), i as u32 / view.rgb.width());
        let share = f32::from(*shares.get(i).filter(|_| inside)?) / 255.0;
        let mix = |depth: f32, colour: f32| (depth + (colour - depth) * share) as u8;
        Some([mix(40.0, 250.0), mix(130.0, 160.0), mix(230.0, 40.0), ALPHA])
    })
}

/// A small PNG of `color` (red, green, blue, opacity) by pixel of the view; empty if no pixel has one.
fn picture(view: &View, color: impl Fn(usize) -> Option<[u8; 4]>) -> Vec<u8> {
    let (width, height) = view.rgb.dimensions();
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let (columns, rows) = (WIDTH, height_for(width, height));
    let mut any = false;
    let picture = RgbaImage::from_fn(columns, rows, |x, y| {
        let (u, v) = (x * width / columns, y * height / rows);
        let color = color((v * width + u) as usize);
        any |= color.is_some();
        Rgba(color.unwrap_or([0; 4]))
    });
    let mut bytes = Cursor::new(Vec::new());
    if any && picture.write_to(&mut bytes, ImageFormat::Png).is_ok() { bytes.into_inner() } else { Vec::new() }
}
