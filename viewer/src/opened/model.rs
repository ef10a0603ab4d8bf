//! Points, surface and classes of a file.

use super::picture::{self, Picture};
use super::spacing;
use crate::words::t;
use glam::Vec3;
use semascan_formats::offset::{common_offset, relative};
use semascan_formats::{Geometry, Piece, ReadError, ply};
use semascan_model::{LengthUnit, SemanticCloud, SemanticMesh, SemanticPoint, Taxonomy};
use std::collections::{BTreeMap, BTreeSet};

/// Most points: a page has 4 GB, and holds each point twice.
const MOST_POINTS: usize = 10_000_000;
/// Most objects that are told apart.
const MOST_CLASSES: usize = 1000;
/// Colour of what has none.
const NO_COLOR: [u8; 3] = [0xb4, 0xb8, 0xbe];
/// Shortest spacing, as a share of the extent: the model is held in cubes of 32, and these must stay few.
const LEAST_SPACING: f32 = 1.0 / 8192.0;
/// Coordinates beyond which single precision counts no voxels any more, metres.
const FARTHEST: f32 = 1e6;

/// Why a file cannot be looked at.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// It could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It holds nothing.
    #[error("{}", t!("file.empty", name = .0))]
    Empty(String),
    /// It holds too much.
    #[error("{}", t!("file.too_many", name, points, most = MOST_POINTS))]
    Large {
        /// Name of the file.
        name: String,
        /// Points or vertices.
        points: usize,
    },
}

/// What a file holds, as a model.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenedModel {
    /// Name of the file.
    pub name: String,
    /// Its classes.
    pub taxonomy: Taxonomy,
    /// Typical distance of its points, metres.
    pub voxel: f32,
    /// What of it was not read or had to be guessed, a sentence each.
    pub remarks: Vec<String>,
    /// Its points, or its surface where it has triangles. Metres.
    pub mesh: SemanticMesh,
}

impl OpenedModel {
    /// The model with what follows from its points.
    ///
    /// * `voxel`: the edge of its voxels, where the file says it.
    pub(super) fn checked(self, voxel: Option<f32>) -> Result<Self, OpenError> {
        let mut model = self;
        let name = &model.name;
        // Points without a place, and vertices that no triangle names.
        let positions = &model.mesh.vertices.positions;
        let is_placed = |p: &[f32; 3]| p.iter().all(|c| c.abs() < FARTHEST);
        if !model.mesh.triangles.is_empty() {
            let mesh = &model.mesh;
            model.mesh = mesh.select(|t| mesh.corners(t).is_some_and(|corners| corners.iter().all(is_placed)));
        } else if !positions.iter().all(is_placed) {
            let placed = model.mesh.vertices.iter().filter(|p| is_placed(&p.position));
            let vertices: SemanticCloud = placed.collect();
            model.mesh = SemanticMesh { boundary: vec![false; vertices.len()], vertices, triangles: Vec::new() };
        }
        let points = model.mesh.len();
        if points == 0 {
            return Err(OpenError::Empty(name.clone()));
        }
        if points > MOST_POINTS {
            return Err(OpenError::Large { name: name.clone(), points });
        }
        if model.mesh.vertices.normals.iter().all(|n| *n == [0.0; 3]) {
            set_normals(&mut model.mesh);
        }
        let positions = &model.mesh.vertices.positions;
        let corners = |of: fn(Vec3, Vec3) -> Vec3| positions.iter().map(|p| Vec3::from(*p)).reduce(of);
        let extent = corners(Vec3::max).zip(corners(Vec3::min)).map_or(0.0, |(high, low)| (high - low).max_element());
        let spacing = voxel
            .or_else(|| spacing::of_edges(positions, &model.mesh.triangles))
            .or_else(|| spacing::of_points(positions, extent));
        // A single point is as large as it likes.
        model.voxel = spacing.unwrap_or(1e-3).max(extent * LEAST_SPACING).max(f32::MIN_POSITIVE);
        Ok(model)
    }

    /// A file of Semascan's own: it says everything that is known of a point.
    pub(super) fn own(name: &str, file: ply::PlyModel) -> Self {
        let mut remarks = file.warnings;
        if file.shift != [0.0; 3] {
            remarks.push(t!("file.far").into());
        }
        Self { name: name.to_owned(), taxonomy: file.taxonomy, voxel: 0.0, remarks, mesh: file.mesh }
    }

    /// Any other file: its objects are the components.
    pub(super) fn foreign(name: &str, geometry: Geometry, pictures: &[Option<Picture>]) -> Self {
        let unit = geometry.assumed_unit();
        let mut remarks = Vec::new();
        // Of glTF metres are the rule, and no guess.
        let is_rule = unit == LengthUnit::Metres && is_gltf(name);
        if geometry.unit.is_none() && !is_rule {
            remarks.push(t!("file.unit_guessed", unit = in_words(unit)));
        }
        let offset = common_offset(&geometry.positions, unit.in_metres());
        if offset != [0.0; 3] {
            remarks.push(t!("file.far").into());
        }
        for (index, texture) in geometry.textures.iter().enumerate() {
            if pictures.get(index).is_none_or(Option::is_none) {
                remarks.push(t!("file.no_picture", name = texture.name));
            }
        }
        let of_pictures = picture::colors(&geometry, pictures);
        if of_pictures.is_some() {
            remarks.push(t!("file.pictures_at_vertices").into());
        }
        let positions = relative(&geometry.positions, unit.in_metres(), offset);
        let Geometry { normals, colors, labels, confidence, flags, triangles, pieces, warnings, .. } = geometry;
        remarks.extend(warnings);
        let (taxonomy, of_pieces) = classes(&pieces, &labels);
        let mut vertices = SemanticCloud::with_capacity(positions.len());
        for (index, position) in positions.into_iter().enumerate() {
            vertices.push(SemanticPoint {
                position,
                normal: normals.get(index).map_or([0.0; 3], |n| Vec3::from(*n).normalize_or_zero().into()),
                color: colors.get(index).map_or(NO_COLOR, |color| color.map(stored)),
                label: labels.get(index).copied().unwrap_or(0),
                confidence: confidence.get(index).copied().unwrap_or(0.0),
                flags: flags.get(index).copied().unwrap_or_default(),
                ..SemanticPoint::UNKNOWN
            });
        }
        for (piece, label) in pieces.iter().zip(of_pieces) {
            let color = piece.base_color.filter(|_| colors.is_empty()).map(|color| color.map(stored));
            for vertex in triangles.get(piece.triangles.clone()).into_iter().flatten().flatten() {
                let vertex = *vertex as usize;
                if let (Some(of_vertex), Some(label)) = (vertices.labels.get_mut(vertex), label) {
                    *of_vertex = label;
                }
                if let (Some(of_vertex), Some(color)) = (vertices.colors.get_mut(vertex), color) {
                    *of_vertex = color;
                }
            }
        }
        for (of_vertex, color) in vertices.colors.iter_mut().zip(of_pictures.into_iter().flatten()) {
            if let Some(color) = color {
                *of_vertex = color.map(stored);
            }
        }
        let mesh = SemanticMesh { boundary: vec![false; vertices.len()], vertices, triangles };
        Self { name: name.to_owned(), taxonomy, voxel: 0.0, remarks, mesh }
    }

    /// The file's name without its ending.
    pub fn part(&self) -> &str {
        self.name.rsplit_once('.').map_or(&self.name, |(part, _)| part)
    }
}

fn is_gltf(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| ["glb", "gltf"].iter().any(|own| ending.eq_ignore_ascii_case(own)))
}

/// The classes, and for each piece its class: where vertices have none, what is called differently is told apart.
fn classes(pieces: &[Piece], labels: &[u16]) -> (Taxonomy, Vec<Option<u16>>) {
    if let Some(most) = labels.iter().max().filter(|most| usize::from(**most) <= MOST_CLASSES) {
        let names: Vec<String> = (1..=*most).map(|class| format!("class {class}")).collect();
        return (Taxonomy::from_names(&names, &[]), vec![None; pieces.len()]);
    }
    let mut numbers: BTreeMap<&str, u16> = BTreeMap::new();
    let mut names: Vec<&str> = Vec::new();
    let of_pieces: Vec<Option<u16>> = pieces
        .iter()
        .map(|piece| {
            // As own files call what has no class.
            if piece.name == "none" {
                return Some(0);
            }
            if piece.name.is_empty() || (names.len() >= MOST_CLASSES && !numbers.contains_key(piece.name.as_str())) {
                return None;
            }
            let next = names.len() as u16 + 1;
            let number = *numbers.entry(&piece.name).or_insert(next);
            if number == next {
                names.push(&piece.name);
            }
            Some(number)
        })
        .collect();
    // One object is no class: it is the part.
    if names.len() < 2 {
        return (Taxonomy::from_names::<&str>(&[], &[]), vec![None; pieces.len()]);
    }
    let mut taxonomy = Taxonomy::from_names(&names, &[]);
    // Their colours, where these tell them apart.
    let colors: BTreeMap<u16, [u8; 3]> = of_pieces
        .iter()
        .zip(pieces)
        .filter_map(|(number, piece)| Some(((*number)?, piece.base_color?.map(stored))))
        .filter(|(number, _)| *number != 0)
        .collect();
    let different: BTreeSet<[u8; 3]> = colors.values().copied().collect();
    if different.len() == names.len() {
        for (number, color) in colors {
            taxonomy.components[usize::from(number)].color = color;
        }
    }
    (taxonomy, of_pieces)
}

/// Normals of the vertices: the mean of those of their triangles by area. Points of a cloud keep none.
fn set_normals(mesh: &mut SemanticMesh) {
    let mut sums = vec![Vec3::ZERO; mesh.len()];
    for triangle in &mesh.triangles {
        let Some([a, b, c]) = mesh.corners(*triangle).map(|corners| corners.map(Vec3::from)) else { continue };
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|vertex| sums[*vertex as usize] += normal);
    }
    mesh.vertices.normals = sums.into_iter().map(|sum| sum.normalize_or_zero().into()).collect();
}

/// A share of linear light as it is stored (sRGB).
fn stored(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let share = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * share).round() as u8
}

fn in_words(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Millimetres => t!("file.millimetres"),
        LengthUnit::Centimetres => t!("file.centimetres"),
        LengthUnit::Metres => t!("file.metres"),
        LengthUnit::Inches => t!("file.inches"),
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use crate::opened::OpenedFile;
    use proptest::prelude::*;
    use semascan_formats::ply::write_cloud;

    impl OpenedModel {
        /// A file alone, without its pictures.
        pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Self, OpenError> {
            OpenedFile::read(name, bytes, &[])?.model(&[])
        }
    }

    #[test]
    fn an_own_file_keeps_everything_that_is_known_of_a_point() {
        let taxonomy = Taxonomy::from_names(&["gear", "housing"], &["wear"]);
        let cloud: SemanticCloud = (0..50)
            .map(|i| SemanticPoint {
                position: [i as f32 * 1e-3, 0.0, 0.0],
                normal: [0.0, 0.0, 1.0],
                color: [i as u8, 2, 3],
                label: 1 + (i % 2) as u16,
                confidence: 0.75,
                defect: 1,
                defect_confidence: 0.5,
                sigma: 0.125,
                views: 4,
                ..SemanticPoint::UNKNOWN
            })
            .collect();
        let mut bytes = Vec::new();
        write_cloud(&mut bytes, &cloud, &taxonomy, &[("voxel".into(), "0.001".into())]).expect("written");
        let opened = OpenedModel::read("motor 7.PLY", &bytes).expect("its own");
        assert_eq!((opened.mesh.vertices, opened.taxonomy), (cloud, taxonomy));
        assert_eq!((opened.voxel, opened.remarks.len(), opened.mesh.triangles.len()), (1e-3, 0, 0));
    }

    #[test]
    fn the_objects_of_a_foreign_mesh_are_its_components() {
        let obj = b"o lid\nv 0 0 0\nv 10 0 0\nv 10 10 0\nf 1 2 3\no base\nv 0 0 5\nv 10 0 5\nv 10 10 5\nf 4 5 6\nv 99 99 99\n";
        let opened = OpenedModel::read("box.obj", obj).expect("a mesh");
        assert_eq!(opened.part(), "box");
        assert_eq!(
            opened.taxonomy.components.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(),
            ["none", "lid", "base"]
        );
        assert_eq!(opened.mesh.vertices.labels, [1, 1, 1, 2, 2, 2]);
        assert_eq!((opened.mesh.triangles.len(), opened.mesh.vertices.normals[0]), (2, [0.0, 0.0, 1.0]));
        assert!((opened.voxel - 0.01).abs() < 1e-6, "{}: millimetres, and said so: {:?}", opened.voxel, opened.remarks);
        assert!(opened.remarks[0].contains(t!("file.millimetres")), "{:?}", opened.remarks);
        let one = OpenedModel::read("box.obj", &obj[..obj.iter().position(|b| *b == b'b').expect("base") - 3]);
        assert_eq!(one.expect("a mesh").taxonomy.components.len(), 1, "one object is the part");
    }

    #[test]
    fn a_cloud_without_anything_is_shown_as_it_is() {
        let mut text = "ply\nformat ascii 1.0\nelement vertex 401\nproperty float x\nproperty float y\nproperty float z\nend_header\n".to_owned();
        (0..400).for_each(|i| text.push_str(&format!("{} {} 0\n", (i % 20) as f32 * 0.01, (i / 20) as f32 * 0.01)));
        text.push_str("nan 0 0\n");
        let opened = OpenedModel::read("scan.ply", text.as_bytes()).expect("a cloud");
        assert_eq!((opened.mesh.len(), opened.mesh.vertices.normals[0]), (400, [0.0; 3]));
        assert!((0.005..0.02).contains(&opened.voxel), "{}", opened.voxel);
    }

    #[test]
    fn what_cannot_be_looked_at_is_refused_by_name() {
        for (name, bytes) in [("a.step", &b"ISO"[..]), ("a.glb", b"glTF"), ("a.obj", b"# nothing"), ("a", b"")] {
            let said = OpenedModel::read(name, bytes).expect_err(name).to_string();
            assert!(said.contains(name), "{said}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_model_or_an_error(
            bytes in proptest::collection::vec(any::<u8>(), 0..400),
            ending in prop::sample::select(vec!["ply", "obj", "stl", "glb", "pcd", "gltf"]),
        ) {
            let head: &[u8] = match ending {
                "ply" => b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                _ => b"",
            };
            if let Ok(opened) = OpenedModel::read(&format!("a.{ending}"), &[head, &bytes].concat()) {
                prop_assert!(opened.voxel > 0.0 && !opened.mesh.is_empty());
                prop_assert!(opened.mesh.vertices.positions.iter().flatten().all(|c| c.is_finite()));
            }
        }
    }
}
