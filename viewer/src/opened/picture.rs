//! Pictures on the surface of an opened model: what they show at its vertices becomes the colours of these.

use semascan_formats::{Geometry, Piece};

/// Most times that a picture is halved for vertices far apart: more would mix what lies beside each other in it.
const MOST_HALVINGS: u32 = 3;
/// Triangles that are looked at to find out how far apart vertices lie.
const SAMPLE: usize = 10_000;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns and rows.
    size: [usize; 2],
    /// sRGB of each pixel, row by row from the top.
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of pixels with four channels, row by row from the top; `None` if they are too few.
    pub fn new(width: u32, height: u32, rgba: &[u8]) -> Option<Self> {
        let size = [width as usize, height as usize];
        let pixels: Vec<[u8; 3]> = rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        let count = size[0].checked_mul(size[1]).filter(|count| *count > 0)?;
        (pixels.len() == count).then_some(Self { size, pixels })
    }

    /// The colour at a place, v upwards; beyond its edges the picture repeats.
    fn at(&self, [u, v]: [f32; 2]) -> [u8; 3] {
        // On an edge, which is the end of the picture and not its beginning.
        let within = |share: f32| if (0.0..=1.0).contains(&share) { share } else { share.rem_euclid(1.0) };
        let index = |share: f32, count: usize| ((within(share) * count as f32) as usize).min(count - 1);
        let (column, row) = (index(u, self.size[0]), index(1.0 - v, self.size[1]));
        self.pixels.get(row * self.size[0] + column).copied().unwrap_or_default()
    }

    /// The same at half its size: each pixel is the mean of four.
    fn halved(&self) -> Self {
        let [width, height] = self.size.map(|count| (count / 2).max(1));
        let mean = |k: usize| {
            let (column, row) = (k % width, k / width);
            let mut sum = [0_u32; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = ((2 * column + dx).min(self.size[0] - 1), (2 * row + dy).min(self.size[1] - 1));
                let pixel = self.pixels.get(y * self.size[0] + x).copied().unwrap_or_default();
                (0..3).for_each(|channel| sum[channel] += u32::from(pixel[channel]));
            }
            sum.map(|channel| (channel / 4) as u8)
        };
        Self { size: [width, height], pixels: (0..width * height).map(mean).collect() }
    }
}

/// Linear colours of the vertices of a geometry, as its pictures and what colours them have it; none where it has no picture.
///
/// * `pictures`: those of [`Geometry::textures`], where they could be decoded.
pub(super) fn colors(geometry: &Geometry, pictures: &[Option<Picture>]) -> Option<Vec<Option<[f32; 3]>>> {
    let of_piece = |piece: &Piece| pictures.get(piece.texture?.index)?.as_ref();
    if !geometry.pieces.iter().any(|piece| of_piece(piece).is_some()) {
        return None;
    }
    // A vertex on a seam has more than one place in its pictures.
    let mut sums = vec![([0.0_f32; 3], 0_u32); geometry.positions.len()];
    for piece in &geometry.pieces {
        let Some(picture) = of_piece(piece) else { continue };
        let (Some(triangles), Some(places)) = (
            geometry.triangles.get(piece.triangles.clone()),
            geometry.texture_coordinates.get(piece.triangles.clone()),
        ) else {
            continue;
        };
        let picture = for_vertices(picture, places);
        let is_tinted = piece.texture.is_some_and(|texture| texture.tinted);
        let tint = piece.base_color.filter(|_| is_tinted).unwrap_or([1.0; 3]);
        for (vertex, place) in triangles.iter().flatten().zip(places.iter().flatten()) {
            let vertex = *vertex as usize;
            let own = geometry.colors.get(vertex).filter(|_| is_tinted).copied().unwrap_or([1.0; 3]);
            let color = picture.at(*place).map(linear);
            if let Some((sum, count)) = sums.get_mut(vertex) {
                (0..3).for_each(|channel| sum[channel] += color[channel] * tint[channel] * own[channel]);
                *count += 1;
            }
        }
    }
    Some(sums.into_iter().map(|(sum, count)| (count > 0).then(|| sum.map(|c| c / count as f32))).collect())
}

/// The picture as coarse as the vertices that show it: of a finer one they would show single pixels.
fn for_vertices(picture: &Picture, places: &[[[f32; 2]; 3]]) -> Picture {
    let size = picture.size.map(|count| count as f32);
    let step = places.len().div_ceil(SAMPLE).max(1);
    let edges = places.iter().step_by(step).map(|[a, b, _]| ((a[0] - b[0]) * size[0]).hypot((a[1] - b[1]) * size[1]));
    let (count, sum) = edges.filter(|edge| edge.is_finite()).fold((0, 0.0), |(n, sum), edge| (n + 1, sum + edge));
    let pixels = sum / (count.max(1) as f32);
    let halvings = (pixels.max(1.0).log2() as u32).min(MOST_HALVINGS);
    (0..halvings).fold(picture.clone(), |picture, _| picture.halved())
}

/// Linear light of a stored level (sRGB), 0..=1.
fn linear(level: u8) -> f32 {
    let share = f32::from(level) / 255.0;
    if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;

    /// Red and green above blue and white.
    fn picture() -> Picture {
        let rgba = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 0]];
        Picture::new(2, 2, rgba.as_flattened()).expect("four pixels")
    }

    #[test]
    fn v_runs_upwards_and_edges_are_the_end_of_the_picture() {
        let picture = picture();
        assert_eq!(picture.at([0.0, 1.0]), [255, 0, 0]);
        assert_eq!(picture.at([1.0, 1.0]), [0, 255, 0]);
        assert_eq!(picture.at([0.0, 0.0]), [0, 0, 255]);
        assert_eq!(picture.at([1.0, 0.0]), [255; 3]);
        assert_eq!((picture.at([1.25, 0.9]), picture.at([-0.25, 2.9])), ([255, 0, 0], [0, 255, 0]));
        assert_eq!(picture.at([f32::NAN, f32::INFINITY]), picture.at([f32::NAN, f32::INFINITY]), "and no panic");
        assert_eq!(picture.halved().pixels, [[127; 3]]);
        assert_eq!((Picture::new(2, 2, &[0; 12]), Picture::new(0, 2, &[])), (None, None));
    }

    #[test]
    fn vertices_far_apart_show_the_mean_around_them() {
        let stripes: Vec<u8> = (0..16 * 16).flat_map(|k| [if k % 2 == 0 { 255 } else { 0 }; 4]).collect();
        let picture = Picture::new(16, 16, &stripes).expect("a picture");
        let far = for_vertices(&picture, &[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
        assert_eq!((far.size, far.at([0.4, 0.4])), ([2, 2], [127; 3]));
        let near = for_vertices(&picture, &[[[0.0, 0.0], [0.06, 0.0], [0.0, 0.06]]]);
        assert_eq!(near, picture);
    }
}
