//! Depth registration against the truth: a part of the virtual cell on a floor, seen by a depth camera beside a colour camera
//! with more pixels. Rays say what each colour pixel sees, and whether the depth camera sees it too.

use crate::camera_model::DepthRegistration;
use glam::Vec3;
use nalgebra::{Isometry3, Point3, Vector3};
use semascan_inspection::source::Source;
use semascan_perception::view::{DepthImage, Intrinsics};
use semascan_simulation::raycast::RayScene;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

const MOTOR: &str = "virtual:starter-motor?seed=5&views=1&size=64x48&cell=4";
/// Coarser and wider than the colour camera.
const DEPTH: Intrinsics = Intrinsics { width: 320, height: 288, fx: 252.0, fy: 252.3, cx: 160.4, cy: 144.1 };
const COLOR: Intrinsics = Intrinsics { width: 640, height: 360, fx: 610.0, fy: 611.0, cx: 318.2, cy: 181.0 };

struct Scene {
    rays: RayScene,
    table_from_color: Isometry3<f64>,
    color_from_depth: Isometry3<f64>,
}

impl Scene {
    /// The motor on a floor. The depth camera is 5 cm beside the colour camera and tilted by 6 degrees, as in a Kinect.
    fn new() -> Self {
        let cell = VirtualCell::open(&VirtualCellSpec::parse(MOTOR).expect("a source")).expect("a cell");
        let truth = cell.truth().expect("a surface");
        let (mut vertices, mut triangles) = (truth.vertices.clone(), truth.triangles.clone());
        let lowest = vertices.iter().map(|v| v[2]).fold(f32::INFINITY, f32::min);
        let first = vertices.len() as u32;
        vertices.extend([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| [x, y, lowest]));
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        let eye = Point3::new(0.34, 0.12, 0.36);
        Self {
            rays: RayScene::new(&vertices, &triangles),
            table_from_color: Isometry3::face_towards(&eye, &Point3::new(0.0, 0.0, 0.03), &-Vector3::z()),
            color_from_depth: Isometry3::new(Vector3::new(-0.05, 0.002, 0.004), Vector3::new(0.105, 0.0, 0.01)),
        }
    }

    /// Depth that a camera measures.
    fn depth(&self, k: &Intrinsics, table_from_camera: &Isometry3<f64>) -> DepthImage {
        let metres = (0..k.width * k.height).map(|i| {
            let ray = table_from_camera.rotation * k.unproject((i % k.width).into(), (i / k.width).into(), 1.0).coords;
            let hit = self.rays.first_hit(single(&table_from_camera.translation.vector), single(&ray));
            hit.map_or(0.0, |hit| hit.t)
        });
        DepthImage { width: k.width, height: k.height, metres: metres.collect() }
    }

    /// Where the depth camera has a point of the colour camera's frame in its picture; `None` beside it, and where something
    /// is before it.
    fn seen_by_depth(&self, point: &Point3<f64>) -> Option<(f64, f64)> {
        let (u, v) = DEPTH.project(&self.color_from_depth.inverse_transform_point(point))?;
        DEPTH.pixel(u, v)?;
        let from = self.table_from_color * point;
        let eye = Point3::from((self.table_from_color * self.color_from_depth).translation.vector);
        let way = eye - from;
        let start = single(&(from.coords + 1e-3 * way));
        (!self.rays.is_blocked(start, single(&way), 0.99)).then_some((u, v))
    }
}

fn single(v: &Vector3<f64>) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// Pixels for which, and for all around them, `holds`.
fn within(holds: &[bool], radius: i64) -> Vec<bool> {
    let (width, height) = (i64::from(COLOR.width), i64::from(COLOR.height));
    let at = |u: i64, v: i64| (0..width).contains(&u) && (0..height).contains(&v) && holds[(v * width + u) as usize];
    (0..width * height)
        .map(|i| {
            let (u, v) = (i % width, i / width);
            (-radius..=radius).all(|down| (-radius..=radius).all(|right| at(u + right, v + down)))
        })
        .collect()
}

#[test]
fn registered_depth_is_what_the_colour_camera_would_have_measured() {
    let scene = Scene::new();
    let truth = scene.depth(&COLOR, &scene.table_from_color);
    let mut measured = scene.depth(&DEPTH, &(scene.table_from_color * scene.color_from_depth));
    // A shiny place of the floor of which nothing came back.
    let (columns, rows) = (250..262_u32, 120..134_u32);
    for v in rows.clone() {
        for u in columns.clone() {
            measured.metres[(v * DEPTH.width + u) as usize] = 0.0;
        }
    }
    let registration = DepthRegistration::new(DEPTH, COLOR, scene.color_from_depth).expect("cameras");
    let depth = registration.register(&measured).expect("its size");
    let place = |i: usize| ((i % COLOR.width as usize) as f64, (i / COLOR.width as usize) as f64);
    let seen: Vec<Option<(f64, f64)>> = (0..truth.metres.len())
        .map(|i| {
            let (u, v) = place(i);
            let z = truth.metres[i];
            (z > 0.0).then(|| COLOR.unproject(u, v, z.into())).and_then(|point| scene.seen_by_depth(&point))
        })
        .collect();
    let in_hole = |(u, v): (f64, f64), beyond: f64| {
        let inside = |at: f64, range: &std::ops::Range<u32>| {
            at > f64::from(range.start) - 0.5 - beyond && at < f64::from(range.end) - 0.5 + beyond
        };
        inside(u, &columns) && inside(v, &rows)
    };
    let visible: Vec<bool> = seen.iter().map(|at| at.is_some_and(|at| !in_hole(at, 0.5))).collect();
    let hidden: Vec<bool> = seen.iter().map(Option::is_none).collect();
    let hole: Vec<bool> = seen.iter().map(|at| at.is_some_and(|at| in_hole(at, -0.25))).collect();
    let count =
        |which: &[bool], test: &dyn Fn(usize) -> bool| (0..which.len()).filter(|i| which[*i] && test(*i)).count();
    let all = |_: usize| true;
    let is_measured = |i: usize| depth.metres[i] > 0.0;
    let is_off = |i: usize| is_measured(i) && (depth.metres[i] - truth.metres[i]).abs() > 0.001;

    let visible_inside = within(&visible, 2);
    let (of, holes) = (count(&visible_inside, &all), count(&visible_inside, &|i| !is_measured(i)));
    assert!(of > 150_000 && holes * 1000 < of, "{holes} holes in {of} visible pixels");
    // Beside an edge of the depth picture a coarse pixel may see the one side and the colour pixel the other; elsewhere there
    // is no hole at all.
    let is_smooth = |(u, v): (f64, f64)| {
        let near = |right: i64, down: i64| {
            let (u, v) = (u.round() as i64 + right, v.round() as i64 + down);
            measured.at(u32::try_from(u).ok()?, u32::try_from(v).ok()?.min(DEPTH.height - 1))
        };
        let Some(here) = near(0, 0) else { return false };
        let alike = |z: Option<f32>| z.is_some_and(|z| (z - here).abs() < 0.015 * here);
        (-2..=2).all(|down| (-2..=2).all(|right| alike(near(right, down))))
    };
    let smooth: Vec<bool> = (0..visible.len()).map(|i| visible_inside[i] && seen[i].is_some_and(is_smooth)).collect();
    let (of, holes) = (count(&smooth, &all), count(&smooth, &|i| !is_measured(i)));
    assert!(of > 100_000 && holes == 0, "{holes} holes in {of} visible pixels without an edge");
    let hidden_inside = within(&hidden, 3);
    let (of, shown) = (count(&hidden_inside, &all), count(&hidden_inside, &is_measured));
    assert!(of > 2_000 && shown * 1000 <= of, "{shown} of {of} hidden pixels have depth");
    let (of, made_up) = (count(&hole, &all), count(&hole, &is_measured));
    assert!(of > 300 && made_up == 0, "{made_up} of {of} pixels of the unmeasured place have depth");
    // What is off lies along silhouettes, where a coarse pixel belongs to one side or the other.
    let (of, off) = (count(&visible, &is_measured), count(&visible, &is_off));
    assert!(off * 100 < of * 3, "{off} of {of} pixels are more than 1 mm off");
    let mut errors: Vec<f32> = (0..truth.metres.len())
        .filter(|i| visible_inside[*i])
        .map(|i| (depth.metres[i] - truth.metres[i]).abs())
        .collect();
    errors.sort_by(f32::total_cmp);
    let median = errors[errors.len() / 2];
    assert!(median < 5e-5, "the median is {median} m off");
    eprintln!(
        "registered depth: median {median:.1e} m off, {off} of {of} pixels more than 1 mm, {shown} hidden pixels shown"
    );
}

/// Depth noise as of a stereo camera opens no gaps.
#[test]
fn noise_makes_no_holes() {
    let wall = (0..DEPTH.width * DEPTH.height).map(|i| {
        let mixed = i.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x9e37_79b9) >> 16;
        0.5 + 0.004 * (mixed as f32 / 65_536.0 - 0.5)
    });
    let wall = DepthImage { width: DEPTH.width, height: DEPTH.height, metres: wall.collect() };
    let beside = Isometry3::translation(-0.05, 0.0, 0.0);
    let depth = DepthRegistration::new(DEPTH, COLOR, beside).expect("cameras").register(&wall).expect("its size");
    let (mut inside, mut holes) = (0, 0);
    for v in 20..340 {
        for u in 20..600 {
            let point = COLOR.unproject(u.into(), v.into(), 0.5);
            let (at_u, at_v) = DEPTH.project(&beside.inverse_transform_point(&point)).expect("ahead");
            if at_u > 3.0 && at_u < 316.0 && at_v > 3.0 && at_v < 284.0 {
                inside += 1;
                holes += u32::from(depth.at(u, v).is_none());
            }
        }
    }
    assert!(inside > 100_000 && holes * 2000 < inside, "{holes} holes in {inside} pixels");
}

#[test]
fn the_same_camera_gives_the_same_depth_and_a_point_at_the_lens_nothing() {
    let depth =
        DepthImage { width: 8, height: 6, metres: (0..48).map(|i| if i % 9 == 0 { 0.0 } else { 0.5 }).collect() };
    let k = Intrinsics { width: 8, height: 6, fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5 };
    let same = DepthRegistration::new(k, k, Isometry3::identity()).expect("cameras");
    assert_eq!(same.register(&depth).expect("its size"), depth);
    // The colour camera is where the surface is, or past it.
    for ahead in [-0.5, -0.499_999, -0.7] {
        let registration = DepthRegistration::new(k, k, Isometry3::translation(0.0, 0.0, ahead)).expect("cameras");
        assert!(registration.register(&depth).expect("its size").metres.iter().all(|z| *z == 0.0));
    }
    assert!(same.register(&DepthImage { width: 6, height: 8, metres: vec![0.5; 48] }).is_err());
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert!(DepthRegistration::new(k, k, nowhere).is_err());
}
