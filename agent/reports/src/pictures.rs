//! Pictures of the model from fixed views, and one of each finding from its best direction, drawn by the rasterizer.

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rayon::prelude::*;
use semascan_geometry::occupancy::Occupancy;
use semascan_model::finding::{Finding, FindingId, RegionFigures};
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_rasterizer::{Camera, Direction, Framing, Outline, Rendering, Scene, render};
use std::collections::BTreeMap;

/// The fixed views; the first is shown large.
pub const FIXED_VIEWS: [Direction; 7] = [
    Direction::Isometric,
    Direction::Front,
    Direction::Right,
    Direction::Back,
    Direction::Left,
    Direction::Top,
    Direction::Bottom,
];

/// Size of the first fixed view, of the others, and of the picture of a finding, pixels.
const FIRST_SIZE: (u32, u32) = (800, 560);
const FIXED_SIZE: (u32, u32) = (400, 300);
const FINDING_SIZE: (u32, u32) = (320, 240);

/// JPEG quality of drawn pictures.
const QUALITY: u8 = 90;

/// Half of the shorter edge of a finding's picture, as a multiple of the finding's radius, and at least so many metres.
const SURROUNDINGS: f64 = 1.8;
const LEAST_HALF_EXTENT: f64 = 5e-3;

/// How far directions that are tried lean from the normal of a finding, radians, and how many there are around it.
const LEANS: [f64; 2] = [0.5, 1.0];
const AROUND: usize = 12;
/// Points of an outline that directions are tried with.
const TRIED_POINTS: usize = 40;
/// Share of an outline that must be seen from its normal for no other direction to be tried.
const ENOUGH: f64 = 0.97;

/// Colour and width of outlines, pixels: in fixed views, of the finding that is shown, and of others beside it.
const OUTLINE_COLOR: [u8; 3] = [0x14, 0x18, 0x20];
const OTHER_COLOR: [u8; 3] = [0x60, 0x68, 0x72];
const FIXED_WIDTH: f64 = 1.4;
const FINDING_WIDTH: f64 = 2.4;
const OTHER_WIDTH: f64 = 1.0;

/// A picture of the whole model.
#[derive(Clone, Debug)]
pub struct ModelPicture {
    /// Where it was drawn from.
    pub direction: Direction,
    /// JPEG.
    pub jpeg: Vec<u8>,
    /// Columns and rows.
    pub size: (u32, u32),
    /// The findings that are seen in it: place in the list of findings, and pixel.
    pub findings: Vec<(usize, [f64; 2])>,
    /// Edge of a pixel in the middle of the part, metres.
    pub pixel: f64,
}

/// A picture of a finding.
#[derive(Clone, Debug)]
pub struct FindingPicture {
    /// JPEG.
    pub jpeg: Vec<u8>,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Edge of a pixel at the finding, metres.
    pub pixel: f64,
    /// Share of its outline that is seen from there.
    pub seen: f64,
}

/// All drawn pictures of an inspection.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The whole model, from [`FIXED_VIEWS`]; empty without a mesh.
    pub model: Vec<ModelPicture>,
    /// Of findings.
    pub findings: BTreeMap<FindingId, FindingPicture>,
}

impl Pictures {
    /// Draws the model of `mesh`, whose voxels have the edge `voxel` (metres), and those of its `findings` that `pictured`
    /// names. Without triangles there are no pictures.
    pub fn draw(
        mesh: &SemanticMesh,
        taxonomy: &Taxonomy,
        voxel: f64,
        findings: &[Finding],
        pictured: &[FindingId],
    ) -> Self {
        let scene = Scene::in_class_colors(mesh, taxonomy);
        if scene.is_empty() {
            return Self::default();
        }
        let tolerance = 2.0 * voxel;
        let outlines = |width, color| -> Vec<Outline<'_>> {
            let regions = findings.iter().filter_map(|f| f.region.as_ref());
            regions.flat_map(|region| outlines_of(region, width, color, tolerance)).collect()
        };
        let fixed = outlines(FIXED_WIDTH, OUTLINE_COLOR);
        let model = FIXED_VIEWS.par_iter().enumerate().filter_map(|(i, direction)| {
            let size = if i == 0 { FIRST_SIZE } else { FIXED_SIZE };
            let camera = Camera::of_all(scene.positions(), direction.axes(), size)?;
            fixed_view(&scene, &camera, *direction, &fixed, findings, tolerance)
        });
        let model: Vec<ModelPicture> = model.collect();
        let others = outlines(OTHER_WIDTH, OTHER_COLOR);
        let occupancy = Occupancy::of(scene.positions(), voxel);
        let of_findings = findings.par_iter().filter(|f| pictured.contains(&f.id)).filter_map(|finding| {
            let region = finding.region.as_ref()?;
            Some((finding.id, finding_picture(&scene, occupancy.as_ref()?, region, &others, tolerance)?))
        });
        Self { model, findings: of_findings.collect::<Vec<_>>().into_iter().collect() }
    }
}

/// A picture as JPEG; `None` where it has no pixels.
pub(crate) fn jpeg(image: &RgbImage, quality: u8) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(image).ok()?;
    Some(bytes)
}

fn outlines_of(
    region: &RegionFigures,
    width: f64,
    color: [u8; 3],
    tolerance: f64,
) -> impl Iterator<Item = Outline<'_>> {
    region.outlines.iter().map(move |curve| Outline { curve, color, width, tolerance })
}

fn fixed_view(
    scene: &Scene<'_>,
    camera: &Camera,
    direction: Direction,
    outlines: &[Outline<'_>],
    findings: &[Finding],
    tolerance: f64,
) -> Option<ModelPicture> {
    let Rendering { image, depth } = render(scene, camera, outlines);
    let seen = findings.iter().enumerate().filter_map(|(number, finding)| {
        let region = finding.region.as_ref()?;
        // What faces away lies on the other side, however thin the part is there.
        let sight = camera.table_from_camera.translation.vector - Vector3::from(region.position);
        let faces_away = Vector3::from(region.normal).dot(&sight) < 0.0;
        let shown = !faces_away && depth.shows(&region.position, tolerance);
        let (u, v, _) = camera.project(&region.position).filter(|_| shown)?;
        Some((number, [u + 0.5, v + 0.5]))
    });
    let findings = seen.collect();
    // The camera looks at the middle of the part.
    let eye = camera.table_from_camera;
    let ahead = (eye * Point3::new(0.0, 0.0, 1.0) - eye * Point3::origin()).normalize();
    let middle = middle_distance(scene, camera, &ahead);
    let size = image.dimensions();
    Some(ModelPicture {
        direction,
        jpeg: jpeg(&image, QUALITY)?,
        size,
        findings,
        pixel: camera.intrinsics.footprint(middle),
    })
}

/// Distance along the direction of view of the middle of the part.
fn middle_distance(scene: &Scene<'_>, camera: &Camera, ahead: &Vector3<f64>) -> f64 {
    let eye = camera.table_from_camera.translation.vector;
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in scene.positions() {
        let z = (Vector3::from(p.map(f64::from)) - eye).dot(ahead);
        (least, most) = (least.min(z), most.max(z));
    }
    (least + most) / 2.0
}

fn finding_picture(
    scene: &Scene<'_>,
    occupancy: &Occupancy,
    region: &RegionFigures,
    others: &[Outline<'_>],
    tolerance: f64,
) -> Option<FindingPicture> {
    let points = scene.positions();
    let curve: Vec<[f64; 3]> = region.outlines.iter().flatten().copied().collect();
    let centre = middle(&curve).unwrap_or(Point3::from(region.position));
    let radius = curve.iter().map(|p| (Point3::from(*p) - centre).norm()).fold(0.0, f64::max);
    let half_extent = (SURROUNDINGS * radius).max(LEAST_HALF_EXTENT);
    // Outside of the part, so that nothing lies behind the camera.
    let framing = Framing { centre, half_extent, distance: 1.5 * scene.diagonal() + 5.0 * half_extent };
    let normal = Vector3::from(region.normal);
    // A region that goes around has no normal: it is looked at from where it lies on the part.
    let outward = Unit::try_new(normal, 1e-9)
        .or_else(|| Unit::try_new(Point3::from(region.position) - part_centre(points), 1e-9))
        .unwrap_or(Vector3::z_axis());
    let toward = best_direction(occupancy, outward, &curve);
    let camera = Camera::at(&framing, (toward, up_for(&toward)), FINDING_SIZE);
    // Its own outline lies over those of others.
    let own = outlines_of(region, FINDING_WIDTH, OUTLINE_COLOR, tolerance);
    let outlines: Vec<Outline<'_>> = others.iter().copied().chain(own).collect();
    let Rendering { image, depth } = render(scene, &camera, &outlines);
    let shown = curve.iter().filter(|point| depth.shows(point, tolerance)).count();
    let seen = shown as f64 / curve.len().max(1) as f64;
    let pixel = camera.intrinsics.footprint(framing.distance);
    Some(FindingPicture { jpeg: jpeg(&image, QUALITY)?, size: FINDING_SIZE, pixel, seen })
}

/// The direction from which most of an outline is seen; the normal, where that is enough.
fn best_direction(occupancy: &Occupancy, outward: Unit<Vector3<f64>>, curve: &[[f64; 3]]) -> Vector3<f64> {
    let normal: [f64; 3] = outward.into_inner().into();
    let every = curve.len().div_ceil(TRIED_POINTS).max(1);
    let tried: Vec<[f64; 3]> = curve.iter().step_by(every).copied().collect();
    let share = |toward: &Vector3<f64>| {
        let toward: [f64; 3] = (*toward).into();
        let seen = tried.iter().filter(|point| !occupancy.is_hidden(**point, normal, toward, f64::INFINITY)).count();
        seen as f64 / tried.len().max(1) as f64
    };
    let straight = share(&outward);
    if straight >= ENOUGH || curve.is_empty() {
        return outward.into_inner();
    }
    let across = Unit::new_normalize(outward.cross(&up_for(&outward)));
    // What is seen counts by how directly it is looked at; of equals the first.
    let mut best = (outward.into_inner(), straight);
    for lean in LEANS {
        let leaned = UnitQuaternion::from_axis_angle(&across, lean) * outward.into_inner();
        for i in 0..AROUND {
            let turn = i as f64 / AROUND as f64 * std::f64::consts::TAU;
            let toward = UnitQuaternion::from_axis_angle(&outward, turn) * leaned;
            let worth = share(&toward) * toward.dot(&outward).max(0.0).sqrt();
            if worth > best.1 + 1e-9 {
                best = (toward, worth);
            }
        }
    }
    best.0
}

/// What is up in a picture from `toward`: the table's up, or +y where that is looked at from above.
fn up_for(toward: &Vector3<f64>) -> Vector3<f64> {
    if toward.z.abs() > 0.95 * toward.norm() { Vector3::y() } else { Vector3::z() }
}

/// Middle of the box around points.
fn middle(points: &[[f64; 3]]) -> Option<Point3<f64>> {
    let first = Vector3::from(*points.first()?);
    let (low, high) = points.iter().map(|p| Vector3::from(*p)).fold((first, first), |(l, h), p| (l.inf(&p), h.sup(&p)));
    Some(Point3::from((low + high) / 2.0))
}

fn part_centre(points: &[[f32; 3]]) -> Point3<f64> {
    let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
    middle(&points).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{quad, taxonomy, worn_plate, worn_square};

    fn drawn(mesh: &SemanticMesh) -> Pictures {
        let finding = worn_square();
        Pictures::draw(mesh, &taxonomy(), 1e-3, std::slice::from_ref(&finding), &[finding.id])
    }

    fn decoded(jpeg: &[u8]) -> RgbImage {
        image::load_from_memory(jpeg).expect("a picture").to_rgb8()
    }

    #[test]
    fn a_finding_is_numbered_where_it_is_seen_and_shown_from_its_normal() {
        let pictures = drawn(&worn_plate());
        assert_eq!(pictures.model.len(), FIXED_VIEWS.len());
        let top = pictures.model.iter().find(|p| p.direction == Direction::Top).expect("drawn");
        assert_eq!(top.findings.len(), 1);
        let [u, v] = top.findings[0].1;
        assert!((u - 200.0).abs() < 2.0 && (v - 150.0).abs() < 2.0, "{u} {v}");
        let bottom = pictures.model.iter().find(|p| p.direction == Direction::Bottom).expect("drawn");
        assert!(bottom.pixel > 1e-4 && bottom.pixel < 1e-3, "{}", bottom.pixel);
        assert!(bottom.findings.is_empty(), "the inside shows no finding");
        let [r, g, b] = decoded(&bottom.jpeg).get_pixel(200, 150).0;
        assert!(r.abs_diff(g) < 12 && g.abs_diff(b) < 12 && r > 60, "the inside is grey: {r} {g} {b}");
        let finding = pictures.findings.values().next().expect("drawn");
        assert_eq!(finding.seen, 1.0);
        let image = decoded(&finding.jpeg);
        // 20 mm of 2 * 1.8 * 14.14 mm along the shorter edge: the outline's side is 47.1 pixels from the middle.
        let edge = 0.01 / finding.pixel;
        assert!((edge - 47.1).abs() < 1.0, "{edge}");
        let at = |x: f64, y: f64| image.get_pixel((159.5 + x) as u32, (119.5 + y) as u32).0;
        let dark = |p: [u8; 3]| p.iter().all(|c| *c < 110);
        assert!(dark(at(edge, 0.0)) && !dark(at(edge - 8.0, 0.0)) && !dark(at(edge + 8.0, 0.0)));
        let (inside, outside) = (at(0.0, 0.0), at(edge + 20.0, 0.0));
        assert!(inside[2] + 40 < outside[2], "wear is a full yellow, the gear a pale orange: {inside:?} {outside:?}");
    }

    #[test]
    fn a_finding_below_something_is_shown_from_the_side() {
        let mut mesh = worn_plate();
        // A roof over one side of it.
        quad(&mut mesh, [-0.05, -0.05], [0.05, 0.004], 0.03, 1, |_| 0);
        let pictures = drawn(&mesh);
        let finding = pictures.findings.values().next().expect("drawn");
        assert!(finding.seen > 0.9, "{}", finding.seen);
    }

    #[test]
    fn without_a_mesh_there_are_no_pictures() {
        let pictures = drawn(&SemanticMesh::default());
        assert!(pictures.model.is_empty() && pictures.findings.is_empty());
    }
}
