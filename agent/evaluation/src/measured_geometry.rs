//! A model as it lies in a file, cloud or mesh, ready to be compared.

use super::exact::{distance, distance_to_triangle};
use super::sampling::sample;
use semascan_formats::offset::{common_offset, single};
use semascan_formats::{Geometry, ReadError, read_file};
use semascan_geometry::measure::{Nearest, NearestPoints, Neighbour, SurfaceIndex};
use semascan_model::LengthUnit;
use semascan_model::PointFlags;
use semascan_perception::register::Facing;
use std::path::{Path, PathBuf};

/// What is measured to.
#[derive(Clone, Debug)]
pub enum Target {
    /// The nearest point.
    Points(NearestPoints),
    /// The nearest point of a triangle.
    Surface(SurfaceIndex),
}

/// A cloud or a mesh.
#[derive(Clone, Debug)]
pub struct MeasuredGeometry {
    /// Its file.
    pub path: PathBuf,
    /// What is measured from: the cloud's points, or samples of the mesh, metres.
    pub points: Vec<[f32; 3]>,
    /// The same in double precision: distances are computed in it.
    pub exact_points: Vec<[f64; 3]>,
    /// Normals of the points; empty where they are not known.
    pub normals: Vec<[f32; 3]>,
    /// Component class of each point, and whether there is evidence for it; empty where the file has none.
    pub labels: Vec<(u16, bool)>,
    /// Points that were passed over: marked as outliers or background, or not finite.
    pub left_out: usize,
    /// What is measured to.
    pub target: Target,
    /// Positions of what is measured to, in double precision: points or vertices.
    exact_target: Vec<[f64; 3]>,
    /// Triangles of what is measured to.
    target_triangles: Vec<[u32; 3]>,
    /// Component classes of what is measured to, by vertex or point; empty where the file has none.
    pub target_labels: Vec<u16>,
    /// Triangles of a mesh; 0 for a cloud.
    pub triangles: usize,
    /// What one unit of its file was taken for.
    pub scale: Scale,
}

/// What one unit of a file is, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// As the caller said.
    Given(f64),
    /// By the size of what is in the file, or by what the file notes.
    Assumed(LengthUnit),
}

impl Scale {
    /// In metres.
    pub fn in_metres(self) -> f64 {
        match self {
            Self::Given(metres) => metres,
            Self::Assumed(unit) => unit.in_metres(),
        }
    }
}

impl MeasuredGeometry {
    /// Reads a model and the reference that it is compared with: PLY, PCD, OBJ, STL, glTF or GLB, and the metres that the
    /// unit of each is, which is assumed from its size where it is not given; of a mesh, `samples` seeded points are taken.
    /// Both are moved by the [`common_offset`] of the reference.
    ///
    /// # Errors
    /// [`ReadError`] naming the file, also where nothing in it can be measured.
    pub fn read_pair(
        model: (&Path, Option<f64>),
        reference: (&Path, Option<f64>),
        samples: usize,
        seed: u64,
    ) -> Result<[Self; 2], ReadError> {
        let (a, b) = (read(model.0)?, read(reference.0)?);
        let scale = |given: Option<f64>, geometry: &Geometry| {
            given.map_or_else(|| Scale::Assumed(geometry.assumed_unit()), Scale::Given)
        };
        let (scale_a, scale_b) = (scale(model.1, &a), scale(reference.1, &b));
        let offset = common_offset(&b.positions, scale_b.in_metres());
        let of = |path, scale, geometry| Self::new(path, geometry, scale, offset, samples, seed);
        Ok([of(model.0, scale_a, a)?, of(reference.0, scale_b, b)?])
    }

    fn new(
        path: &Path,
        geometry: Geometry,
        scale: Scale,
        offset: [f64; 3],
        samples: usize,
        seed: u64,
    ) -> Result<Self, ReadError> {
        let refuse = |reason: &str| ReadError::Format { file: path.display().to_string(), reason: reason.to_owned() };
        if geometry.positions.is_empty() {
            return Err(refuse("holds no points"));
        }
        let metres = scale.in_metres();
        let positions: Vec<[f64; 3]> =
            geometry.positions.iter().map(|p| [0, 1, 2].map(|axis| p[axis] * metres - offset[axis])).collect();
        let mut model = if geometry.triangles.is_empty() {
            Self::cloud(path, &positions, &geometry)
        } else {
            Self::mesh(path, &positions, &geometry, samples, seed)
        };
        model.scale = scale;
        match (model.points.is_empty(), model.triangles) {
            (false, _) => Ok(model),
            (true, 0) => Err(refuse("holds no point that can be measured: all are marked or not finite")),
            (true, _) => Err(refuse("is a mesh without area: every triangle is degenerate")),
        }
    }

    /// A cloud that is at hand. `normals` may be empty.
    pub fn of_points(name: &str, points: Vec<[f32; 3]>, normals: Vec<[f32; 3]>) -> Self {
        let exact: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        Self {
            path: PathBuf::from(name),
            target: Target::Points(NearestPoints::new(&points)),
            exact_target: exact.clone(),
            target_triangles: Vec::new(),
            exact_points: exact,
            points,
            normals,
            labels: Vec::new(),
            left_out: 0,
            target_labels: Vec::new(),
            triangles: 0,
            scale: Scale::Given(1.0),
        }
    }

    /// A mesh that is at hand, as `samples` seeded points of its surface: what is measured from and to.
    pub fn sampled(name: &str, positions: &[[f32; 3]], triangles: &[[u32; 3]], samples: usize, seed: u64) -> Self {
        let positions: Vec<[f64; 3]> = positions.iter().map(|p| p.map(f64::from)).collect();
        let samples = sample(&positions, triangles, samples, seed);
        let normals = samples.iter().map(|s| s.normal).collect();
        Self::of_points(name, samples.iter().map(|s| s.position.map(|c| c as f32)).collect(), normals)
    }

    /// What registration may know of the points' sides.
    pub fn facing(&self) -> Facing<'_> {
        if self.normals.iter().any(|n| *n != [0.0; 3]) { Facing::Normals(&self.normals) } else { Facing::Unknown }
    }

    /// "cloud" or "mesh".
    pub fn kind(&self) -> &'static str {
        if self.triangles > 0 { "mesh" } else { "cloud" }
    }

    /// Distance of each query to the model, and the vertex or point nearest to it; `None` where it is not finite. What is
    /// nearest is found in single precision, how far it is in double.
    pub fn nearest(&self, queries: &[[f64; 3]]) -> Vec<Option<(f64, u32)>> {
        let rough = single(queries);
        let at = |v: u32| self.exact_target.get(v as usize).copied();
        match &self.target {
            Target::Points(index) => {
                let exact = |(query, found): (&[f64; 3], Option<Neighbour>)| {
                    let found = found?;
                    Some((distance(*query, at(found.index)?), found.index))
                };
                queries.iter().zip(index.nearest_of_all(&rough)).map(exact).collect()
            }
            Target::Surface(index) => {
                let exact = |(query, found): (&[f64; 3], Option<Nearest>)| {
                    let found = found?;
                    let [a, b, c] = self.target_triangles.get(found.triangle as usize)?.map(at);
                    Some((distance_to_triangle(*query, [a?, b?, c?]), found.vertex))
                };
                queries.iter().zip(index.closest_of_all(&rough)).map(exact).collect()
            }
        }
    }

    fn cloud(path: &Path, positions: &[[f64; 3]], geometry: &Geometry) -> Self {
        let kept: Vec<usize> = (0..positions.len())
            .filter(|&i| positions[i].iter().all(|c| c.is_finite() && c.abs() < 1e9))
            .filter(|&i| geometry.flags.get(i).is_none_or(|flags| !flags.has(PointFlags::LEFT_OUT)))
            .collect();
        let exact: Vec<[f64; 3]> = kept.iter().map(|&i| positions[i]).collect();
        let points = single(&exact);
        let label = |&i: &usize| {
            let label = *geometry.labels.get(i)?;
            Some((label, geometry.confidence.get(i).map_or(label != 0, |c| *c > 0.0)))
        };
        let labels: Vec<(u16, bool)> = kept.iter().filter_map(label).collect();
        Self {
            path: path.to_owned(),
            target: Target::Points(NearestPoints::new(&points)),
            target_labels: labels.iter().map(|l| l.0).collect(),
            normals: kept.iter().filter_map(|&i| geometry.normals.get(i).copied()).collect(),
            left_out: positions.len() - points.len(),
            labels,
            exact_target: exact.clone(),
            target_triangles: Vec::new(),
            exact_points: exact,
            points,
            triangles: 0,
            scale: Scale::Given(1.0),
        }
    }

    fn mesh(path: &Path, positions: &[[f64; 3]], geometry: &Geometry, samples: usize, seed: u64) -> Self {
        let samples = sample(positions, &geometry.triangles, samples, seed);
        let of = |v: u32| geometry.labels.get(v as usize).map(|l| (*l, *l != 0));
        Self {
            path: path.to_owned(),
            points: samples.iter().map(|s| s.position.map(|c| c as f32)).collect(),
            exact_points: samples.iter().map(|s| s.position).collect(),
            normals: samples.iter().map(|s| s.normal).collect(),
            labels: samples.iter().filter_map(|s| of(s.vertex)).collect(),
            left_out: 0,
            target: Target::Surface(SurfaceIndex::new(&single(positions), &geometry.triangles)),
            exact_target: positions.to_vec(),
            target_triangles: geometry.triangles.clone(),
            triangles: geometry.triangles.len(),
            target_labels: geometry.labels.clone(),
            scale: Scale::Given(1.0),
        }
    }
}

/// Reads a file and says what of it is left out.
fn read(path: &Path) -> Result<Geometry, ReadError> {
    let geometry = read_file(path)?;
    for warning in &geometry.warnings {
        tracing::warn!("{}: {warning}", path.display());
    }
    Ok(geometry)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, content: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        (folder, path)
    }

    const CLOUD: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty ushort label\nproperty float confidence\n\
        property ushort flags\nend_header\n0 0 0 0 0 1 1 0.5 0\n1 0 0 0 0 1 2 0 0\n2 0 0 0 0 1 2 1 1\n4000000000 0 0 0 0 1 2 1 0\n";

    #[test]
    fn marked_and_lost_points_are_passed_over() {
        let (_folder, path) = written("a.ply", CLOUD);
        let [model, _] = MeasuredGeometry::read_pair((&path, Some(1.0)), (&path, Some(1.0)), 10, 1).expect("a cloud");
        assert_eq!((model.kind(), model.points.len(), model.left_out), ("cloud", 2, 2));
        assert_eq!(model.labels, [(1, true), (2, false)]);
        assert!(matches!(model.facing(), Facing::Normals([[0.0, 0.0, 1.0], _])));
    }

    #[test]
    fn what_cannot_be_measured_is_named() {
        let nowhere = CLOUD.replace("0 0 0 0 0 1 1 0.5 0\n1 0 0", "-5000000000 0 0 0 0 1 1 0.5 0\n1 3000000000 0");
        let empty = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n";
        let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
        for (name, content, word) in [
            ("nan.ply", nowhere.as_str(), "not finite"),
            ("cut.ply", &CLOUD[..CLOUD.len() - 30], "vertex"),
            ("none.ply", empty, "no points"),
            ("none.obj", "", "no points"),
            ("flat.obj", flat, "without area"),
            ("a.xyz", "1 2 3\n", "none of"),
            ("bad.pcd", "FIELDS x\n", "DATA"),
        ] {
            let (_folder, path) = written(name, content);
            let message =
                MeasuredGeometry::read_pair((&path, Some(1.0)), (&path, Some(1.0)), 10, 1).expect_err(name).to_string();
            assert!(message.contains(name) && message.contains(word), "{message}");
        }
    }

    #[test]
    fn a_unit_that_nobody_says_is_assumed_and_noted() {
        let square = |edge: f64| format!("v 0 0 0\nv {edge} 0 0\nv {edge} {edge} 0\nf 1 2 3\n");
        let (_folder, metres) = written("m.obj", &square(0.2));
        let (_other, millimetres) = written("mm.obj", &square(200.0));
        let pair = |b| MeasuredGeometry::read_pair((&metres, None), (&millimetres, b), 100, 1).expect("two triangles");
        let [a, b] = pair(None);
        assert_eq!((a.scale, b.scale), (Scale::Assumed(LengthUnit::Metres), Scale::Assumed(LengthUnit::Millimetres)));
        assert!(b.nearest(&a.exact_points).into_iter().flatten().all(|(distance, _)| distance < 1e-6));
        let [_, inches] = pair(Some(LengthUnit::Inches.in_metres()));
        assert_eq!(inches.scale, Scale::Given(0.0254));
    }

    #[test]
    fn a_shift_far_from_the_origin_is_measured() {
        let square = |x: f64| {
            let vertices = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|[u, v]| format!("v {} {} {v}\n", 500_000.0 + x, 5_400_000.0 + u));
            vertices.concat() + "f 1 2 3 4\n"
        };
        let (_folder, path) = written("a.obj", &square(0.0));
        let (_other, shifted) = written("b.obj", &square(0.005));
        let [a, b] = MeasuredGeometry::read_pair((&path, None), (&shifted, None), 100, 1).expect("two squares");
        for (distance, _) in b.nearest(&a.exact_points).into_iter().flatten() {
            assert!((distance - 0.005).abs() < 1e-9, "{distance}");
        }
    }

    #[test]
    fn deviations_are_exact_to_a_millionth_wherever_the_site_is() {
        // Points 1 m apart over 40 m, and the same 3, 4 and 12 mm off: 13 mm.
        let cloud = |origin: [f64; 3], by: [f64; 3]| {
            let rows: String = (0..1600)
                .map(|i| [f64::from(i % 40), f64::from(i / 40), f64::from(i % 7) * 0.1])
                .map(|p| [0, 1, 2].map(|a| format!("{:.6}", origin[a] + p[a] + by[a])).join(" ") + "\n")
                .collect();
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1600\nproperty double x\nproperty double y\nproperty double z\n\
                 end_header\n{rows}"
            )
        };
        for origin in [[0.0; 3], [320.0, 75.0, 12.0], [4_000.0, -9_000.0, 120.0], [500_000.0, 5_400_000.0, 200.0]] {
            let (_a, near) = written("a.ply", &cloud(origin, [0.0; 3]));
            let (_b, moved) = written("b.ply", &cloud(origin, [0.003, 0.004, 0.012]));
            let pair = MeasuredGeometry::read_pair((&near, Some(1.0)), (&moved, Some(1.0)), 10, 1);
            let [a, b] = pair.expect("two clouds");
            for found in b.nearest(&a.exact_points) {
                let distance = found.expect("finite").0;
                assert!((distance - 0.013).abs() < 0.013e-6, "{origin:?}: {distance}");
            }
        }
    }
}
