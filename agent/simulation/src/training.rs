//! Training views of one starter motor: everything but its shape is drawn anew for every view.
//!
//! [Remanufacturing paper] takes its training pictures from random points on a part of a sphere with the view jittered;
//! here a window of the picture around the part is rendered at native resolution, with exact labels. A part and a view
//! depend on the seed and their numbers only.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use semascan_model::Taxonomy;

use super::part::Scene;
use super::random::Stream;
use super::randomisation::Randomisation;
use super::sampling::{Target, random_viewpoint};
use super::scene;
use super::starter_motor::{COMPONENTS, DEFECTS, StarterMotor};
use super::station::{ErrorModel, Station};
use semascan_perception::view::{Intrinsics, PoseEvidence, View, ViewTruth, covariance_of_prior};
use std::sync::Arc;

/// The generator's version: pictures of two versions differ for the same seed.
pub const GENERATOR: &str = "virtual-cell 1";

/// Pixels left around a part that fits into its window.
const MARGIN: f64 = 6.0;
/// Standard deviation stated of exact poses: a microradian and a micrometre.
const EXACT: f64 = 1e-6;

/// What training pictures measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingOptions {
    /// Columns and rows of the camera's picture.
    pub size: (u32, u32),
    /// Columns and rows of the window that is rendered; at most `size`.
    pub window: (u32, u32),
    /// Cells of the motor's mesh in millimetres.
    pub cell: f32,
}

impl Default for TrainingOptions {
    fn default() -> Self {
        Self { size: (640, 480), window: (320, 256), cell: 1.2 }
    }
}

/// One motor, ready to be seen in any number of views.
#[derive(Debug)]
pub struct TrainingCell {
    seed: u64,
    options: TrainingOptions,
    randomisation: Randomisation,
    motor: StarterMotor,
    setup: scene::SceneSetup,
    /// Points all over the part, table frame.
    outline: Vec<Point3<f64>>,
}

impl TrainingCell {
    /// Part `part` of the set `seed`.
    pub fn new(seed: u64, part: u32, options: TrainingOptions, randomisation: Randomisation) -> Self {
        let mut s = Stream::new(seed, &format!("training part {part}"));
        let seed = u64::from(s.word()) << 32 | u64::from(s.word());
        let motor = StarterMotor::new(seed, options.cell);
        let dress = randomisation.dress(&mut Stream::new(seed, "dress"), &motor);
        let setup = scene::dressed_motor(&motor, seed, dress);
        let outline = outline(&setup.scene);
        Self { seed, options, randomisation, motor, setup, outline }
    }

    /// The motor's own seed: `virtual:starter-motor?seed=` shows the same shape.
    pub fn part_seed(&self) -> u64 {
        self.seed
    }

    /// A line about the motor.
    pub fn description(&self) -> &str {
        &self.motor.description
    }

    /// Classes of the labels.
    pub fn taxonomy() -> Taxonomy {
        Taxonomy::from_names(&COMPONENTS, &DEFECTS)
    }

    /// The part's own frame (motor axis +z, its rear end at 0) in the table frame, metres.
    pub fn table_from_part(&self) -> Isometry3<f64> {
        let place = self.setup.table_from_part;
        let axis = |v: glam::Vec3A| Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z));
        let m = place.matrix3;
        let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| axis(c).normalize());
        let turn = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&columns));
        Isometry3::from_parts(axis(place.translation).into(), UnitQuaternion::from_rotation_matrix(&turn))
    }

    /// View `index`: the window's colour, depth, exact labels and true pose; its intrinsics are the window's.
    pub fn view(&self, index: u32) -> View {
        let mut s = Stream::new(self.seed, &format!("training view {index}"));
        let dress = self.randomisation.dress(&mut s, &self.motor);
        let mut camera = self.randomisation.camera(&mut s, self.options.size);
        let planned = random_viewpoint(&mut s, self.randomisation.distance, &self.target(&camera.intrinsics));
        let pose = Station::new(self.seed, ErrorModel::NONE).move_to(&planned, index);
        camera.intrinsics = self.window(&mut s, &camera.intrinsics, &pose.table_from_camera);
        let scene = self.setup.scene.dressed(dress);
        let picture = camera.capture(&scene, &pose.table_from_camera, pose.table_angle, s.word());
        View {
            index,
            stamp: None,
            intrinsics: camera.intrinsics,
            rgb: Arc::new(picture.rgb),
            depth: Arc::new(picture.depth),
            pose: PoseEvidence::World {
                table_from_camera: pose.table_from_camera,
                covariance: covariance_of_prior(EXACT, EXACT),
            },
            labels: Some(Arc::new(picture.labels)),
            truth: Some(ViewTruth { table_from_camera: pose.table_from_camera }),
        }
    }

    fn target(&self, k: &Intrinsics) -> Target {
        Target::around(self.setup.part_bounds, k)
    }

    /// A window of the picture: all of the part where it fits, else filled by it.
    fn window(&self, s: &mut Stream, k: &Intrinsics, table_from_camera: &Isometry3<f64>) -> Intrinsics {
        let camera_from_table = table_from_camera.inverse();
        let seen = self.outline.iter().filter_map(|p| k.project(&(camera_from_table * p)));
        let start = ([f64::MAX; 2], [f64::MIN; 2]);
        let (low, high) = seen.fold(start, |(l, h), (u, v)| ([l[0].min(u), l[1].min(v)], [h[0].max(u), h[1].max(v)]));
        let (width, height) = self.options.window;
        let left = place(s, (low[0], high[0]), width, k.width);
        let top = place(s, (low[1], high[1]), height, k.height);
        k.cropped(left, top, width, height)
    }
}

/// First pixel of a window of `length` within a picture of `whole` around a part between two pixels.
fn place(s: &mut Stream, (low, high): (f64, f64), length: u32, whole: u32) -> u32 {
    let (low, high, length) = (low - MARGIN, high + MARGIN, f64::from(length));
    let (a, b) = if high - low <= length { (high - length, low) } else { (low, high - length) };
    let first = f64::from(s.range(a as f32, b as f32)).round();
    first.clamp(0.0, f64::from(whole) - length) as u32
}

/// Some of the part's vertices.
fn outline(scene: &Scene) -> Vec<Point3<f64>> {
    const STRIDE: usize = 29;
    let part = scene.mesh.triangles.iter().zip(&scene.mesh.tags).filter(|(_, tag)| tag.class != 0);
    part.step_by(STRIDE).map(|(t, _)| scene.mesh.vertices[t[0] as usize].map(f64::from)).map(Point3::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const SMALL: TrainingOptions = TrainingOptions { size: (320, 240), window: (160, 128), cell: 3.0 };

    fn cell(seed: u64, part: u32) -> TrainingCell {
        TrainingCell::new(seed, part, SMALL, Randomisation::TRAINING)
    }

    #[test]
    fn views_depend_on_seed_part_and_number_alone() {
        let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        let shoot = |seed, part, threads| {
            pool(threads).install(|| {
                let view = cell(seed, part).view(3);
                (view.rgb, view.depth, view.labels)
            })
        };
        let one = shoot(5, 2, 1);
        assert_eq!(one, shoot(5, 2, 3));
        assert_ne!(one.2, shoot(6, 2, 3).2);
        assert_ne!(one.2, shoot(5, 1, 3).2);
    }

    #[test]
    fn the_window_shows_the_part_in_the_ranges_of_the_paper() {
        let cell = cell(1, 0);
        let (mut looks, mut classes) = (BTreeSet::new(), BTreeSet::new());
        for index in 0..12 {
            let view = cell.view(index);
            assert_eq!(view.rgb.dimensions(), SMALL.window);
            let labels = view.labels.expect("labels");
            let part = labels.components.iter().filter(|c| **c != 0).count();
            assert!(part * 12 > labels.components.len(), "view {index}: {part} pixels of the part");
            classes.extend(labels.components.clone());
            let eye = view.truth.expect("truth").table_from_camera.translation.vector;
            let middle = cell.target(&view.intrinsics).height;
            let distance = (eye - Vector3::new(0.0, 0.0, middle)).norm();
            assert!((0.379..0.681).contains(&distance), "{distance} m");
            let backdrop = view.rgb.get_pixel(0, 0).0;
            looks.insert(backdrop);
        }
        assert_eq!(classes, (0..6).collect(), "every component is seen");
        assert!(looks.len() > 9, "every view has a look of its own");
    }

    #[test]
    fn depth_labels_and_pose_agree() {
        let cell = cell(2, 1);
        let view = cell.view(0);
        let pose = view.truth.expect("truth").table_from_camera;
        let labels = view.labels.expect("labels");
        let (low, high) = cell.setup.part_bounds;
        let (w, mut seen) = (view.intrinsics.width, 0);
        for (i, z) in view.depth.metres.iter().enumerate().filter(|(i, _)| labels.components[*i] != 0) {
            let (u, v) = (i as u32 % w, i as u32 / w);
            let p = pose * view.intrinsics.unproject(f64::from(u), f64::from(v), f64::from(*z));
            let inside = (0..3).all(|k| (f64::from(low[k]) - 4e-3..f64::from(high[k]) + 4e-3).contains(&p[k]));
            seen += usize::from(*z > 0.0 && inside);
        }
        let part = labels.components.iter().filter(|c| **c != 0).count();
        assert!(seen * 2 > part, "{seen} of {part} pixels of the part measured on the part");
    }

    /// Networks were trained on this version's pictures: a change of them needs a new [`GENERATOR`] and new training.
    /// Within the last bits of a platform's mathematics.
    #[test]
    fn the_generator_is_frozen() {
        assert_eq!(GENERATOR, "virtual-cell 1");
        let view = cell(4, 0).view(0);
        let labels = view.labels.expect("labels");
        let count = |class| labels.components.iter().filter(|c| **c == class).count() as f64;
        let pixels = f64::from(SMALL.window.0 * SMALL.window.1);
        let color = view.rgb.as_raw().iter().map(|b| f64::from(*b)).sum::<f64>() / (3.0 * pixels);
        let depth = view.depth.metres.iter().map(|z| f64::from(*z)).sum::<f64>() / pixels;
        let defects = labels.defects.iter().filter(|d| **d != 0).count() as f64;
        let found = [count(1), count(2), count(3), count(4), count(5), defects, color * 10.0, depth * 1e4];
        let frozen = [3247.0, 1337.0, 2483.0, 44.0, 613.0, 286.0, 1478.6, 1779.6];
        assert!(found.iter().zip(frozen).all(|(a, b): (&f64, f64)| (a - b).abs() < 8.0), "{found:?}");
    }

    #[test]
    fn a_window_holds_the_part_or_is_filled_by_it() {
        let mut s = Stream::new(1, "test");
        for _ in 0..100 {
            let first = place(&mut s, (200.0, 300.0), 160, 640);
            assert!(first <= 194 && first + 160 >= 306, "{first}");
            let first = place(&mut s, (100.0, 500.0), 160, 640);
            assert!(first >= 94 && first + 160 <= 506, "{first}");
            assert_eq!(place(&mut s, (-90.0, 10.0), 160, 640), 0, "the picture ends there");
        }
    }
}
