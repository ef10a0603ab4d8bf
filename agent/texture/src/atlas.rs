//! The atlas with all charts, and what marks places that no photograph shows.

use crate::bake::Tile;
use crate::pack::Packing;
use image::{Rgba, RgbaImage};

/// The colour, sRGB, of what no photograph shows. Its alpha is 0, whatever shows the texture without it.
pub const UNSEEN_COLOR: [u8; 3] = [128; 3];
/// Edge of the square in the atlas that faces lie in which no photograph shows.
pub(crate) const UNSEEN_EDGE: u32 = 16;

/// The tiles at their places.
pub(crate) fn compose(packing: &Packing, tiles: &[Tile]) -> RgbaImage {
    let [r, g, b] = UNSEEN_COLOR;
    let mut atlas = RgbaImage::from_pixel(packing.width, packing.height, Rgba([r, g, b, 0]));
    for (tile, [left, top]) in tiles.iter().zip(&packing.places) {
        for (x, y, texel) in tile.enumerate_pixels().filter(|(.., texel)| texel.0[3] > 0) {
            atlas.put_pixel(left + x, top + y, *texel);
        }
    }
    atlas
}
