//! Masks as polygons without holes, for formats that know nothing else.
//!
//! The outer border of a connected region (border following [Suzuki 1985]) runs through the centres of its outermost pixels: who
//! fills it and draws its edge has the region's pixels again. A region with holes is cut in two at the middle row of the first
//! one, and so on until no piece has any.

use image::GrayImage;
use imageproc::contours::{BorderType, find_contours};
use imageproc::region_labelling::{Connectivity, connected_components};

/// Corners of a polygon, pixels; (0, 0) is the centre of the first pixel.
pub(super) type Polygon = Vec<[i32; 2]>;

/// The polygons of each connected region of a mask, `width` columns wide and row-major.
pub(super) fn polygons(mask: &[bool], width: usize) -> Vec<Vec<Polygon>> {
    if width == 0 || !mask.contains(&true) {
        return Vec::new();
    }
    let bytes = mask.iter().map(|set| if *set { 255 } else { 0 }).collect();
    let Some(picture) = GrayImage::from_raw(width as u32, (mask.len() / width) as u32, bytes) else {
        return Vec::new();
    };
    regions(&picture, [0, 0])
        .into_iter()
        .map(|(region, corner)| {
            let mut pieces = Vec::new();
            without_holes(&region, corner, &mut pieces);
            pieces
        })
        .collect()
}

/// Each connected region of a mask as a mask of its own.
pub(super) fn connected(mask: &[bool], width: usize) -> Vec<Vec<bool>> {
    if width == 0 || !mask.contains(&true) {
        return Vec::new();
    }
    let bytes = mask.iter().map(|set| if *set { 255 } else { 0 }).collect();
    let Some(picture) = GrayImage::from_raw(width as u32, (mask.len() / width) as u32, bytes) else {
        return Vec::new();
    };
    let numbers = connected_components(&picture, Connectivity::Eight, image::Luma([0]));
    let count = numbers.pixels().map(|pixel| pixel.0[0]).max().unwrap_or(0);
    (1..=count).map(|number| numbers.pixels().map(|pixel| pixel.0[0] == number).collect()).collect()
}

/// Each connected region (through edges and corners) in a picture of its own with an empty rim, without which border following
/// finds no border there, and where the corner of the picture lies.
fn regions(picture: &GrayImage, [left, top]: [i32; 2]) -> Vec<(GrayImage, [i32; 2])> {
    let numbers = connected_components(picture, Connectivity::Eight, image::Luma([0]));
    let count = numbers.pixels().map(|pixel| pixel.0[0]).max().unwrap_or(0) as usize;
    let mut boxes = vec![[u32::MAX, u32::MAX, 0, 0]; count];
    for (x, y, pixel) in numbers.enumerate_pixels() {
        if let Some(extent) = (pixel.0[0] as usize).checked_sub(1).and_then(|place| boxes.get_mut(place)) {
            *extent = [extent[0].min(x), extent[1].min(y), extent[2].max(x), extent[3].max(y)];
        }
    }
    let region = |(number, [x0, y0, x1, y1]): (u32, [u32; 4])| {
        let own = GrayImage::from_fn(x1 - x0 + 3, y1 - y0 + 3, |x, y| {
            let is_inside = (1..x1 - x0 + 2).contains(&x) && (1..y1 - y0 + 2).contains(&y);
            let is_own = is_inside && numbers.get_pixel(x0 + x - 1, y0 + y - 1).0[0] == number;
            image::Luma([if is_own { 255 } else { 0 }])
        });
        (own, [left + x0 as i32 - 1, top + y0 as i32 - 1])
    };
    (1..).zip(boxes).map(region).collect()
}

/// Adds the polygons of one connected region.
fn without_holes(region: &GrayImage, corner: [i32; 2], pieces: &mut Vec<Polygon>) {
    let contours = find_contours::<i32>(region);
    let hole = contours.iter().find(|contour| contour.border_type == BorderType::Hole);
    let rows = hole.and_then(|hole| {
        let rows = || hole.points.iter().map(|point| point.y);
        Some((rows().min()?, rows().max()?))
    });
    let Some((first, last)) = rows else {
        let outer = contours.iter().filter(|contour| contour.border_type == BorderType::Outer);
        pieces.extend(outer.map(|contour| {
            let points: Vec<[i32; 2]> = contour.points.iter().map(|p| [p.x + corner[0], p.y + corner[1]]).collect();
            corners(&points)
        }));
        return;
    };
    let cut = ((first + last) / 2) as u32 + 1;
    let (width, height) = region.dimensions();
    for (from, rows) in [(0, cut), (cut, height - cut)] {
        let piece = image::imageops::crop_imm(region, 0, from, width, rows).to_image();
        for (own, at) in regions(&piece, [corner[0], corner[1] + from as i32]) {
            without_holes(&own, at, pieces);
        }
    }
}

/// The points at which a closed curve turns; three of them at least, so that every reader takes them for a polygon.
fn corners(points: &[[i32; 2]]) -> Polygon {
    let n = points.len();
    let turns = |i: &usize| {
        let (a, b, c) = (points[(i + n - 1) % n], points[*i], points[(i + 1) % n]);
        [b[0] - a[0], b[1] - a[1]] != [c[0] - b[0], c[1] - b[1]]
    };
    let mut polygon: Polygon = (0..n).filter(turns).map(|i| points[i]).collect();
    while polygon.len() < 3 {
        polygon.push(polygon.last().copied().unwrap_or(points[0]));
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;
    use imageproc::drawing::draw_polygon_mut;
    use imageproc::point::Point;
    use proptest::prelude::*;

    /// Fills polygons with their edges, as the training code's reader does.
    fn filled(pieces: &[Polygon], (width, height): (usize, usize)) -> Vec<bool> {
        let mut picture = GrayImage::new(width as u32, height as u32);
        let white = image::Luma([255]);
        for piece in pieces {
            let mut points: Vec<Point<i32>> = piece.iter().map(|p| Point::new(p[0], p[1])).collect();
            points.dedup();
            if points.len() > 1 && points.first() == points.last() {
                points.pop();
            }
            match points.as_slice() {
                [one] => picture.put_pixel(one.x as u32, one.y as u32, white),
                [a, b] => {
                    let at = |p: &Point<i32>| (p.x as f32, p.y as f32);
                    imageproc::drawing::draw_line_segment_mut(&mut picture, at(a), at(b), white);
                }
                all => draw_polygon_mut(&mut picture, all, white),
            }
        }
        picture.pixels().map(|pixel| pixel.0[0] > 0).collect()
    }

    #[test]
    fn a_ring_is_cut_into_pieces_that_leave_its_hole() {
        let inside = |x: i32, y: i32| (x - 10).pow(2) + (y - 10).pow(2);
        let mask: Vec<bool> = (0..400).map(|at| (16..80).contains(&inside(at % 20, at / 20))).collect();
        let found = polygons(&mask, 20);
        assert_eq!((found.len(), found[0].len()), (1, 2));
        assert_eq!(filled(&found[0], (20, 20)), mask);
        assert!(polygons(&[false; 12], 4).is_empty());
        let dot: Vec<bool> = (0..12).map(|at| at == 6).collect();
        assert_eq!(polygons(&dot, 4), [[[[2, 1]; 3].to_vec()]]);
    }

    proptest! {
        #[test]
        fn the_polygons_of_any_mask_fill_it_again(bits in prop::collection::vec(0..4_u8, 15 * 11)) {
            let mask: Vec<bool> = bits.iter().map(|bit| *bit > 0).collect();
            let pieces: Vec<Polygon> = polygons(&mask, 15).into_iter().flatten().collect();
            prop_assert_eq!(filled(&pieces, (15, 11)), mask);
        }
    }
}
