//! A mesh with a texture, and the figures of that.

use crate::charts::Chart;
use crate::surface::Surface;
use image::RgbaImage;
use semascan_model::SemanticMesh;

/// A mesh with a texture.
#[derive(Clone, Debug)]
pub struct TexturedMesh {
    /// The mesh. Vertices at seams stand once for each chart, all their columns alike.
    pub mesh: SemanticMesh,
    /// Where each vertex lies in the atlas, 0..=1, rows downwards as in glTF.
    pub places: Vec<[f32; 2]>,
    /// The texels, sRGB. Alpha is 0 where no photograph shows the surface, and beside the charts.
    pub atlas: RgbaImage,
    /// What it is.
    pub figures: TextureFigures,
}

/// What a texture is.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureFigures {
    /// Length of a texel on the surface, metres.
    pub texel: f64,
    /// Whether it had to be longer than wanted to fit.
    pub is_coarser: bool,
    /// Length of the photographs' pixels on the surface where they face it, metres, the median over the surface.
    pub pixel: f64,
    /// Charts.
    pub charts: usize,
    /// Photographs that the texture is made of.
    pub photographs: usize,
    /// Photographs that could not be used, with the reason.
    pub left_out: Vec<String>,
    /// Faces that no photograph shows, and all.
    pub unseen_faces: usize,
    /// All faces.
    pub faces: usize,
    /// Share of the area that no photograph shows, 0..=1.
    pub unseen: f64,
}

impl TexturedMesh {
    /// The atlas as PNG, which says in its head what wrote it.
    ///
    /// # Errors
    /// [`png::EncodingError`] if it has no texels.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.atlas.width(), self.atlas.height());
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.add_text_chunk("Software".into(), concat!("semascan ", env!("CARGO_PKG_VERSION")).into())?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.atlas.as_raw())?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Whether a photograph shows the surface at a place of the atlas.
    pub fn is_seen_at(&self, [u, v]: [f32; 2]) -> bool {
        let inside = |share: f32, size: u32| ((share.max(0.0) * size as f32) as u32).min(size.saturating_sub(1));
        let texel = self.atlas.get_pixel_checked(inside(u, self.atlas.width()), inside(v, self.atlas.height()));
        texel.is_some_and(|texel| texel.0[3] > 0)
    }

    /// The colour at a place of the atlas, between texels, sRGB levels.
    pub fn color_at(&self, [u, v]: [f32; 2]) -> [f32; 3] {
        let (width, height) = self.atlas.dimensions();
        let (x, y) = (f64::from(u) * f64::from(width) - 0.5, f64::from(v) * f64::from(height) - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let at = |dx: u32, dy: u32| {
            let inside = |c: f64, size: u32| (c.max(0.0) as u32).min(size.saturating_sub(1));
            let texel =
                self.atlas.get_pixel_checked(inside(left + f64::from(dx), width), inside(top + f64::from(dy), height));
            texel.map_or([0.0; 3], |texel| [0, 1, 2].map(|k| f32::from(texel.0[k])))
        };
        let mix = |a: [f32; 3], b: [f32; 3], share: f64| [0, 1, 2].map(|k| a[k] + share as f32 * (b[k] - a[k]));
        mix(mix(at(0, 0), at(1, 0), x - left), mix(at(0, 1), at(1, 1), x - left), y - top)
    }
}

/// Lengths of a texel as it is and as it was wanted, and of the photographs' pixels.
pub(crate) struct Lengths {
    pub(crate) texel: f64,
    pub(crate) wanted: f64,
    pub(crate) pixel: f64,
}

pub(crate) fn figures(
    surface: &Surface,
    charts: &[Chart],
    photographs: usize,
    left_out: Vec<String>,
    Lengths { texel, wanted, pixel }: Lengths,
) -> TextureFigures {
    let faces = surface.faces.len();
    let seen = || charts.iter().flat_map(|chart| &chart.faces);
    let area: f64 = surface.areas.iter().sum();
    let seen_area: f64 = seen().map(|face| surface.areas[*face]).sum();
    TextureFigures {
        texel,
        is_coarser: texel > wanted,
        pixel,
        charts: charts.len(),
        photographs,
        left_out,
        unseen_faces: faces - seen().count(),
        faces,
        unseen: if area > 0.0 { (1.0 - seen_area / area).clamp(0.0, 1.0) } else { 1.0 },
    }
}
