//! A file that the mesh is compared with: a mesh, or a cloud where it has no triangles.

use super::placement::Extent;
use crate::words::t;
use semascan_formats::offset::{common_offset, relative};
use semascan_formats::{Geometry, ReadError, no_files};
use semascan_geometry::measure::{NearestPoints, PseudoNormals, SurfaceIndex};
use semascan_model::LengthUnit;

/// Why a file is no reference.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// It could not be read.
    #[error(transparent)]
    Import(#[from] ReadError),
    /// It holds nothing to compare with.
    #[error("{}", t!("file.empty", name))]
    Empty {
        /// Name of the file.
        name: String,
    },
}

/// A reference, ready to be measured from.
pub struct Reference {
    /// Name of the file.
    pub name: String,
    /// Triangles; 0 for a cloud.
    pub triangles: usize,
    /// Vertices or points.
    pub points: usize,
    /// What its numbers were taken for.
    pub unit: LengthUnit,
    /// Whether that was guessed from its size: neither its file nor a person said it.
    pub is_guess: bool,
    /// What the reader had to say, a sentence each.
    pub warnings: Vec<String>,
    /// Where it lies.
    pub extent: Extent,
    /// What is taken off all that is compared, in metres: zero unless the reference lies far from the origin.
    offset: [f64; 3],
    index: Index,
}

enum Index {
    Surface(Box<SurfaceIndex>, PseudoNormals),
    Cloud { index: NearestPoints, positions: Vec<[f32; 3]>, normals: Vec<[f32; 3]> },
}

impl std::fmt::Debug for Reference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Reference({}, {} triangles, {} points)", self.name, self.triangles, self.points)
    }
}

impl Reference {
    /// Reads a file; its frame is the table's.
    ///
    /// * `unit`: of its numbers, if a person says it.
    ///
    /// # Errors
    /// [`ReferenceError`] if it cannot be read or holds nothing.
    pub fn read(name: &str, bytes: &[u8], unit: Option<LengthUnit>) -> Result<Self, ReferenceError> {
        let geometry = Geometry::read(name, bytes, &no_files)?;
        let is_guess = unit.is_none() && geometry.unit.is_none();
        let unit = unit.unwrap_or_else(|| geometry.assumed_unit());
        let offset = common_offset(&geometry.positions, unit.in_metres());
        let positions = relative(&geometry.positions, unit.in_metres(), offset);
        let Geometry { normals, triangles, warnings, .. } = geometry;
        let empty = || ReferenceError::Empty { name: name.to_owned() };
        let mut extent = Extent::of(&positions).ok_or_else(empty)?;
        (0..3).for_each(|axis| extent.center[axis] += offset[axis]);
        let (points, count) = (positions.len(), triangles.len());
        let surface = SurfaceIndex::new(&positions, &triangles);
        let index = if surface.is_empty() {
            let index = NearestPoints::new(&positions);
            if index.is_empty() {
                return Err(empty());
            }
            Index::Cloud { index, positions, normals }
        } else {
            Index::Surface(Box::new(surface), PseudoNormals::new(&positions, &triangles))
        };
        Ok(Self { name: name.to_owned(), triangles: count, points, unit, is_guess, warnings, extent, offset, index })
    }

    /// Distances of points from the reference in metres, positive outside (along the reference's normals), negative
    /// inside; from a cloud without normals always positive. NaN where there is none.
    pub fn deviations(&self, points: &[[f32; 3]]) -> Vec<f32> {
        let moved: Vec<[f32; 3]>;
        let points = if self.offset == [0.0; 3] {
            points
        } else {
            moved = points.iter().map(|p| [0, 1, 2].map(|a| (f64::from(p[a]) - self.offset[a]) as f32)).collect();
            &moved
        };
        match &self.index {
            Index::Surface(index, normals) => {
                let found = index.closest_of_all(points);
                let pairs = points.iter().zip(found);
                pairs.map(|(p, n)| n.map_or(f32::NAN, |n| normals.signed_distance(*p, &n))).collect()
            }
            Index::Cloud { index, positions, normals } => {
                let found = index.nearest_of_all(points);
                let mut deviations = Vec::with_capacity(points.len());
                for (p, nearest) in points.iter().zip(found) {
                    let Some(nearest) = nearest else {
                        deviations.push(f32::NAN);
                        continue;
                    };
                    let i = nearest.index as usize;
                    let side = normals
                        .get(i)
                        .map_or(0.0, |normal| (0..3).map(|a| normal[a] * (p[a] - positions[i][a])).sum::<f32>());
                    let distance = nearest.distance() as f32;
                    deviations.push(if side < 0.0 { -distance } else { distance });
                }
                deviations
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;

    /// A square at z = `z` with the normal up, as OBJ, numbers times `unit`.
    fn square(z: f32, unit: f32) -> Vec<u8> {
        let v = |x: f32, y: f32| format!("v {} {} {}\n", x * unit, y * unit, z * unit);
        [v(-1.0, -1.0), v(1.0, -1.0), v(1.0, 1.0), v(-1.0, 1.0), "f 1 2 3 4\n".into()].concat().into_bytes()
    }

    #[test]
    fn deviations_have_a_sign_and_millimetres_are_recognized() {
        let points = [[0.2, 0.1, 0.0013], [0.2, 0.1, -0.0007]];
        for (unit, name) in [(1.0, "m"), (1000.0, "mm")] {
            let reference = Reference::read("plate.obj", &square(0.0, unit), None).expect("valid");
            assert_eq!((reference.triangles, reference.unit.name(), reference.is_guess), (2, name, true));
            let d = reference.deviations(&points);
            assert!((d[0] - 0.0013).abs() < 1e-6 && (d[1] + 0.0007).abs() < 1e-6, "{d:?}");
        }
    }

    #[test]
    fn a_person_has_the_last_word_on_the_unit_and_what_the_reader_says_is_kept() {
        let file = [square(0.0, 1.0), b"usemtl missing\n".to_vec()].concat();
        let reference = Reference::read("plate.obj", &file, Some(LengthUnit::Inches)).expect("valid");
        assert!(!reference.is_guess && reference.unit == LengthUnit::Inches);
        assert!((reference.extent.size[0] - 2.0 * 0.0254).abs() < 1e-6, "{:?}", reference.extent);
        let stl = [&[0; 80][..], &0_u32.to_le_bytes(), &[0; 12], &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]].concat();
        let corners: [f32; 6] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let stl = [stl, corners.iter().flat_map(|c| c.to_le_bytes()).collect(), vec![0; 2]].concat();
        let counted_wrong = Reference::read("a.stl", &stl, None).expect("one triangle");
        assert!(counted_wrong.warnings[0].contains("triangles"), "{:?}", counted_wrong.warnings);
    }

    #[test]
    fn a_cloud_is_measured_to_its_points() {
        let ply = |normal: &str| {
            format!(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                 property float nx\nproperty float ny\nproperty float nz\nend_header\n0 0 0 {normal}\n"
            )
        };
        let below = [[0.0, 0.0, -0.002]];
        let oriented = Reference::read("a.ply", ply("0 0 1").as_bytes(), None).expect("valid");
        assert!((oriented.deviations(&below)[0] + 0.002).abs() < 1e-7);
        let bare = Reference::read("a.ply", ply("0 0 0").as_bytes(), None).expect("valid");
        assert!((bare.deviations(&below)[0] - 0.002).abs() < 1e-7);
    }

    #[test]
    fn what_is_no_reference_is_refused() {
        assert!(Reference::read("a.obj", b"# nothing\n", None).is_err());
        assert!(Reference::read("a.stl", b"solid but no more", None).is_err());
        assert!(Reference::read("a.step", b"ISO-10303-21;", None).is_err());
    }
}
