//! A simulated recording of a turntable by a fixed camera: a part on a disc turns before a room that stands still.
//!
//! This is how people record turntables with a depth camera of the consumer class, and what the virtual cell does not
//! show: the camera does not move, most of the picture is background that stays the same in every view, the disc itself
//! looks the same from every side unless something is printed on it, and depth is as a D435 measures it
//! (`stereo_camera`). Room and turning part are rendered without noise and laid over each other by depth; then the
//! camera measures them together. Truth is kept for evaluation.

mod parts;
mod room;

use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec3};
use image::RgbImage;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::appearance::{Finish, Grime};
use super::backdrop::Backdrop;
use super::camera::{Camera, Picture};
use super::defects::Defects;
use super::domain::Domain;
use super::noise::{gauss, hash2};
use super::part::{Dress, Scene, Tag};
use super::random::Stream;
use super::scene;
use super::stereo_camera;
use parts::{PART, Solids};
use semascan_inspection::planning::look_at;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::view::{
    DepthImage, Intrinsics, PoseEvidence, RecordedLabels, View, ViewTruth, covariance_of_prior,
};

/// Standard deviation of the colours' noise, of 255.
const COLOUR_NOISE: f32 = 3.0;
/// Thickness of the disc, millimetres.
const DISC: f32 = 18.0;
/// Standard deviations of the poses of a posed recording: radians and metres.
const POSED: (f64, f64) = (0.005, 0.002);
/// Radius of the virtual cell's disc, millimetres.
const MOTOR_DISC: f32 = 204.0;
/// Millimetres of the motor's mesh.
const MOTOR_CELL: f32 = 2.4;

/// What stands on the disc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TurntablePart {
    /// An angle with a block and a pin: of no symmetry.
    Bracket,
    /// A round vessel with a handle.
    Mug,
    /// A cylinder with print: its surface is round, its picture is not.
    Can,
    /// A box: the same after half a turn but for its print.
    Carton,
    /// A wheel with twelve teeth and no print: the same after each tooth.
    Gear,
    /// A starter motor in its chuck.
    Motor,
}

/// What the disc looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TurntableDisc {
    /// Something irregular is printed on it.
    Printed,
    /// The same from every side.
    Plain,
}

/// What is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurntableOptions {
    /// What stands on the disc.
    pub part: TurntablePart,
    /// What the disc looks like.
    pub disc: TurntableDisc,
    /// Number of views.
    pub views: u32,
    /// Degrees between two views; a full turn over all views if absent.
    pub step: Option<f64>,
    /// Columns and rows of the pictures.
    pub size: (u32, u32),
    /// Whether the views carry poses of the camera in the turning frame.
    pub posed: bool,
    /// Whether the views carry the part's mask.
    pub masks: bool,
}

/// A recording, as a source of views.
#[derive(Debug)]
pub struct TurntableRecording {
    options: TurntableOptions,
    seed: u64,
    info: SourceInfo,
    turning: Scene,
    room: Picture,
    camera: Camera,
    tablebase_from_camera: Isometry3<f64>,
    /// Radians between two views, with the sign of the turn.
    step: f64,
    next: u32,
}

impl TurntableRecording {
    /// Sets the recording up; everything random depends on `seed`.
    pub fn new(seed: u64, options: TurntableOptions) -> Self {
        let mut s = Stream::new(seed, "turntable");
        let motor = options.part == TurntablePart::Motor;
        let disc_radius = if motor { MOTOR_DISC } else { s.range(105.0, 140.0) };
        let turning = turning_scene(seed, &options, disc_radius, &mut s);
        let mut camera = Domain::Standard.camera(seed, options.size, None);
        camera.lighting.backdrop = Backdrop { color: Vec3::splat(0.12), ..Backdrop::DARK_ROOM };
        let elevation = s.range(24.0, 42.0).to_radians();
        // A motor is larger, and stands higher on its chuck.
        let (distance, height) = if motor { (s.range(0.62, 0.76), 0.06) } else { (s.range(0.48, 0.68), 0.0) };
        let target = Point3::new(0.0, 0.0, height + f64::from(s.range(0.02, 0.05)));
        let (roll, x) = (f64::from(s.range(-0.05, 0.05)), f64::from(-distance * elevation.cos()));
        let eye = target + Vector3::new(x, 0.0, f64::from(distance * elevation.sin()));
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        let tablebase_from_camera = look_at(eye, target) * roll;
        let (solids, finishes) = room::build(&mut s, disc_radius);
        let dress = Dress { finishes, textures: Vec::new(), grime: Grime::none(), defects: Defects::none() };
        let room = Scene::new(solids.mesh, dress, millimetres());
        let room = camera.capture(&room, &tablebase_from_camera, 0.0, s.word());
        let full = 360.0 / f64::from(options.views.max(1));
        let sign = if s.chance(0.5) { 1.0 } else { -1.0 };
        let step = sign * options.step.unwrap_or(full).to_radians();
        let name = format!("{:?}", options.part).to_lowercase();
        let info = SourceInfo {
            uri: format!("simulated turntable {seed}"),
            part: format!("{name} {seed}"),
            taxonomy: Taxonomy::from_names(&[name.as_str()], &[]),
            view_count: Some(options.views),
            turntable: None,
            volume: None,
            no_labels: (!options.masks).then(|| "the recording was made without masks".into()),
            settings: vec![("seed".into(), seed.to_string()), ("step_deg".into(), step.to_degrees().to_string())],
        };
        Self { options, seed, info, turning, room, camera, tablebase_from_camera, step, next: 0 }
    }

    /// Radians that the disc turns between two views, counter-clockwise seen from above.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// True pose of the camera in the frame that turns with the disc: its axis is +z, its upper side at 0.
    pub fn table_from_camera(&self, index: u32) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -self.step * f64::from(index));
        Isometry3::from_parts(Vector3::zeros().into(), turn) * self.tablebase_from_camera
    }

    /// View `index`, whether its turn has come or not; `None` past the last.
    pub fn view(&self, index: u32) -> Option<View> {
        if index >= self.options.views {
            return None;
        }
        let seed = Stream::new(self.seed, &format!("turntable view {index}")).word();
        let pose = self.table_from_camera(index);
        let picture = self.camera.capture(&self.turning, &pose, self.step * f64::from(index), seed);
        let Picture { mut rgb, depth, labels } = laid_over(&self.room, picture);
        add_noise(&mut rgb, seed);
        let intrinsics: Intrinsics = self.camera.intrinsics;
        let depth = stereo_camera::measure(&depth, &intrinsics, seed);
        let (rotation, translation) = POSED;
        let evidence = match self.options.posed {
            true => {
                PoseEvidence::World { table_from_camera: pose, covariance: covariance_of_prior(rotation, translation) }
            }
            false => PoseEvidence::None,
        };
        Some(View {
            index,
            stamp: Some(f64::from(index)),
            intrinsics,
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose: evidence,
            labels: self.options.masks.then(|| Arc::new(labels)),
            truth: Some(ViewTruth { table_from_camera: pose }),
        })
    }
}

impl Source for TurntableRecording {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let view = self.view(self.next)?;
        self.next += 1;
        Some(Ok(view))
    }

    fn rewind(&mut self) -> bool {
        self.next = 0;
        true
    }
}

/// Disc and part in the frame that turns with them.
fn turning_scene(seed: u64, options: &TurntableOptions, disc_radius: f32, s: &mut Stream) -> Scene {
    if options.part == TurntablePart::Motor {
        return scene::starter_motor(seed, MOTOR_CELL).scene;
    }
    let colour = |s: &mut Stream| Vec3::new(s.range(0.1, 0.5), s.range(0.08, 0.5), s.range(0.06, 0.45));
    let print = match options.part {
        TurntablePart::Can | TurntablePart::Carton | TurntablePart::Mug => 0.7,
        TurntablePart::Bracket => 0.15,
        TurntablePart::Gear | TurntablePart::Motor => 0.0,
    };
    let disc_print = if options.disc == TurntableDisc::Printed { 0.7 } else { 0.0 };
    let finishes = vec![Finish::mottled(colour(s), disc_print, s.word()), Finish::mottled(colour(s), print, s.word())];
    let part = Tag { class: PART, instance: PART, finish: 1, texture: 0, in_truth: true };
    let Solids { mesh } = {
        let mut solids = parts::build(options.part, s, part);
        solids.add_prism(Vec3::ZERO, (-DISC, -0.05), 96, |_| disc_radius, true, Tag::default());
        solids
    };
    let dress = Dress { finishes, textures: Vec::new(), grime: Grime::none(), defects: Defects::none() };
    Scene::new(mesh, dress, millimetres())
}

/// From millimetres to metres.
fn millimetres() -> Affine3A {
    Affine3A::from_mat3(Mat3::IDENTITY * 1e-3)
}

/// Each pixel of what is nearer.
fn laid_over(room: &Picture, turning: Picture) -> Picture {
    let Picture { mut rgb, depth, labels } = turning;
    let DepthImage { width, height, mut metres } = depth;
    for (i, z) in metres.iter_mut().enumerate() {
        let behind = room.depth.metres[i];
        if *z <= 0.0 || (behind > 0.0 && behind < *z) {
            *z = behind;
            let (u, v) = (i as u32 % width, i as u32 / width);
            rgb.put_pixel(u, v, *room.rgb.get_pixel(u, v));
        }
    }
    // Where the room stands before the part there is no part to be seen.
    let seen = |i: usize, class: &u16| if room.depth.metres[i] == metres[i] { 0 } else { *class };
    let of = |classes: &[u16]| classes.iter().enumerate().map(|(i, c)| seen(i, c)).collect();
    let labels = RecordedLabels {
        components: of(&labels.components),
        defects: of(&labels.defects),
        instances: of(&labels.instances),
    };
    Picture { rgb, depth: DepthImage { width, height, metres }, labels }
}

fn add_noise(rgb: &mut RgbImage, seed: u32) {
    for (i, value) in rgb.iter_mut().enumerate() {
        let noisy = f32::from(*value) + COLOUR_NOISE * gauss(hash2(seed ^ 0x51c3, i as u32));
        *value = noisy.round().clamp(0.0, 255.0) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: TurntableOptions = TurntableOptions {
        part: TurntablePart::Can,
        disc: TurntableDisc::Printed,
        views: 6,
        step: None,
        size: (160, 120),
        posed: false,
        masks: true,
    };

    #[test]
    fn the_room_stands_still_and_the_part_turns() {
        let recording = TurntableRecording::new(3, OPTIONS);
        let (a, b) = (recording.view(0).expect("a view"), recording.view(2).expect("a view"));
        let labels = a.labels.as_ref().expect("masks");
        let part = labels.components.iter().filter(|c| **c == PART).count();
        assert!(part > 600, "{part} pixels of the part");
        let change = |wanted: u16| {
            let (mut sum, mut count) = (0.0, 0.0);
            let other = &b.labels.as_ref().expect("masks").components;
            for (i, (p, q)) in a.rgb.pixels().zip(b.rgb.pixels()).enumerate() {
                if labels.components[i] == wanted
                    && other[i] == wanted
                    && i % 160 < (if wanted == 0 { 20 } else { 160 })
                {
                    sum += (f64::from(p.0[1]) - f64::from(q.0[1])).abs();
                    count += 1.0;
                }
            }
            sum / count
        };
        assert!(change(PART) > 3.0 * change(0), "{} {}", change(PART), change(0));
    }

    #[test]
    fn truth_carries_one_view_onto_the_other() {
        let options =
            TurntableOptions { posed: true, part: TurntablePart::Bracket, views: 24, size: (320, 240), ..OPTIONS };
        let recording = TurntableRecording::new(5, options);
        let (a, b) = (recording.view(1).expect("a view"), recording.view(2).expect("a view"));
        let (pa, pb) = (recording.table_from_camera(1), recording.table_from_camera(2));
        assert!(a.pose.table_from_camera() == Some(pa) && a.truth.is_some());
        let labels = a.labels.as_ref().expect("masks");
        // Share of the part's points that the second view confirms, if `b_from_a` is the way to it.
        let confirmed = |b_from_a: Isometry3<f64>| {
            let (mut near, mut all) = (0, 0);
            for (i, z) in a.depth.metres.iter().enumerate().filter(|(i, z)| labels.components[*i] == PART && **z > 0.0)
            {
                let p = a.intrinsics.unproject((i % 320) as f64, (i / 320) as f64, f64::from(*z));
                let q = b_from_a * p;
                let Some(at) = b.intrinsics.project(&q).and_then(|(u, v)| b.intrinsics.pixel(u, v)) else { continue };
                all += 1;
                near += usize::from((f64::from(b.depth.metres[at]) - q.z).abs() < 0.004);
            }
            assert!(all > 1000, "{all} points");
            near as f64 / all as f64
        };
        let (turned, still) = (confirmed(pb.inverse() * pa), confirmed(Isometry3::identity()));
        assert!(turned > 0.5 && turned > 1.5 * still, "{turned} turned, {still} still");
    }
}
