//! The labels of a model in one view that saw it.
//!
//! The mesh is drawn from the view's pose, and every pixel is tested against the depth that the view itself measured:
//!
//! | measured depth | label |
//! |---|---|
//! | agrees with the surface that is seen there | that of the surface |
//! | belongs to surface beside it (a silhouette that the pose shifts) | that of the nearest vertex |
//! | far from any surface of the model, where the part does not reach ([`Extent`]) | background: class 0 |
//! | not on the surface otherwise | [`IGNORE`] |
//! | none, but all measured pixels around agree with the surface | that of the surface |
//! | none, and the line of sight does not enter the measuring volume, where one is known | background: class 0 |
//! | none, and other views saw that the line of sight meets nothing in that volume | background: class 0 |
//! | none otherwise | [`IGNORE`] |
//!
//! So nothing is labelled that stands before the model, and nothing is called background that no view measured and that may be
//! the part. Surface whose class nobody said, or that the selection leaves out, is [`IGNORE`].

use crate::extent::Extent;
use crate::rim::{Guide, RimTreatment, treat_rim};
use crate::{CapturedView, Corrected, CorrectedLabels, IGNORE, Labeller, MeasuringVolume, Stroke};
use nalgebra::Point3;
use rayon::prelude::*;
use semascan_geometry::measure::NearestPoints;
use semascan_model::SemanticMesh;
use semascan_rasterizer::{Camera, Scene, SeenSurface, SurfacePlace};
use serde::Serialize;

/// Voxels from any vertex beyond which a measured point belongs to no surface of the model.
const FAR: f64 = 4.0;
/// Voxels from a vertex up to which a measured point lies on the surface.
const NEAR: f64 = 1.5;
/// Voxels, and footprints of a pixel, that measured depth may differ from that of the surface.
const AGREEMENT: (f64, f64) = (2.0, 2.0);
/// Pixels that measured ones around a pixel without depth are looked for within.
const HOLE: usize = 6;
/// Directions, of eight, in which such pixels have to be found.
const LEAST_AROUND: usize = 5;
/// Voxels by which the labels of a model may be shifted along its surface.
const MODEL_SHIFT: f64 = 0.75;
/// Largest half width of a rim, pixels.
const WIDEST_RIM: usize = 6;

/// Which labels of the model are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Selection {
    /// Only what a person said; measured labels are left open.
    pub only_people: bool,
    /// Measured labels with a larger standard uncertainty (0 to 1) are left open; `None`: all are used.
    pub max_sigma: Option<f32>,
}

/// Pixels by what became of them, before rims are treated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PixelCounts {
    /// Labelled by surface of the model that agrees with the depth.
    pub agreeing: u64,
    /// Labelled by the nearest surface, which lies beside.
    pub beside: u64,
    /// Labelled by surface, without depth of their own among pixels that agree.
    pub in_holes: u64,
    /// Background, by its measured depth.
    pub background: u64,
    /// Background without depth: its line of sight does not enter the measuring volume.
    pub outside: u64,
    /// Background without depth: other views saw that there is nothing along its line of sight.
    pub empty: u64,
    /// Left open: near the model or where the part may be, but not on the model.
    pub contradicting: u64,
    /// Left open: not measured.
    pub unmeasured: u64,
}

impl PixelCounts {
    /// Adds another view's.
    pub fn add(&mut self, other: &Self) {
        self.agreeing += other.agreeing;
        self.beside += other.beside;
        self.in_holes += other.in_holes;
        self.background += other.background;
        self.outside += other.outside;
        self.empty += other.empty;
        self.contradicting += other.contradicting;
        self.unmeasured += other.unmeasured;
    }
}

/// Masks of a view, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewMasks {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Component class of each pixel, 0 = background, [`IGNORE`] = unknown.
    pub components: Vec<u16>,
    /// Defect class of each pixel, 0 = none, [`IGNORE`] = unknown.
    pub defects: Vec<u16>,
    /// Instance of the component at each pixel; 0 = not told apart.
    pub instances: Vec<u16>,
}

/// Labels of a model as a view sees them, with what is needed to treat their rims.
#[derive(Clone, Debug)]
pub struct Projection {
    /// The masks as the surface has them.
    pub masks: ViewMasks,
    /// What became of the pixels.
    pub counts: PixelCounts,
    /// Pixels to either side of an edge within which pose and voxel leave it uncertain.
    pub rim: usize,
}

/// A model with labels that can be projected.
pub struct LabelledModel<'a> {
    mesh: &'a SemanticMesh,
    scene: Scene<'a>,
    nearest: NearestPoints,
    extent: Extent,
    /// Classes of vertices, [`IGNORE`] where they are not to be used.
    components: Vec<u16>,
    defects: Vec<u16>,
    /// The same without the strokes of a brush.
    components_beneath: Beneath,
    defects_beneath: Beneath,
    /// In the order of the log.
    strokes: Vec<SearchableStroke<'a>>,
    voxel: f64,
}

/// Labels of vertices that strokes lie on.
struct Beneath {
    classes: Vec<u16>,
    /// Places in the log of the entries that they are from; 0 = measured.
    sequences: Vec<u64>,
}

/// A stroke with a search tree over its points.
struct SearchableStroke<'a> {
    stroke: &'a Stroke,
    nearest: NearestPoints,
}

/// What a pixel is.
#[derive(Clone, Copy, PartialEq)]
enum Pixel {
    Agrees(SurfacePlace),
    Beside(u32),
    Hole(SurfacePlace),
    Background,
    Outside,
    Empty,
    Contradicts,
    Unmeasured,
}

impl<'a> LabelledModel<'a> {
    /// `mesh` with `corrected` labels; `voxel` metres is the edge of the voxels that it was made of.
    pub fn new(mesh: &'a SemanticMesh, corrected: &'a Corrected, voxel: f64, selection: Selection) -> Self {
        let usable = |labels: &CorrectedLabels, sigmas: &[f32]| -> Vec<u16> {
            let of = |v: usize| {
                let certain = selection.max_sigma.is_none_or(|most| sigmas[v] <= most);
                let measured = labels.by[v] == Labeller::Measured && certain && !selection.only_people;
                if labels.by[v].is_person() || measured { labels.classes[v] } else { IGNORE }
            };
            (0..mesh.len()).map(of).collect()
        };
        let beneath = |labels: &CorrectedLabels, sigmas: &[f32]| {
            let sequence = |by: &Labeller| if let Labeller::Person(sequence) = by { *sequence } else { 0 };
            Beneath { classes: usable(labels, sigmas), sequences: labels.by.iter().map(sequence).collect() }
        };
        let searchable = |stroke: &'a Stroke| {
            let points: Vec<[f32; 3]> = stroke.points.iter().map(|p| p.map(|c| c as f32)).collect();
            SearchableStroke { stroke, nearest: NearestPoints::new(&points) }
        };
        let components = usable(&corrected.components, &mesh.vertices.sigma);
        let of_part = mesh.vertices.positions.iter().zip(&components).filter(|(_, class)| **class != 0);
        Self {
            mesh,
            extent: Extent::of(of_part.map(|(position, _)| position)),
            components_beneath: beneath(&corrected.components_beneath, &mesh.vertices.sigma),
            defects_beneath: beneath(&corrected.defects_beneath, &mesh.vertices.defect_sigma),
            strokes: corrected.strokes.iter().map(searchable).collect(),
            scene: Scene::of_shape(mesh),
            nearest: NearestPoints::new(&mesh.vertices.positions),
            components,
            defects: usable(&corrected.defects, &mesh.vertices.defect_sigma),
            voxel,
        }
    }

    /// The labels in `view`, whose pictures have the size of its camera.
    pub fn project(&self, view: &CapturedView<'_>) -> Projection {
        let seen = SeenSurface::of(
            &self.scene,
            &Camera { intrinsics: view.intrinsics, table_from_camera: view.table_from_camera },
        );
        let (width, height) = (seen.width, seen.height);
        let volume = view.space.map(|space| space.volume().widened(self.volume_margin(view)));
        let mut pixels: Vec<Pixel> =
            (0..width * height).into_par_iter().map(|at| self.pixel(view, &seen, volume.as_ref(), at)).collect();
        fill_holes(&mut pixels, &seen);
        let mut counts = PixelCounts::default();
        let mut masks = ViewMasks {
            width,
            height,
            components: vec![IGNORE; pixels.len()],
            defects: vec![IGNORE; pixels.len()],
            instances: vec![0; pixels.len()],
        };
        for (at, pixel) in pixels.iter().enumerate() {
            let (count, vertex) = match pixel {
                Pixel::Agrees(place) => (&mut counts.agreeing, self.labels_at(place)),
                Pixel::Hole(place) => (&mut counts.in_holes, self.labels_at(place)),
                Pixel::Beside(v) => (&mut counts.beside, self.labels_of(*v)),
                Pixel::Background => (&mut counts.background, [0; 3]),
                Pixel::Outside => (&mut counts.outside, [0; 3]),
                Pixel::Empty => (&mut counts.empty, [0; 3]),
                Pixel::Contradicts => (&mut counts.contradicting, [IGNORE, IGNORE, 0]),
                Pixel::Unmeasured => (&mut counts.unmeasured, [IGNORE, IGNORE, 0]),
            };
            *count += 1;
            [masks.components[at], masks.defects[at], masks.instances[at]] = vertex;
        }
        let mut depths: Vec<f32> = seen.places.iter().flatten().map(|place| place.depth).collect();
        let middle = depths.len() / 2;
        let depth = match depths.is_empty() {
            true => 0.0,
            false => f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1),
        };
        Projection { masks, counts, rim: self.rim(view, depth) }
    }

    /// Pixels by which an edge may be shifted at a depth: the labels of the model on its surface, and the pose.
    fn rim(&self, view: &CapturedView<'_>, depth: f64) -> usize {
        let footprint = view.intrinsics.footprint(depth);
        if footprint <= 0.0 {
            return 1;
        }
        // A pose that nobody says the uncertainty of shifts by half a voxel: as far as it may be off without being noticed.
        let pose = view.uncertainty.map_or(0.5 * self.voxel, |u| u.translation.hypot(u.rotation * depth));
        let shift = (MODEL_SHIFT * self.voxel).hypot(pose) / footprint;
        (shift.ceil() as usize).clamp(1, WIDEST_RIM)
    }

    /// Metres by which the volume is taken to be larger: as far as the part's rim may be shifted in a view.
    fn volume_margin(&self, view: &CapturedView<'_>) -> f64 {
        let distance = view.table_from_camera.translation.vector.norm();
        let pose = view.uncertainty.map_or(0.5 * self.voxel, |u| u.translation.hypot(u.rotation * distance));
        FAR * self.voxel + 3.0 * pose
    }

    fn pixel(&self, view: &CapturedView<'_>, seen: &SeenSurface, volume: Option<&MeasuringVolume>, at: usize) -> Pixel {
        let place = seen.places[at].filter(|place| place.is_outside);
        let depth = f64::from(view.depth[at]);
        let (u, v) = (at % seen.width, at / seen.width);
        if !(depth > 0.0 && depth.is_finite()) {
            let passes = |volume: &MeasuringVolume| {
                !volume.is_entered(&view.intrinsics, &view.table_from_camera, u as f64, v as f64)
            };
            return match place {
                Some(place) => Pixel::Hole(place),
                None if volume.is_some_and(passes) => Pixel::Outside,
                None if view.space.is_some_and(|space| space.is_empty_along(view, u, v)) => Pixel::Empty,
                None => Pixel::Unmeasured,
            };
        }
        let footprint = view.intrinsics.footprint(depth);
        let slack = AGREEMENT.0 * self.voxel + AGREEMENT.1 * footprint;
        if let Some(place) = place {
            let (least, greatest) = depths_around(seen, u, v, place.depth, slack as f32);
            if depth >= f64::from(least) - slack && depth <= f64::from(greatest) + slack {
                return Pixel::Agrees(place);
            }
        }
        let point: Point3<f64> = view.table_from_camera * view.intrinsics.unproject(u as f64, v as f64, depth);
        let far = FAR * self.voxel + footprint;
        match self.nearest.nearest_within([point.x, point.y, point.z].map(|c| c as f32), far as f32) {
            None if self.extent.holds(&point, 0.0) => Pixel::Contradicts,
            None => Pixel::Background,
            Some(nearest) if nearest.distance() <= NEAR * self.voxel => Pixel::Beside(nearest.index),
            Some(_) => Pixel::Contradicts,
        }
    }

    /// Component, defect and instance at a place: of the last stroke that covers it, or those that the corners with the most
    /// weight have.
    fn labels_at(&self, place: &SurfacePlace) -> [u16; 3] {
        let corners = place.corners.map(|v| self.mesh.vertices.positions[v as usize]);
        let point: [f32; 3] =
            std::array::from_fn(|axis| (0..3).map(|k| place.weights[k] * corners[k][axis]).sum::<f32>());
        let mut over: [Option<(u64, u16)>; 2] = [None; 2];
        for SearchableStroke { stroke, nearest } in self.strokes.iter().rev() {
            let named = [(0, stroke.component), (1, stroke.defect)];
            if named.iter().all(|(kind, class)| class.is_none() || over[*kind].is_some()) {
                continue;
            }
            if nearest.nearest_within(point, stroke.radius as f32).is_some() {
                for (kind, class) in named {
                    over[kind] = over[kind].or(class.map(|class| (stroke.sequence, class)));
                }
            }
        }
        let label = |beneath: &Beneath, over: Option<(u64, u16)>| {
            let (class, corner) = most_weighted(place, &beneath.classes);
            match over {
                Some((sequence, over)) if sequence > beneath.sequences[corner] => over,
                _ => class,
            }
        };
        let [component, defect] = over;
        [
            label(&self.components_beneath, component),
            label(&self.defects_beneath, defect),
            most_weighted(place, &self.mesh.vertices.instances).0,
        ]
    }

    fn labels_of(&self, v: u32) -> [u16; 3] {
        let v = v as usize;
        [self.components[v], self.defects[v], self.mesh.vertices.instances[v]]
    }
}

impl Projection {
    /// The masks with their edges treated.
    pub fn masks_with(&self, view: &CapturedView<'_>, treatment: RimTreatment) -> ViewMasks {
        let guide = Guide { rgb: view.rgb, depth: view.depth, intrinsics: &view.intrinsics };
        ViewMasks {
            components: treat_rim(&self.masks.components, &guide, self.rim, treatment),
            // A defect has no silhouette.
            defects: treat_rim(
                &self.masks.defects,
                &guide,
                self.rim,
                match treatment {
                    RimTreatment::Close => RimTreatment::Refine,
                    other => other,
                },
            ),
            ..self.masks.clone()
        }
    }
}

/// The value that the corners of a place with the most weight have, and the first such corner.
fn most_weighted(place: &SurfacePlace, values: &[u16]) -> (u16, usize) {
    let corners = place.corners.map(|v| v as usize);
    let [a, b, c] = corners.map(|v| values[v]);
    let [wa, wb, wc] = place.weights;
    let weights = [
        (a, corners[0], wa + if b == a { wb } else { 0.0 } + if c == a { wc } else { 0.0 }),
        (b, corners[1], wb + if c == b { wc } else { 0.0 }),
        (c, corners[2], wc),
    ];
    let best = weights.iter().fold(weights[0], |best, one| if one.2 > best.2 { *one } else { best });
    (best.0, best.1)
}

/// The least and the greatest depth of the same surface in the pixels around one.
fn depths_around(seen: &SeenSurface, u: usize, v: usize, depth: f32, slack: f32) -> (f32, f32) {
    let (mut least, mut greatest) = (depth, depth);
    for y in v.saturating_sub(1)..(v + 2).min(seen.height) {
        for x in u.saturating_sub(1)..(u + 2).min(seen.width) {
            let Some(place) = seen.places[y * seen.width + x] else { continue };
            // A jump leads to another surface.
            if (place.depth - depth).abs() <= 4.0 * slack {
                (least, greatest) = (least.min(place.depth), greatest.max(place.depth));
            }
        }
    }
    (least, greatest)
}

/// Leaves a pixel without depth open unless the measured pixels around it agree with the surface.
fn fill_holes(pixels: &mut [Pixel], seen: &SeenSurface) {
    const AROUND: [(isize, isize); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
    let (width, height) = (seen.width as isize, seen.height as isize);
    let first_measured = |at: usize, (du, dv): (isize, isize)| {
        let (mut u, mut v) = (at as isize % width, at as isize / width);
        for _ in 0..HOLE {
            (u, v) = (u + du, v + dv);
            if !(0..width).contains(&u) || !(0..height).contains(&v) {
                return None;
            }
            match pixels[(v * width + u) as usize] {
                Pixel::Hole(_) | Pixel::Unmeasured | Pixel::Outside | Pixel::Empty => {}
                measured => return Some(matches!(measured, Pixel::Agrees(_) | Pixel::Beside(_))),
            }
        }
        None
    };
    let is_open = |at: &usize| {
        if !matches!(pixels[*at], Pixel::Hole(_)) {
            return false;
        }
        let found: Vec<bool> = AROUND.iter().filter_map(|direction| first_measured(*at, *direction)).collect();
        found.len() < LEAST_AROUND || found.contains(&false)
    };
    let open: Vec<usize> = (0..pixels.len()).into_par_iter().filter(is_open).collect();
    for at in open {
        pixels[at] = Pixel::Unmeasured;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{entry, plate, record, taxonomy};
    use crate::{EmptySpace, corrected_labels};
    use image::RgbImage;
    use nalgebra::{Isometry3, Vector3};
    use semascan_model::review::{ReviewAction, ReviewEntry, Subject, SurfacePatch};
    use semascan_perception::view::Intrinsics;

    const WIDTH: u32 = 160;
    const HEIGHT: u32 = 120;

    /// A camera 0.3 m over the plate that looks down; 0.5 mm a pixel.
    fn camera() -> (Intrinsics, Isometry3<f64>) {
        let pose =
            Isometry3::face_towards(&Point3::new(0.0, 0.0, 0.3), &Point3::origin(), &Vector3::new(0.0, -1.0, 0.0));
        (Intrinsics { width: WIDTH, height: HEIGHT, fx: 600.0, fy: 600.0, cx: 80.0, cy: 60.0 }, pose)
    }

    /// Whether a pixel shows the plate, so many pixels from its rim at least.
    fn on_plate(at: usize, inside: f64) -> bool {
        let (u, v) = ((at % WIDTH as usize) as f64 - 80.0, (at / WIDTH as usize) as f64 - 60.0);
        u.abs().max(v.abs()) <= 40.0 - inside
    }

    fn projected(depth: &[f32], selection: Selection) -> Projection {
        projected_within(depth, selection, None)
    }

    fn projected_within(depth: &[f32], selection: Selection, volume: Option<MeasuringVolume>) -> Projection {
        let mesh = plate();
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &[]);
        let model = LabelledModel::new(&mesh, &corrected, 1e-3, selection);
        let (intrinsics, table_from_camera) = camera();
        let rgb = RgbImage::new(WIDTH, HEIGHT);
        let space = volume.map(|volume| EmptySpace::new(volume, 1e-3));
        let space = space.as_ref();
        let view = CapturedView { rgb: &rgb, depth, intrinsics, table_from_camera, uncertainty: None, space };
        model.project(&view)
    }

    /// Depth of the plate before a wall 0.1 m behind it.
    fn depth_of_plate() -> Vec<f32> {
        (0..(WIDTH * HEIGHT) as usize).map(|at| if on_plate(at, 0.0) { 0.3 } else { 0.4 }).collect()
    }

    #[test]
    fn surface_labels_what_agrees_with_it_and_the_wall_is_background() {
        let Projection { masks, counts, rim } = projected(&depth_of_plate(), Selection::default());
        for at in 0..masks.components.len() {
            assert_eq!(masks.components[at], u16::from(on_plate(at, 0.0)), "{at}");
            assert_eq!(masks.defects[at], 0);
        }
        assert_eq!(counts.agreeing + counts.beside, 81 * 81);
        assert_eq!(counts.background, u64::from(WIDTH * HEIGHT) - 81 * 81);
        // 0.75 mm of the model and 0.5 mm of the pose are 1.8 pixels.
        assert_eq!(rim, 2);
    }

    #[test]
    fn what_stands_before_the_model_is_not_labelled_by_it() {
        let mut depth = depth_of_plate();
        let is_before = |at: usize| at % (WIDTH as usize) < 70;
        (0..depth.len()).filter(|at| is_before(*at)).for_each(|at| depth[at] = 0.2);
        // 3.5 mm before the surface: neither on it nor far from it.
        let is_close = |at: usize| at % (WIDTH as usize) > 110;
        (0..depth.len()).filter(|at| is_close(*at) && on_plate(*at, 0.0)).for_each(|at| depth[at] = 0.2965);
        let masks = projected(&depth, Selection::default()).masks;
        for at in 0..depth.len() {
            let expected = match (on_plate(at, 0.0), is_before(at), is_close(at)) {
                (_, true, _) | (false, ..) => 0,
                (.., true) => IGNORE,
                _ => 1,
            };
            assert_eq!(masks.components[at], expected, "{at}");
        }
    }

    #[test]
    fn what_was_not_measured_is_open_unless_all_around_it_agrees() {
        let mut depth = depth_of_plate();
        let (hole, gap) = (60 * WIDTH as usize + 80, 10 * WIDTH as usize + 10);
        (depth[hole], depth[gap]) = (0.0, 0.0);
        for at in (0..depth.len()).filter(|at| at / WIDTH as usize >= 80) {
            depth[at] = 0.0;
        }
        let Projection { masks, counts, .. } = projected(&depth, Selection::default());
        assert_eq!((masks.components[hole], masks.components[gap]), (1, IGNORE));
        assert_eq!(
            masks.components[95 * WIDTH as usize + 80],
            IGNORE,
            "the plate is there, but who knows what before it"
        );
        assert_eq!(counts.in_holes, 1);
        let all: u64 =
            [counts.agreeing, counts.beside, counts.in_holes, counts.background, counts.unmeasured].iter().sum();
        assert_eq!(all + counts.contradicting, u64::from(WIDTH * HEIGHT));
    }

    #[test]
    fn without_depth_what_cannot_be_the_part_is_background_and_what_can_be_is_open() {
        let depth: Vec<f32> = depth_of_plate().iter().map(|z| if *z < 0.35 { *z } else { 0.0 }).collect();
        let open = projected(&depth, Selection::default());
        assert_eq!((open.counts.background, open.counts.outside), (0, 0));
        assert_eq!(open.masks.components[0], IGNORE);
        // The plate is 40 mm wide, the volume 60 mm; from 0.3 m above, 2 pixels a millimetre.
        let volume =
            MeasuringVolume { least: Point3::new(-0.03, -0.03, -0.001), greatest: Point3::new(0.03, 0.03, 0.001) };
        let Projection { masks, counts, .. } = projected_within(&depth, Selection::default(), Some(volume));
        let labelled = (0..depth.len()).filter(|at| masks.components[*at] == 0);
        assert_eq!(labelled.count() as u64, counts.outside);
        for at in 0..depth.len() {
            let expected = match (on_plate(at, 0.0), on_plate(at, -20.0)) {
                (true, _) => 1,
                (_, true) => IGNORE,
                // Within the margin of 5.5 mm, 11 pixels, and its perspective it may be either.
                _ if on_plate(at, -33.0) => continue,
                _ => 0,
            };
            assert_eq!(masks.components[at], expected, "{at}");
        }
    }

    #[test]
    fn without_depth_what_another_view_saw_to_be_empty_is_background() {
        let (intrinsics, above) = camera();
        let rgb = RgbImage::new(WIDTH, HEIGHT);
        let mesh = plate();
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &[]);
        let model = LabelledModel::new(&mesh, &corrected, 1e-3, Selection::default());
        let depth: Vec<f32> = depth_of_plate().iter().map(|z| if *z < 0.35 { *z } else { 0.0 }).collect();
        let view = |depth, table_from_camera, space| CapturedView {
            rgb: &rgb,
            depth,
            intrinsics,
            table_from_camera,
            uncertainty: None,
            space,
        };
        // From the side, along the plate: a wall 0.4 m away, and nothing before it but the plate's edge.
        let side =
            Isometry3::face_towards(&Point3::new(0.0, -0.3, 0.004), &Point3::new(0.0, 0.0, 0.004), &Vector3::z());
        let volume =
            MeasuringVolume { least: Point3::new(-0.03, -0.03, 0.002), greatest: Point3::new(0.03, 0.03, 0.006) };
        let unseen = EmptySpace::new(volume, 1e-3);
        assert_eq!(model.project(&view(&depth, above, Some(&unseen))).counts.empty, 0);
        let mut space = unseen.clone();
        let wall = vec![0.7; depth.len()];
        space.see(&view(&wall, side, None));
        let Projection { masks, counts, .. } = model.project(&view(&depth, above, Some(&space)));
        assert!(counts.empty > 5000, "{counts:?}");
        assert!((0..depth.len()).all(|at| on_plate(at, 0.0) || masks.components[at] != 1));
        assert!((0..depth.len()).filter(|at| on_plate(*at, 0.0)).all(|at| masks.components[at] == 1));
    }

    #[test]
    fn a_stroke_finer_than_the_mesh_is_as_fine_in_a_view() {
        let mesh = plate();
        let relabel = |sequence, y: f64, radius, defect: &str| {
            // Between two rows of vertices, which are 1 mm apart.
            let points = (-40..=40).map(|x| [f64::from(x) * 2.5e-4, y, 0.0]).collect();
            let patch = SurfacePatch::Points { points, radius };
            entry(
                sequence,
                Subject::Part,
                ReviewAction::Relabel { patch, component: None, defect: Some(defect.into()) },
            )
        };
        let (intrinsics, table_from_camera) = camera();
        let (rgb, depth) = (RgbImage::new(WIDTH, HEIGHT), depth_of_plate());
        let projected = |log: &[ReviewEntry]| {
            let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), log);
            let model = LabelledModel::new(&mesh, &corrected, 1e-3, Selection::default());
            let view = CapturedView {
                rgb: &rgb,
                depth: &depth,
                intrinsics,
                table_from_camera,
                uncertainty: None,
                space: None,
            };
            (corrected.without_effect.len(), model.project(&view).masks.defects)
        };
        let of = |defects: &[u16], class: u16| {
            (0..defects.len()).filter(|at| defects[*at] == class).map(|at| at / WIDTH as usize).collect::<Vec<_>>()
        };
        // 0.7 mm wide, 20 mm long; two pixels a millimetre.
        let (unused, defects) = projected(&[relabel(1, 5e-4, 3.5e-4, "crack")]);
        let rows = of(&defects, 2);
        assert_eq!((unused, rows.iter().max().map(|r| r - rows[0])), (0, Some(0)), "one row of pixels");
        assert!((38..=43).contains(&rows.len()), "{}", rows.len());
        // What is drawn over it later counts, and what lies under it does not.
        let (_, defects) = projected(&[relabel(1, 5e-4, 3.5e-4, "crack"), relabel(2, 5e-4, 3e-3, "none")]);
        assert!(of(&defects, 2).is_empty());
        let (_, defects) = projected(&[relabel(1, 5e-4, 3e-3, "wear"), relabel(2, 5e-4, 3.5e-4, "crack")]);
        assert_eq!(of(&defects, 2).len(), rows.len());
        assert!(of(&defects, 1).len() > 8 * rows.len());
        // A stroke beside the model has none.
        assert_eq!(projected(&[relabel(1, 0.05, 3.5e-4, "crack")]).0, 1);
    }

    #[test]
    fn labels_that_are_left_out_are_open() {
        let people = projected(&depth_of_plate(), Selection { only_people: true, max_sigma: None }).masks;
        assert!(
            (0..people.components.len()).all(|at| people.components[at] == if on_plate(at, 0.0) { IGNORE } else { 0 })
        );
        let mut mesh = plate();
        mesh.vertices.sigma.fill(0.3);
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &[]);
        let of =
            |most| LabelledModel::new(&mesh, &corrected, 1e-3, Selection { only_people: false, max_sigma: Some(most) });
        assert!(of(0.2).components.iter().all(|c| *c == IGNORE) && of(0.3).components.iter().all(|c| *c == 1));
    }
}
