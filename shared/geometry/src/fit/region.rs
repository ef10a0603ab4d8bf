//! The points that an element is fitted to: a region of the mesh that grows from a vertex as far as the element reaches.
//!
//! A patch around the vertex, up to the next crease, gives a first element; vertices that touch the region, lie on the element
//! and face as it does are taken in, and the element is fitted again, farther and farther [Besl 1988]. A small patch of a large
//! cylinder does not show its radius, and a large one crosses the edges of a small hole: several sizes are tried, and the one
//! whose region becomes largest counts. The outermost ring of the region is left out, where the mesh is rounded.
//!
//! A circle is the rim of a plane: of the rims of the region around the vertex the one next to it.

use super::element::{Element, ElementKind};
use super::{Fit, FitError, SurfaceErrors, SurfacePoint};
use crate::mesh::adjacency::{Lists, neighbours};
use nalgebra::Vector3;
use semascan_model::SemanticMesh;
use std::ops::Deref;

/// Radii of the first patch, voxels.
const PATCHES: [f64; 3] = [4.5, 8.0, 14.0];
/// Cosine between normals side by side below which there is a crease: 35 degrees.
const CREASE: f64 = 0.82;
/// Cosine between the normal of a vertex and that of the element below which it does not belong to it: 25 degrees.
const FACING: f64 = 0.906;
/// Rounds of growing; each reaches twice as far as the one before.
const ROUNDS: usize = 9;
/// Fewest vertices of a region, and of a rim.
const FEWEST: usize = 12;
/// Standard uncertainty of the place of an edge, which the mesh rounds, across it, voxels.
const EDGE: f64 = 0.35;

/// A mesh whose regions are looked for; `M` refers to it.
pub struct MeshRegions<M> {
    mesh: M,
    neighbours: Lists,
    voxel: f64,
}

/// A region, and the element that was fitted to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Its vertices, in order.
    pub vertices: Vec<u32>,
    /// The element.
    pub fit: Fit,
}

impl<M: Deref<Target = SemanticMesh>> MeshRegions<M> {
    /// Prepares `mesh`, which was made of voxels of edge `voxel` (metres). Faces with a vertex that is not there are left out.
    pub fn new(mesh: M, voxel: f64) -> Self {
        let whole: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| mesh.corners(**t).is_some()).copied().collect();
        let neighbours = neighbours(mesh.len(), &whole);
        Self { mesh, neighbours, voxel }
    }

    /// The region around the vertex `seed` that lies on an element of this kind.
    ///
    /// # Errors
    /// [`FitError`] where there is none.
    pub fn grow(&self, seed: u32, kind: ElementKind, errors: &SurfaceErrors) -> Result<Region, FitError> {
        if seed as usize >= self.mesh.len() {
            return Err(FitError::TooFewPoints);
        }
        if kind == ElementKind::Circle {
            return self.rim(seed, errors);
        }
        let tried = PATCHES.map(|radius| self.grow_from(seed, kind, radius * self.voxel, errors));
        // Where none becomes an element, the largest patch says why.
        let refusal = tried.iter().filter_map(|one| one.as_ref().err()).last().copied();
        let largest = tried.into_iter().flatten().max_by_key(|region| region.fit.used);
        largest.ok_or(refusal.unwrap_or(FitError::NotThisForm))
    }

    /// The mesh.
    pub fn mesh(&self) -> &SemanticMesh {
        &self.mesh
    }

    /// Edges of the mesh that lead from a region (its vertices in order) out of it, as the vertices inside and outside.
    pub fn rim_edges(&self, region: &[u32]) -> Vec<[u32; 2]> {
        let is_out = |v: &u32| region.binary_search(v).is_err();
        let edges = region.iter().flat_map(|v| self.neighbours.of(*v as usize).iter().map(|w| [*v, *w]));
        edges.filter(|[_, outer]| is_out(outer)).collect()
    }

    /// The region up to creases around the vertex `seed`, whatever its form; vertices in order.
    pub fn up_to_creases(&self, seed: u32) -> Vec<u32> {
        self.flood(seed, |from, to| self.normal(from).dot(&self.normal(to)) > CREASE)
    }

    fn grow_from(
        &self,
        seed: u32,
        kind: ElementKind,
        radius: f64,
        errors: &SurfaceErrors,
    ) -> Result<Region, FitError> {
        let middle = self.position(seed);
        let facing = self.normal(seed);
        let patch = self.flood(seed, |from, to| {
            let turns = kind != ElementKind::Plane || self.normal(to).dot(&facing) > CREASE;
            turns && (self.position(to) - middle).norm() < radius && self.normal(from).dot(&self.normal(to)) > CREASE
        });
        let mut fit = Fit::new(kind, &SurfacePoint::of_vertices(&self.mesh, &patch), errors)?;
        let (mut vertices, mut reach) = (patch, 2.0 * radius);
        for _ in 0..ROUNDS {
            let grown = self.on_element(seed, &fit.element, reach, errors.tolerance)?;
            fit = Fit::new(kind, &SurfacePoint::of_vertices(&self.mesh, &self.inner(&grown)), errors)?;
            let is_done = grown.len() == vertices.len();
            vertices = grown;
            if is_done {
                break;
            }
            reach *= 2.0;
        }
        Ok(Region { vertices, fit })
    }

    /// The vertices around `seed` that lie on an element within `reach` and face as it does.
    fn on_element(&self, seed: u32, element: &Element, reach: f64, tolerance: f64) -> Result<Vec<u32>, FitError> {
        let middle = self.position(seed);
        let facing = |v: u32| Some(element.normal_at(&self.position(v))?.dot(&self.normal(v)));
        // A hole faces inwards.
        let sign = if facing(seed).unwrap_or(0.0) < 0.0 { -1.0 } else { 1.0 };
        let belongs = |v: u32| {
            let position = self.position(v);
            (position - middle).norm() < reach
                && element.distance(&position).abs() < tolerance
                && facing(v).is_some_and(|cosine| sign * cosine > FACING)
        };
        // The vertex that was picked may be rough itself; what lies around it begins the region.
        let begin = std::iter::once(&seed).chain(self.neighbours.of(seed as usize)).find(|v| belongs(**v));
        let region = self.flood(*begin.ok_or(FitError::NotThisForm)?, |_, to| belongs(to));
        if region.len() < FEWEST { Err(FitError::TooFewPoints) } else { Ok(region) }
    }

    /// The rim of the plane around `seed` that lies next to it, as a circle.
    fn rim(&self, seed: u32, errors: &SurfaceErrors) -> Result<Region, FitError> {
        let plane = self.grow(seed, ElementKind::Plane, errors)?;
        let mut is_in = vec![false; self.mesh.len()];
        plane.vertices.iter().for_each(|v| is_in[*v as usize] = true);
        let is_rim = |v: u32| is_in[v as usize] && self.neighbours.of(v as usize).iter().any(|w| !is_in[*w as usize]);
        let middle = self.position(seed);
        let away = |v: &u32| (self.position(*v) - middle).norm_squared();
        let mut rim: Vec<u32> = plane.vertices.iter().copied().filter(|v| is_rim(*v)).collect();
        let mut errors = *errors;
        errors.surface = errors.surface.hypot(EDGE * self.voxel);
        errors.tolerance = errors.tolerance.max(self.voxel);
        // The nearest rim that is one: dents of the region are rims, too.
        while let Some(nearest) = rim.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b))) {
            let one = self.flood(nearest, |_, to| is_rim(to));
            rim.retain(|v| one.binary_search(v).is_err());
            if one.len() < FEWEST {
                continue;
            }
            let crossings: Vec<SurfacePoint> = one.iter().flat_map(|v| self.crossings(*v, &is_in)).collect();
            let fit = Fit::new(ElementKind::Circle, &crossings, &errors)?;
            return Ok(Region { vertices: one, fit });
        }
        Err(FitError::TooFewPoints)
    }

    /// Where the edges from a vertex of the region leave it: their middles. They face the vertex.
    fn crossings<'b>(&'b self, v: u32, is_in: &'b [bool]) -> impl Iterator<Item = SurfacePoint> + 'b {
        let position = self.position(v);
        let outside = self.neighbours.of(v as usize).iter().filter(|w| !is_in[**w as usize]);
        outside.map(move |w| {
            let to = self.position(*w);
            let normal = self.normal(v);
            SurfacePoint { position: (position + to) * 0.5, normal, weight: 1.0 }
        })
    }

    /// The vertices of a region all of whose neighbours are in it; the whole region where these are less than half of it.
    fn inner(&self, region: &[u32]) -> Vec<u32> {
        let is_in = |v: &u32| region.binary_search(v).is_ok();
        let inner: Vec<u32> =
            region.iter().copied().filter(|v| self.neighbours.of(*v as usize).iter().all(is_in)).collect();
        if 2 * inner.len() < region.len() { region.to_vec() } else { inner }
    }

    /// The vertices that are reached from `seed` over edges that `passes` (from, to); in order.
    fn flood(&self, seed: u32, passes: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        let mut seen = vec![false; self.mesh.len()];
        seen[seed as usize] = true;
        let (mut open, mut reached) = (vec![seed], Vec::new());
        while let Some(v) = open.pop() {
            reached.push(v);
            for &next in self.neighbours.of(v as usize) {
                if !seen[next as usize] && passes(v, next) {
                    seen[next as usize] = true;
                    open.push(next);
                }
            }
        }
        reached.sort_unstable();
        reached
    }

    fn position(&self, v: u32) -> Vector3<f64> {
        Vector3::from(self.mesh.vertices.positions[v as usize].map(f64::from))
    }

    fn normal(&self, v: u32) -> Vector3<f64> {
        let normal = Vector3::from(self.mesh.vertices.normals[v as usize].map(f64::from));
        normal.try_normalize(0.1).unwrap_or_else(Vector3::zeros)
    }
}
