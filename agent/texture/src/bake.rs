//! Texels of charts from their photographs: each is the colour at the place where its point of the surface lies in the photograph,
//! the mean over as many pixels as it covers.

use crate::charts::{Chart, PADDING};
use crate::photograph::{Colors, Photograph, project};
use crate::surface::Surface;
use crate::texels::for_each_texel;
use image::{Rgba, RgbaImage};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Alpha of a texel that has a colour of a photograph; others have 0.
const SEEN: u8 = 255;

/// The texels of a chart, its padding included.
pub(crate) type Tile = RgbaImage;

/// The texels of `chart`, uncorrected and without those around it.
pub(crate) fn bake(surface: &Surface, chart: &Chart, photograph: &Photograph<'_>, texel: f64) -> Tile {
    let size = chart.size(texel);
    let mut tile = Tile::new(size.0, size.1);
    let camera_from_table = photograph.table_from_camera.inverse();
    let colors = Colors::of(&photograph.rgb);
    let edge = 1.0 / chart.scale(texel);
    for face in &chart.faces {
        let Some((corners, places)) = chart.corners(surface, *face) else { continue };
        for_each_texel(corners.map(|local| chart.texel(local, texel)), size, |x, y, weights| {
            let place: Vector3<f64> = (0..3).map(|k| places[k].coords * weights[k]).sum();
            let place = project(&photograph.intrinsics, &camera_from_table, &Point3::from(place));
            let Some((u, v, _)) = place else { return };
            let [r, g, b] = colors.around(u, v, edge).map(level);
            tile.put_pixel(x, y, Rgba([r, g, b, SEEN]));
        });
    }
    tile
}

/// Adds to the texels of a tile what the corrections of the chart's nodes are there.
pub(crate) fn correct(tile: &mut Tile, surface: &Surface, chart: &Chart, corrections: &[[f32; 3]], texel: f64) {
    let size = tile.dimensions();
    // Texels on the common side of two faces belong to both: each is corrected once.
    let mut is_done = vec![false; size.0 as usize * size.1 as usize];
    for face in &chart.faces {
        let Some((corners, _)) = chart.corners(surface, *face) else { continue };
        let of_corners = corners.map(|local| corrections.get(chart.first_node + local).copied().unwrap_or([0.0; 3]));
        for_each_texel(corners.map(|local| chart.texel(local, texel)), size, |x, y, weights| {
            let done = &mut is_done[y as usize * size.0 as usize + x as usize];
            if std::mem::replace(done, true) {
                return;
            }
            let Rgba([r, g, b, _]) = tile.get_pixel_mut(x, y);
            for (channel, value) in [r, g, b].into_iter().enumerate() {
                let correction: f32 = (0..3).map(|k| weights[k] as f32 * of_corners[k][channel]).sum();
                *value = level(f32::from(*value) + correction);
            }
        });
    }
}

/// Gives texels around the chart the colours of its rim, as far as its padding reaches. Texels of the rim whose middle lies beside
/// the chart come first: hence two rounds more.
pub(crate) fn pad(tile: &mut Tile) {
    let (width, height) = tile.dimensions();
    for _ in 0..PADDING + 2 {
        let before = tile.clone();
        let rows = tile.as_flat_samples_mut().samples.par_chunks_mut(4 * width.max(1) as usize).enumerate();
        rows.for_each(|(y, row)| {
            let y = y as u32;
            for (x, texel) in (0..width).zip(row.chunks_exact_mut(4)) {
                if texel[3] == SEEN {
                    continue;
                }
                let (mut sum, mut count) = ([0_u32; 3], 0);
                for beside_y in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                    for beside_x in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                        let beside = before.get_pixel(beside_x, beside_y).0;
                        if beside[3] == SEEN {
                            sum = [0, 1, 2].map(|k| sum[k] + u32::from(beside[k]));
                            count += 1;
                        }
                    }
                }
                if count > 0 {
                    let [r, g, b] = sum.map(|s| ((s + count / 2) / count) as u8);
                    texel.copy_from_slice(&[r, g, b, SEEN]);
                }
            }
        });
    }
}

fn level(value: f32) -> u8 {
    (value.clamp(0.0, 255.0) + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{ChartCamera, charts};
    use crate::fixtures::{camera_above, quad};
    use semascan_model::SemanticMesh;

    /// Red grows with x and green with y, 1 level a millimetre.
    fn ramp(x: f64, y: f64) -> [u8; 3] {
        [(128.0 + 1e3 * x).round() as u8, (128.0 + 1e3 * y).round() as u8, 50]
    }

    #[test]
    fn texels_have_the_colors_of_their_places_corrected_and_repeated_around() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.05, -0.03], [0.05, 0.03], 0.0);
        let surface = Surface::of(&mesh);
        let photograph = camera_above([0.01, 0.0], 0.4, ramp);
        let camera = ChartCamera { intrinsics: photograph.intrinsics, table_from_camera: photograph.table_from_camera };
        let charts = charts(&surface, &vec![Some(0); surface.faces.len()], |_| Some(camera));
        for texel in [0.4e-3, 1e-3, 3e-3] {
            let mut tile = bake(&surface, &charts[0], &photograph, texel);
            let corrections = vec![[10.0, 0.0, -60.0]; charts[0].vertices.len()];
            correct(&mut tile, &surface, &charts[0], &corrections, texel);
            let (width, height) = tile.dimensions();
            let (mut seen, mut worst) = (0, 0.0_f64);
            for (x, y, pixel) in tile.enumerate_pixels() {
                if pixel.0[3] == 0 {
                    continue;
                }
                seen += 1;
                // The picture's rows run against y.
                let along = |p: u32| f64::from(p) - f64::from(PADDING);
                let place = [-0.05 + along(x) * texel, 0.03 - along(y) * texel];
                let expected = ramp(place[0], place[1]);
                worst = worst.max((f64::from(pixel.0[0]) - f64::from(expected[0]) - 10.0).abs());
                worst = worst.max((f64::from(pixel.0[1]) - f64::from(expected[1])).abs());
                assert_eq!(pixel.0[2], 0);
            }
            assert!(worst <= 2.0, "{worst} levels at {texel} m");
            let inner = f64::from(width - 2 * PADDING) * f64::from(height - 2 * PADDING);
            assert!(f64::from(seen) > 0.8 * inner, "{seen} of {inner}");
            pad(&mut tile);
            assert!(tile.pixels().all(|pixel| pixel.0[3] == SEEN), "a rectangle's padding is whole");
            let rim = tile.get_pixel(PADDING, height / 2).0;
            assert_eq!(tile.get_pixel(0, height / 2).0[0], rim[0]);
        }
    }
}
