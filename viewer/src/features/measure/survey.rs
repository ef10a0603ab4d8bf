//! From a click on the mesh to an element or an area: the work that a pick asks for beyond the state.

use super::taken::{Line, Taken};
use super::{Kind, Picking, ghost};
use crate::words::t;
use semascan_geometry::fit::{Feature, FitError, MeshRegions, SurfaceErrors};
use semascan_geometry::measure::dimensions::{self, Estimate};
use semascan_geometry::measure::{SurfaceWays, seen_vertex_areas};
use semascan_model::SemanticMesh;
use std::ops::Deref;

/// Standard uncertainty of the convention of areas, a share of the area; of the place of a rim, and the length over which that is
/// alike, voxels: those of findings, in whose budget the sources stand (ARCHITECTURE.md, Findings and verdicts).
const CONVENTION: f64 = 0.015;
const RIM: f64 = 0.45;
const ALIKE: f64 = 5.0;

/// A mesh ready to be surveyed.
pub struct Survey<M> {
    regions: MeshRegions<M>,
    areas: Vec<f64>,
    voxel: f32,
}

impl<M: Deref<Target = SemanticMesh>> Survey<M> {
    /// Prepares `mesh`, which was made of voxels of edge `voxel` (metres).
    pub fn new(mesh: M, voxel: f32) -> Self {
        let areas = seen_vertex_areas(&mesh, voxel);
        Self { regions: MeshRegions::new(mesh, voxel.into()), areas, voxel }
    }

    /// What a click at `place` (metres, table frame) gives for this kind.
    ///
    /// * `before`: what was picked for the measurement before.
    ///
    /// # Errors
    /// In words for the person, why it gives nothing.
    pub fn take(&self, kind: Kind, before: &[Taken], place: [f32; 3]) -> Result<Taken, String> {
        let vertex = self.nearest(place).ok_or(t!("measure.mesh_empty"))?;
        match kind.element() {
            Some(element) => {
                let errors = SurfaceErrors::of_voxels(self.voxel.into());
                let name = kind.element_name();
                let region = self
                    .regions
                    .grow(vertex, element, &errors)
                    .map_err(|error| t!("measure.no_element", element = name, why = why(error)))?;
                let points: Vec<[f32; 3]> = region.vertices.iter().map(|v| self.position(*v)).collect();
                let mut lines = self.rim(&region.vertices);
                lines.extend(ghost::lines(&region.fit.element, &points));
                Ok(Taken {
                    feature: Feature::Fitted(region.fit),
                    figure: None,
                    lines: lines.into(),
                    place,
                    voxel: self.voxel,
                    of: None,
                })
            }
            None if kind == Kind::Along => self.way(before, place),
            None => Ok(self.area(vertex, place)),
        }
    }

    /// The second end of a way along the surface; the first is a point.
    fn way(&self, before: &[Taken], place: [f32; 3]) -> Result<Taken, String> {
        let end = Taken {
            feature: Feature::point(place.map(f64::from), dimensions::grid_uncertainty(self.voxel.into())),
            figure: None,
            lines: std::sync::Arc::default(),
            place,
            voxel: self.voxel,
            of: None,
        };
        let Some(start) = before.first() else { return Ok(end) };
        let ways = SurfaceWays::new(self.regions.mesh(), self.voxel);
        let way = ways.shortest(start.place, place).ok_or(t!("measure.no_way"))?;
        let lines = way.points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        Ok(Taken { figure: Some(way.length), lines, ..end })
    }

    /// The surface up to creases around a vertex.
    fn area(&self, vertex: u32, place: [f32; 3]) -> Taken {
        let region = self.regions.up_to_creases(vertex);
        let value: f64 = region.iter().map(|v| self.areas[*v as usize]).sum();
        let lines = self.rim(&region);
        let length: f64 = lines.iter().map(|[a, b]| f64::from(glam::Vec3::from(*a).distance((*b).into()))).sum();
        let voxel = f64::from(self.voxel);
        let rim = RIM * voxel * (length * ALIKE * voxel).sqrt();
        let area = Estimate { value, standard_uncertainty: rim.hypot(CONVENTION * value) };
        Taken {
            feature: Feature::point(place.map(f64::from), 0.0),
            figure: Some(area),
            lines: lines.into(),
            place,
            voxel: self.voxel,
            of: None,
        }
    }

    /// The edge of a region: in each face that it crosses, from the middle of one crossed edge to that of the other.
    fn rim(&self, region: &[u32]) -> Vec<Line> {
        let mesh = self.regions.mesh();
        let mut is_in = vec![false; mesh.len()];
        region.iter().for_each(|v| is_in[*v as usize] = true);
        let whole = mesh.triangles.iter().filter(|t| mesh.corners(**t).is_some());
        whole
            .filter_map(|t| {
                let crossed: Vec<[f32; 3]> = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
                    .into_iter()
                    .filter(|(a, b)| is_in[*a as usize] != is_in[*b as usize])
                    .map(|(a, b)| middle(self.position(a), self.position(b)))
                    .collect();
                <Line>::try_from(crossed).ok()
            })
            .collect()
    }

    fn nearest(&self, place: [f32; 3]) -> Option<u32> {
        let place = glam::Vec3::from(place);
        let away = |p: &[f32; 3]| glam::Vec3::from(*p).distance_squared(place);
        let positions = &self.regions.mesh().vertices.positions;
        (0..).zip(positions).min_by(|a, b| away(a.1).total_cmp(&away(b.1))).map(|(v, _)| v)
    }

    fn position(&self, v: u32) -> [f32; 3] {
        self.regions.mesh().vertices.positions[v as usize]
    }
}

/// Why an element cannot be fitted, within a sentence.
fn why(error: FitError) -> &'static str {
    match error {
        FitError::TooFewPoints => t!("measure.fit.too_few"),
        FitError::Collinear => t!("measure.fit.line"),
        FitError::ArcTooShort => t!("measure.fit.short"),
        FitError::NotThisForm => t!("measure.fit.form"),
    }
}

fn middle(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    const VOXEL: f32 = 1e-3;

    /// A half pipe of radius 15 mm along x, its vertices a voxel apart.
    fn pipe() -> SemanticMesh {
        let (rows, columns) = (48_u32, 60_u32);
        let mut mesh = SemanticMesh::default();
        for (i, j) in (0..=columns).flat_map(|i| (0..=rows).map(move |j| (i, j))) {
            let (sine, cosine) = (j as f32 / rows as f32 * std::f32::consts::PI).sin_cos();
            // Off by a few hundredths of a voxel, in no order.
            let radius = 15e-3 + 2e-5 * ((i * 7 + j * 13) % 5) as f32 - 4e-5;
            mesh.push(
                SemanticPoint {
                    position: [i as f32 * VOXEL, radius * cosine, radius * sine],
                    normal: [0.0, cosine, sine],
                    label: 1,
                    ..SemanticPoint::UNKNOWN
                },
                false,
            );
        }
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let a = i * (rows + 1) + j;
            mesh.triangles.extend([[a, a + rows + 2, a + rows + 1], [a, a + 1, a + rows + 2]]);
        }
        mesh
    }

    #[test]
    fn a_click_on_a_pipe_gives_its_radius_and_its_wireframe() {
        let mesh = pipe();
        let survey = Survey::new(&mesh, VOXEL);
        let taken = survey.take(Kind::Cylinder, &[], [0.03, 0.0, 15e-3]).expect("a cylinder");
        let Feature::Fitted(fit) = taken.feature else { panic!("an element") };
        let radius = fit.radius().expect("a radius");
        assert!((radius.value - 15e-3).abs() < radius.expanded() && radius.expanded() < 1e-3, "{radius:?}");
        let ends = taken.lines.iter().flatten().map(|p| p[0]);
        assert!(
            ends.clone().fold(f32::MAX, f32::min) < 2e-3 && ends.fold(0.0, f32::max) > 58e-3,
            "as long as the pipe"
        );
        let refused = survey.take(Kind::Circle, &[], [0.03, 0.0, 15e-3]).expect_err("no rim");
        assert!(refused.starts_with("No circle there"), "{refused}");
    }

    #[test]
    fn an_area_is_that_of_the_surface() {
        let mesh = pipe();
        let taken = Survey::new(&mesh, VOXEL).take(Kind::Area, &[], [0.03, 0.0, 15e-3]).expect("an area");
        let area = taken.figure.expect("an area");
        let truth = std::f64::consts::PI * 15e-3 * 60e-3;
        assert!((area.value - truth).abs() < area.expanded() && area.expanded() < 0.05 * truth, "{area:?} for {truth}");
        let survey = Survey::new(&mesh, VOXEL);
        let start = survey.take(Kind::Along, &[], [0.01, 15e-3, 0.0]).expect("a point");
        let end = survey.take(Kind::Along, &[start], [0.05, -15e-3, 0.0]).expect("a way");
        let (length, truth) = (end.figure.expect("a length"), 40e-3_f64.hypot(std::f64::consts::PI * 15e-3));
        assert!((length.value - truth).abs() < length.expanded() && end.lines.len() > 20, "{length:?} for {truth}");
        assert!(Survey::new(&SemanticMesh::default(), VOXEL).take(Kind::Area, &[], [0.0; 3]).is_err());
    }
}
