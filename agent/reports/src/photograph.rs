//! Photographs of findings: the part of a view's picture that shows one, with the outline as that view sees it.
//!
//! The outline is projected with the view's pose. A piece of it is drawn where nothing was measured before it, dashed where the
//! view has no depth, and left out where something stood before it: a photograph claims nothing that the view did not see.

use image::{RgbImage, imageops};
use nalgebra::{Isometry3, Point3};
use semascan_model::finding::{FindingView, PixelBox};
use semascan_perception::view::Intrinsics;
use std::borrow::Cow;
use std::fmt::Write;
use std::sync::Arc;

/// Pixels between two points of a projected outline.
const STEP: f64 = 2.0;
/// Most points of one side.
const MOST_POINTS: f64 = 2000.0;
/// Room around a finding, as a share of its size.
const MARGIN: f64 = 0.6;
/// Least edge of a photograph, pixels.
const LEAST_EDGE: f64 = 120.0;
/// Share of a projected outline that must agree with the depth, among what has any.
const LEAST_AGREEMENT: f64 = 0.25;

/// A view's pictures, camera and pose.
#[derive(Clone, Debug)]
pub struct ViewPicture<'a> {
    /// Colour.
    pub rgb: Arc<RgbImage>,
    /// Depth in metres, row-major; 0 where nothing was measured.
    pub depth: Cow<'a, [f32]>,
    /// The camera, for both.
    pub intrinsics: Intrinsics,
    /// Where it stood when the model was made.
    pub table_from_camera: Isometry3<f64>,
}

/// A photograph of a finding.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// Position of the view in the capture order.
    pub view: u32,
    /// The part of the view's picture.
    pub crop: PixelBox,
    /// JPEG.
    pub jpeg: Vec<u8>,
    /// SVG paths of the outline in pixels of `crop`.
    pub outline: ProjectedOutline,
}

/// An outline in a picture, as SVG path data.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProjectedOutline {
    /// What was seen.
    pub seen: String,
    /// Where the view measured no depth: whether something stands before it is not known.
    pub unmeasured: String,
    /// Whether the pose and the depth of the view do not agree with the outline, which is then not drawn.
    pub contradicted: bool,
}

/// The photograph of a finding with `outlines` (table frame, metres) by `view`, of which `picture` are the pictures. Depths up to
/// `tolerance` metres before a point do not hide it. `None` where the finding's box lies outside of the picture.
pub fn photograph(
    picture: &ViewPicture<'_>,
    view: &FindingView,
    outlines: &[Vec<[f64; 3]>],
    tolerance: f64,
    quality: u8,
) -> Option<Photograph> {
    let (width, height) = picture.rgb.dimensions();
    let crop = crop(&view.pixels, (width, height))?;
    let part = imageops::crop_imm(picture.rgb.as_ref(), crop.left, crop.top, crop.width, crop.height).to_image();
    let jpeg = super::pictures::jpeg(&part, quality)?;
    let outline = projected(picture, outlines, &crop, tolerance);
    Some(Photograph { view: view.view, crop, jpeg, outline })
}

/// The box around a finding with some of its surroundings, 4 : 3, inside of the picture.
fn crop(pixels: &PixelBox, (width, height): (u32, u32)) -> Option<PixelBox> {
    if pixels.left >= width || pixels.top >= height || pixels.width == 0 || pixels.height == 0 {
        return None;
    }
    let (w, h) = (f64::from(pixels.width.min(width)), f64::from(pixels.height.min(height)));
    let across = ((1.0 + 2.0 * MARGIN) * w).max((1.0 + 2.0 * MARGIN) * h * 4.0 / 3.0).max(LEAST_EDGE);
    let size = [across, across * 3.0 / 4.0];
    let centre = [f64::from(pixels.left) + w / 2.0, f64::from(pixels.top) + h / 2.0];
    let fit = |axis: usize, whole: u32| {
        let size = size[axis].round().min(f64::from(whole));
        let first = (centre[axis] - size / 2.0).round().clamp(0.0, f64::from(whole) - size);
        (first as u32, size as u32)
    };
    let ((left, width), (top, height)) = (fit(0, width), fit(1, height));
    Some(PixelBox { left, top, width, height })
}

/// How a point of an outline is seen.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    Yes,
    Unmeasured,
    Hidden,
}

fn projected(
    picture: &ViewPicture<'_>,
    outlines: &[Vec<[f64; 3]>],
    crop: &PixelBox,
    tolerance: f64,
) -> ProjectedOutline {
    let mut paths = ProjectedOutline::default();
    let (mut agreeing, mut measured) = (0_u32, 0_u32);
    for curve in outlines {
        let mut points: Vec<(f64, f64, Seen)> = Vec::new();
        for (from, to) in curve.iter().zip(curve.iter().cycle().skip(1)) {
            for point in between(picture, from, to) {
                let p = picture.table_from_camera.inverse_transform_point(&Point3::from(point));
                let Some((u, v)) = picture.intrinsics.project(&p) else { continue };
                let depth = picture.intrinsics.pixel(u, v).and_then(|at| picture.depth.get(at)).copied();
                let seen = match depth.map(f64::from) {
                    Some(depth) if depth > 0.0 => {
                        measured += 1;
                        let slack = tolerance + 2.0 * picture.intrinsics.footprint(p.z);
                        agreeing += u32::from((depth - p.z).abs() <= 3.0 * slack);
                        if depth + slack < p.z { Seen::Hidden } else { Seen::Yes }
                    }
                    Some(_) => Seen::Unmeasured,
                    None => Seen::Hidden,
                };
                points.push((u - f64::from(crop.left) + 0.5, v - f64::from(crop.top) + 0.5, seen));
            }
        }
        append(&points, &mut paths);
    }
    if f64::from(agreeing) < LEAST_AGREEMENT * f64::from(measured) {
        return ProjectedOutline { contradicted: true, ..ProjectedOutline::default() };
    }
    paths
}

/// Points on the way from one to the other, about [`STEP`] pixels apart, without the last.
fn between(picture: &ViewPicture<'_>, from: &[f64; 3], to: &[f64; 3]) -> Vec<[f64; 3]> {
    let project = |p: &[f64; 3]| {
        picture.intrinsics.project(&picture.table_from_camera.inverse_transform_point(&Point3::from(*p)))
    };
    let (Some(a), Some(b)) = (project(from), project(to)) else { return Vec::new() };
    let steps = ((b.0 - a.0).hypot(b.1 - a.1) / STEP).ceil().clamp(1.0, MOST_POINTS) as u32;
    (0..steps).map(|i| [0, 1, 2].map(|k| from[k] + f64::from(i) / f64::from(steps) * (to[k] - from[k]))).collect()
}

/// Adds a closed curve to the paths, piece by piece of what is seen alike.
fn append(points: &[(f64, f64, Seen)], paths: &mut ProjectedOutline) {
    let mut current = Seen::Hidden;
    for pair in points.iter().zip(points.iter().cycle().skip(1)) {
        let ((u, v, seen), (next_u, next_v, next)) = pair;
        // A side is as its worse end.
        let side = match (seen, next) {
            (Seen::Hidden, _) | (_, Seen::Hidden) => Seen::Hidden,
            (Seen::Unmeasured, _) | (_, Seen::Unmeasured) => Seen::Unmeasured,
            (Seen::Yes, Seen::Yes) => Seen::Yes,
        };
        let path = match side {
            Seen::Yes => &mut paths.seen,
            Seen::Unmeasured => &mut paths.unmeasured,
            Seen::Hidden => {
                current = Seen::Hidden;
                continue;
            }
        };
        if side != current {
            // Writing to a string cannot fail.
            let _ = write!(path, "M{u:.1} {v:.1}");
            current = side;
        }
        let _ = write!(path, "L{next_u:.1} {next_v:.1}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::worn_square;
    use nalgebra::Vector3;

    /// A camera 0.3 m over the origin that looks down; 0.5 mm a pixel.
    fn picture(depth: Vec<f32>) -> ViewPicture<'static> {
        let table_from_camera =
            Isometry3::face_towards(&Point3::new(0.0, 0.0, 0.3), &Point3::origin(), &Vector3::new(0.0, -1.0, 0.0));
        ViewPicture {
            rgb: Arc::new(RgbImage::from_pixel(320, 240, image::Rgb([90, 120, 60]))),
            depth: Cow::Owned(depth),
            intrinsics: Intrinsics { width: 320, height: 240, fx: 600.0, fy: 600.0, cx: 160.0, cy: 120.0 },
            table_from_camera,
        }
    }

    fn taken(depth: Vec<f32>) -> Photograph {
        let region = worn_square().region.expect("a region");
        photograph(&picture(depth), &region.views[0], &region.outlines, 1e-3, 85).expect("in the picture")
    }

    #[test]
    fn the_outline_lies_where_the_view_sees_it() {
        let photo = taken(vec![0.3; 320 * 240]);
        let PixelBox { left, top, width, height } = photo.crop;
        assert_eq!((width, height), (120, 90));
        assert_eq!((left, top), (100, 75));
        // The square is 20 mm wide: 40 pixels around the principal point, its corners at +-20.
        let corner = format!("{:.1} {:.1}", 160.0 - 20.0 - 100.0 + 0.5, 120.0 - 20.0 - 75.0 + 0.5);
        assert!(photo.outline.seen.contains(&corner), "{corner} in {}", photo.outline.seen);
        assert!(photo.outline.unmeasured.is_empty() && !photo.outline.contradicted);
        let decoded = image::load_from_memory(&photo.jpeg).expect("a picture");
        assert_eq!((decoded.width(), decoded.height()), (120, 90));
    }

    #[test]
    fn what_is_hidden_is_not_drawn_and_what_is_not_measured_is_dashed() {
        // Something stands 0.1 m over the left part of the finding, and the rows of its upper rim have no depth.
        let depth = (0..320 * 240).map(|i| match (i % 320, i / 320) {
            (u, _) if u < 150 => 0.2,
            (_, v) if v < 110 => 0.0,
            _ => 0.3,
        });
        let photo = taken(depth.collect());
        let xs = |path: &str| -> Vec<f64> {
            path.split(['M', 'L']).filter_map(|pair| pair.split(' ').next()?.parse().ok()).collect()
        };
        let (seen, dashed) = (xs(&photo.outline.seen), xs(&photo.outline.unmeasured));
        assert!(!seen.is_empty() && seen.iter().all(|x| *x >= 49.0), "{seen:?}");
        assert!(!dashed.is_empty() && dashed.iter().all(|x| *x >= 49.0), "{dashed:?}");
        // Depth that has nothing to do with the model: nothing is drawn, which is said.
        let wrong = taken(vec![3.0; 320 * 240]).outline;
        assert_eq!(wrong, ProjectedOutline { contradicted: true, ..ProjectedOutline::default() });
    }

    #[test]
    fn a_crop_lies_in_the_picture() {
        let pixels = |left, top, width, height| PixelBox { left, top, width, height };
        assert_eq!(crop(&pixels(0, 0, 10, 10), (320, 240)), Some(pixels(0, 0, 120, 90)));
        assert_eq!(crop(&pixels(310, 230, 10, 10), (320, 240)), Some(pixels(200, 150, 120, 90)));
        assert_eq!(crop(&pixels(0, 0, 320, 240), (320, 240)), Some(pixels(0, 0, 320, 240)));
        assert_eq!(crop(&pixels(400, 0, 10, 10), (320, 240)), None);
        assert_eq!(crop(&pixels(5, 5, 10, 10), (40, 30)), Some(pixels(0, 0, 40, 30)));
    }
}
