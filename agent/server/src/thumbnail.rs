//! Small pictures of a view for the viewer's strip: the colour image, and what is laid over it: component classes, how
//! uncertain they are, and what colour and depth contributed.

use image::codecs::jpeg::JpegEncoder;
use image::{ImageFormat, RgbImage, Rgba, RgbaImage, imageops};
use semascan_model::Taxonomy;
use semascan_perception::segment::Segmentation;
use semascan_perception::view::View;
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

/// Share of the colour stream of a two-stream network as a small PNG where the network looked: orange where colour
/// decides, blue where depth does ([Wang 2023], contribution layer); empty for other networks.
pub(super) fn contribution_overlay(view: &View, segmentation: &Segmentation) -> Vec<u8> {
    let detail = segmentation.network.as_deref();
    let Some((share, window)) = detail.and_then(|d| d.contribution.as_ref().zip(d.window)) else { return Vec::new() };
    let width = view.rgb.width().max(1);
    picture(view, |i| {
        let (u, v) = (i as u32 % width, i as u32 / width);
        let t = f32::from(*share.get(i).filter(|_| window.contains(u, v))?) / 255.0;
        let mix = |depth: f32, color: f32| (depth + t * (color - depth)) as u8;
        Some([mix(40.0, 240.0), mix(120.0, 150.0), mix(220.0, 20.0), ALPHA])
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

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_perception::segment::ClassField;
    use semascan_perception::segment::network::{ViewDetail, Window};
    use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence};
    use std::sync::Arc;

    #[test]
    fn contributions_are_drawn_where_the_network_looked_and_nowhere_without_two_streams() {
        let (width, height) = (192, 96);
        let pixels = (width * height) as usize;
        let view = View {
            index: 0,
            stamp: None,
            intrinsics: Intrinsics { width, height, fx: 100.0, fy: 100.0, cx: 96.0, cy: 48.0 },
            rgb: Arc::new(RgbImage::new(width, height)),
            depth: Arc::new(DepthImage { width, height, metres: vec![0.0; pixels] }),
            pose: PoseEvidence::None,
            labels: None,
            truth: None,
        };
        let detail = ViewDetail {
            window: Some(Window { left: 96, top: 0, width: 96, height: 96 }),
            contribution: Some((0..pixels).map(|i| if i / 192 < 48 { 255 } else { 0 }).collect()),
            ..ViewDetail::default()
        };
        let hard = ClassField::Hard(vec![0; pixels]);
        let mut segmentation = Segmentation {
            components: hard.clone(),
            defects: hard,
            instances: vec![0; pixels],
            network: Some(Arc::new(detail)),
        };
        let png = image::load_from_memory(&contribution_overlay(&view, &segmentation)).expect("a picture").to_rgba8();
        let at = |x: u32, y: u32| png.get_pixel(x, y).0;
        assert_eq!(at(10, 10)[3], 0, "outside the window");
        let (colour, depth) = (at(150, 10), at(150, 80));
        assert!(colour[3] > 0 && colour[0] > colour[2], "{colour:?}");
        assert!(depth[3] > 0 && depth[2] > depth[0], "{depth:?}");
        segmentation.network = None;
        assert!(contribution_overlay(&view, &segmentation).is_empty());
    }
}
