//! Sets the scene up: part, chuck and turntable in the table frame, with finishes, grime and defects.

use std::path::Path;

use glam::{Affine3A, Mat3, Vec2, Vec3};
use nalgebra::Point3;
use semascan_formats::unit::is_inspected_size;
use semascan_model::Taxonomy;

use super::appearance::{Finish, Grime};
use super::datum::Datum;
use super::defects::Defects;
use super::dual_contour;
use super::mesh_import::{self, Imported};
use super::part::{Dress, Scene, SceneMesh, Tag};
use super::random::Stream;
use super::starter_motor::{COMPONENTS, Component, DEFECTS, StarterMotor, fixture};
use semascan_inspection::source::{SourceError, Turntable};

/// Free space around the part inside the measuring volume, metres.
const MARGIN: f32 = 0.01;
/// How far the measuring volume begins above the face that the part stands on, metres: past noise and pose errors.
const CLEARANCE: f32 = 0.002;

/// A scene and what its source reports of it.
#[derive(Debug)]
pub(super) struct SceneSetup {
    pub(super) scene: Scene,
    pub(super) name: String,
    pub(super) taxonomy: Taxonomy,
    pub(super) turntable: Turntable,
    pub(super) volume: (Point3<f64>, Point3<f64>),
    /// Corners of the part alone, metres.
    pub(super) part_bounds: (Vec3, Vec3),
    pub(super) settings: Vec<(String, String)>,
    /// The planes and cylinders that the part was built of.
    pub(super) datums: Vec<Datum>,
    /// Takes the part's own millimetres to the table frame's metres.
    pub(super) table_from_part: Affine3A,
}

/// Finishes of the station itself: table, chuck, jaws.
pub(super) const STATION: usize = 3;
/// Slots of finishes each component has.
const SLOTS: u16 = 3;

/// A starter motor of `seed` in its chuck, as the virtual cell shows it.
pub(super) fn starter_motor(seed: u64, cell: f32) -> SceneSetup {
    let motor = StarterMotor::new(seed, cell);
    let mut s = Stream::new(seed, "finishes");
    let dress = Dress {
        finishes: motor_finishes(station_finishes(), || Finish::draw(&mut s)),
        textures: Vec::new(),
        grime: Grime::draw(&mut Stream::new(seed, "grime")),
        defects: Defects::draw(&motor, seed),
    };
    dressed_motor(&motor, seed, dress)
}

/// The station's finishes and those of a motor, each drawn by `draw`: one distribution for all components.
pub(super) fn motor_finishes(station: [Finish; STATION], mut draw: impl FnMut() -> Finish) -> Vec<Finish> {
    let mut finishes = Vec::from(station);
    for i in 0..COMPONENTS.len() {
        let (body, fastener, detail) = (draw(), draw(), draw());
        // Housing and solenoid carry plates, the others plastics and rubber.
        finishes.extend([body, fastener, if i < 2 { detail.printed() } else { detail }]);
    }
    finishes
}

/// `motor` in its chuck; `seed` decides how it stands, `dress` (of [`motor_finishes`]) how it looks.
pub(super) fn dressed_motor(motor: &StarterMotor, seed: u64, dress: Dress) -> SceneSetup {
    let mut s = Stream::new(seed, "placement");
    let place = Vec3::new(s.range(-6.0, 6.0), s.range(-6.0, 6.0), fixture::CHUCK_HEIGHT) * 1e-3;
    let yaw = Mat3::from_rotation_z(s.range(0.0, std::f32::consts::TAU));
    let table_from_part = Affine3A::from_mat3_translation(yaw * 1e-3, place);

    let mut mesh = SceneMesh::default();
    for component in &motor.components {
        append(&mut mesh, component, &table_from_part, |slot| match component.class {
            0 => Tag { finish: 1 + u16::from(slot.min(1)), in_truth: true, ..Tag::default() },
            class => {
                let finish = STATION as u16 + (class - 1) * SLOTS + u16::from(slot).min(SLOTS - 1);
                Tag { class, instance: class, finish, texture: 0, in_truth: true }
            }
        });
    }
    let part = bounds(&mesh, |t| t.class != 0);
    add_turntable(&mut mesh);
    let floor = 1e-3 * fixture::CHUCK_HEIGHT + CLEARANCE;
    SceneSetup {
        scene: Scene::new(mesh, dress, table_from_part),
        name: format!("starter motor {seed}"),
        taxonomy: Taxonomy::from_names(&COMPONENTS, &DEFECTS),
        turntable: turntable(),
        volume: volume(part, floor),
        part_bounds: part,
        settings: vec![("motor".into(), motor.description.clone())],
        datums: datums(motor, &table_from_part),
        table_from_part,
    }
}

/// The datum features of a motor's components.
fn datums(motor: &StarterMotor, table_from_part: &Affine3A) -> Vec<Datum> {
    let of = |component: &Component| -> Vec<Datum> {
        let placed = component.solid.datums().iter().map(|(name, surface)| Datum {
            name: name.clone(),
            component: component.class,
            surface: surface.placed(table_from_part),
        });
        placed.collect()
    };
    motor.components.iter().flat_map(of).collect()
}

/// A mesh from a file, standing on the table with its lowest point.
pub(super) fn imported(path: &Path, scale: Option<f32>, seed: u64) -> Result<SceneSetup, SourceError> {
    let read = mesh_import::read(path, scale.map(f64::from))?;
    let Imported { mut mesh, names, colours: colors, textures, scale } = read;
    let scale = scale as f32;
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    for v in &mut mesh.vertices {
        *v = v.map(|x| x * scale);
    }
    let (low, high) = bounds(&mesh, |_| true);
    let extent = high - low;
    if !extent.is_finite() || !is_inspected_size(f64::from(extent.max_element())) {
        return Err(refuse(format!(
            "the part is {:.4} x {:.4} x {:.4} m; between 1 mm and 1 m are expected: set the key unit or scale",
            extent.x, extent.y, extent.z
        )));
    }
    let shift = Vec3::new(-0.5 * (low.x + high.x), -0.5 * (low.y + high.y), 1e-4 - low.z);
    for v in &mut mesh.vertices {
        *v = (Vec3::from_array(*v) + shift).to_array();
    }
    let part = (low + shift, high + shift);
    let mut finishes = Vec::from(station_finishes());
    for tag in &mut mesh.tags {
        tag.finish += STATION as u16;
    }
    finishes.extend(colors.into_iter().map(|c| Finish::plain(c, 0.6)));
    add_turntable(&mut mesh);
    let table_from_part = Affine3A::from_mat3_translation(Mat3::IDENTITY * 1e-3, Vec3::ZERO);
    let stem = path.file_stem().map_or_else(|| "part".into(), |n| n.to_string_lossy().into_owned());
    let names = if names.len() == 1 { vec![stem.clone()] } else { names };
    let dress = Dress { finishes, textures, grime: Grime::none(), defects: Defects::none() };
    Ok(SceneSetup {
        scene: Scene::new(mesh, dress, table_from_part),
        name: stem,
        taxonomy: Taxonomy::from_names(&names, &DEFECTS.map(String::from)),
        turntable: turntable(),
        volume: volume(part, CLEARANCE),
        part_bounds: part,
        settings: vec![("scale".into(), scale.to_string()), ("mesh seed".into(), seed.to_string())],
        datums: Vec::new(),
        table_from_part,
    })
}

/// Table (0), chuck body (1) and jaws (2) of the virtual cell.
pub(super) fn station_finishes() -> [Finish; STATION] {
    [
        Finish::station(Vec3::splat(0.055), 0.5, 0.52, 11),
        Finish::station(Vec3::splat(0.30), 1.0, 0.45, 12),
        Finish::station(Vec3::splat(0.16), 0.9, 0.46, 13),
    ]
}

fn turntable() -> Turntable {
    Turntable { radius: 1e-3 * f64::from(fixture::TABLE_RADIUS), height: 0.0 }
}

fn add_turntable(mesh: &mut SceneMesh) {
    let reach = fixture::TABLE_RADIUS + 4.0;
    let solid = fixture::turntable();
    let (low, high) = (Vec3::new(-reach, -reach, -27.0), Vec3::new(reach, reach, 3.0));
    let disc = Component { class: 0, mesh: dual_contour::mesh(&solid, low, high, 2.4), solid };
    let to_metres = Affine3A::from_scale(Vec3::splat(1e-3));
    append(mesh, &disc, &to_metres, |_| Tag::default());
}

fn append(mesh: &mut SceneMesh, component: &Component, place: &Affine3A, tag: impl Fn(u8) -> Tag) {
    let first = mesh.vertices.len() as u32;
    let net = &component.mesh;
    mesh.vertices.extend(net.positions.iter().map(|p| place.transform_point3(*p).to_array()));
    let normals: Vec<Vec3> = net.normals.iter().map(|n| place.transform_vector3(*n).normalize_or(Vec3::Z)).collect();
    for t in &net.triangles {
        mesh.triangles.push(t.map(|i| i + first));
        let [a, b, c] = t.map(|i| net.positions[i as usize]);
        let face = place.transform_vector3((b - a).cross(c - a)).normalize_or_zero();
        // A vertex on an edge has no one normal: each side keeps its own.
        mesh.normals.push(t.map(|i| if normals[i as usize].dot(face) > 0.88 { normals[i as usize] } else { face }));
        mesh.uvs.push([Vec2::ZERO; 3]);
        mesh.tags.push(tag(net.slots[t[0] as usize]));
    }
}

fn bounds(mesh: &SceneMesh, of: impl Fn(&Tag) -> bool) -> (Vec3, Vec3) {
    let triangles = mesh.triangles.iter().zip(&mesh.tags).filter(|(_, tag)| of(tag));
    triangles.flat_map(|(t, _)| t).fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &i| {
        let v = Vec3::from_array(mesh.vertices[i as usize]);
        (low.min(v), high.max(v))
    })
}

fn volume((low, high): (Vec3, Vec3), floor: f32) -> (Point3<f64>, Point3<f64>) {
    let point = |v: Vec3| Point3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z));
    let (low, high) = (point(low - Vec3::splat(MARGIN)), point(high + Vec3::splat(MARGIN)));
    (Point3::new(low.x, low.y, f64::from(floor)), high)
}
