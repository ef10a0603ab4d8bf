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
use std::collections::HashMap;
use std::ops::Deref;

/// Radii of the first patch, voxels.
const PATCHES: [f64; 4] = [3.0, 5.0, 8.0, 14.0];
/// Cosine between normals side by side below which there is a crease: 20 degrees.
const CREASE: f64 = 0.94;
/// Cosine between the normal of a vertex and that of the element below which it does not belong to it: 18 degrees.
const FACING: f64 = 0.951;
/// Root mean square of the residuals from which on a surface does not follow an element: a multiple of the mesh's roughness.
const NOT_FOLLOWING: f64 = 3.3;
/// Rounds of growing; each reaches twice as far as the one before.
const ROUNDS: usize = 9;
/// Fewest vertices that an element is fitted to: on fewer the rounding of the mesh at their edge has the say.
const FEWEST: usize = 50;
/// Fewest vertices of a region while it grows, and edges of a rim.
const FEWEST_GROWING: usize = 12;
/// Standard uncertainty of the place of an edge, which the mesh rounds, across it, voxels.
const EDGE: f64 = 0.5;
/// The same of one side of a rim against the others, voxels.
const EDGE_SIDE: f64 = 0.25;

/// A mesh whose regions are looked for; `M` refers to it.
pub struct MeshRegions<M> {
    mesh: M,
    neighbours: Lists,
    voxel: f64,
    roughness: f64,
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
        let roughness = roughness(&mesh, &neighbours);
        Self { mesh, neighbours, voxel, roughness }
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
        let refusal = tried.iter().rev().find_map(|one| one.as_ref().err()).copied();
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

    fn grow_from(&self, seed: u32, kind: ElementKind, radius: f64, errors: &SurfaceErrors) -> Result<Region, FitError> {
        let middle = self.position(seed);
        let facing = self.normal(seed);
        let patch = self.flood(seed, |from, to| {
            let turns = kind != ElementKind::Plane || self.normal(to).dot(&facing) > FACING;
            turns && (self.position(to) - middle).norm() < radius && self.normal(from).dot(&self.normal(to)) > CREASE
        });
        // While it grows its place matters alone, not how well that is known.
        let growing = SurfaceErrors { correlation: 0.0, surface: 0.0, poses: 0.0, turn: 0.0, ..*errors };
        let mut fit = Fit::new(kind, &SurfacePoint::of_vertices(&self.mesh, &patch), &growing)?;
        let (mut vertices, mut reach) = (patch, 2.0 * radius);
        for _ in 0..ROUNDS {
            let grown = self.on_element(seed, &fit.element, reach, errors.tolerance)?;
            fit = Fit::new(kind, &SurfacePoint::of_vertices(&self.mesh, &self.inner(&grown)), &growing)?;
            let is_done = grown.len() == vertices.len();
            vertices = grown;
            if is_done {
                break;
            }
            reach *= 2.0;
        }
        let inner = self.inner(&vertices);
        let fit = Fit::new(kind, &SurfacePoint::of_vertices(&self.mesh, &inner), errors)?;
        if fit.used < FEWEST {
            return Err(FitError::TooFewPoints);
        }
        if fit.rms > NOT_FOLLOWING * self.roughness {
            return Err(FitError::NotThisForm);
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
        if region.len() < FEWEST_GROWING { Err(FitError::TooFewPoints) } else { Ok(region) }
    }

    /// The rim of the plane around `seed` that lies next to it, as a circle.
    fn rim(&self, seed: u32, errors: &SurfaceErrors) -> Result<Region, FitError> {
        let plane = self.grow(seed, ElementKind::Plane, errors)?;
        let edges = self.rim_edges(&plane.vertices);
        let crossing = |edge: &[u32; 2]| (self.position(edge[0]) + self.position(edge[1])) * 0.5;
        let middle = self.position(seed);
        let away =
            |rim: &Vec<[u32; 2]>| rim.iter().map(|edge| (crossing(edge) - middle).norm()).fold(f64::INFINITY, f64::min);
        let rims = self.rims(edges).into_iter().filter(|rim| rim.len() >= FEWEST_GROWING);
        let nearest = rims.min_by(|a, b| away(a).total_cmp(&away(b))).ok_or(FitError::TooFewPoints)?;
        let points: Vec<SurfacePoint> = nearest
            .iter()
            .map(|edge| {
                // Across the rim: errors there are alike on one side of the hole.
                let across = (self.position(edge[1]) - self.position(edge[0])).try_normalize(f64::MIN_POSITIVE);
                SurfacePoint { position: crossing(edge), normal: across.unwrap_or_else(Vector3::zeros), weight: 1.0 }
            })
            .collect();
        let mut errors = *errors;
        errors.surface = errors.surface.hypot(EDGE * self.voxel);
        errors.poses = errors.poses.hypot(EDGE_SIDE * self.voxel);
        errors.tolerance = errors.tolerance.max(self.voxel);
        let fit = Fit::new(ElementKind::Circle, &points, &errors)?;
        let mut vertices: Vec<u32> = nearest.iter().map(|edge| edge[0]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        Ok(Region { vertices, fit })
    }

    /// The edges that leave a region, those of each rim together: they follow each other from face to face.
    fn rims(&self, edges: Vec<[u32; 2]>) -> Vec<Vec<[u32; 2]>> {
        let number: HashMap<[u32; 2], usize> = edges.iter().copied().zip(0..).collect();
        let mut beside: Vec<Vec<usize>> = vec![Vec::new(); edges.len()];
        for &[a, b, c] in &self.mesh.triangles {
            let sides = [[a, b], [b, c], [c, a]];
            let mut crossed = sides.iter().filter_map(|&[v, w]| number.get(&[v, w]).or_else(|| number.get(&[w, v])));
            if let (Some(&one), Some(&other)) = (crossed.next(), crossed.next()) {
                beside[one].push(other);
                beside[other].push(one);
            }
        }
        let (mut seen, mut rims) = (vec![false; edges.len()], Vec::new());
        for start in 0..edges.len() {
            let (mut open, mut rim) = (vec![start], Vec::new());
            while let Some(at) = open.pop() {
                if !std::mem::replace(&mut seen[at], true) {
                    rim.push(edges[at]);
                    open.extend(&beside[at]);
                }
            }
            rims.push(rim);
        }
        rims
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

/// How far vertices typically lie from the mean of their neighbours along their normal, metres: what noise is left in the mesh.
fn roughness(mesh: &SemanticMesh, neighbours: &Lists) -> f64 {
    let vector = |v: [f32; 3]| Vector3::from(v.map(f64::from));
    let mut heights: Vec<f64> = (0..mesh.len())
        .filter_map(|v| {
            let around = neighbours.of(v);
            let sum: Vector3<f64> = around.iter().map(|w| vector(mesh.vertices.positions[*w as usize])).sum();
            let height = vector(mesh.vertices.normals[v])
                .dot(&(vector(mesh.vertices.positions[v]) - sum / around.len().max(1) as f64));
            (around.len() > 2 && height.is_finite()).then_some(height.abs())
        })
        .collect();
    if heights.is_empty() {
        return 0.0;
    }
    let middle = heights.len() / 2;
    *heights.select_nth_unstable_by(middle, f64::total_cmp).1
}
