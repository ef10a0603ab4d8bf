//! The mesh with the colours that it is drawn in.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use semascan_model::{ClassDef, SemanticMesh, Taxonomy};
use std::ops::Range;

/// Share of a defect's colour where it lies on a component.
const DEFECT_SHARE: f32 = 0.85;
/// Share of the class colour in that of a component; the rest is white, so that defects and outlines stand out.
const COMPONENT_SHARE: f32 = 0.72;

/// Triangles of a block: enough that looking at it costs little, few enough that it lies in one place.
const BLOCK: usize = 128;

/// Triangles that follow each other, and the ball that they lie in. The mesher lists triangles place by place, so a picture of
/// one place needs few blocks.
#[derive(Debug)]
pub(crate) struct Block {
    /// Places in [`Scene::triangles`].
    pub(crate) triangles: Range<u32>,
    /// Centre of the ball, table frame, metres.
    pub(crate) centre: Point3<f64>,
    /// Its radius, metres.
    pub(crate) radius: f64,
    /// Where the triangles face in the mean, table frame; its length says nothing.
    pub(crate) facing: Vector3<f64>,
}

/// A mesh, ready to be drawn.
#[derive(Debug)]
pub struct Scene<'a> {
    /// The mesh.
    pub(crate) mesh: &'a SemanticMesh,
    /// Faces whose vertices are there.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// All of them, in their order.
    pub(crate) blocks: Vec<Block>,
    /// Colour of each vertex, linear light, 0 to 1.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Positions of the vertices of faces.
    positions: Vec<[f32; 3]>,
    /// Diagonal of the box around the part, metres.
    diagonal: f64,
}

impl<'a> Scene<'a> {
    /// The mesh in the colours of its classes: components pale, defects full.
    pub fn in_class_colors(mesh: &'a SemanticMesh, taxonomy: &Taxonomy) -> Self {
        let light = |classes: &[ClassDef]| classes.iter().map(|class| class.color.map(linear)).collect::<Vec<_>>();
        let (components, defects) = (light(&taxonomy.components), light(&taxonomy.defects));
        let of_class = |list: &[[f32; 3]], class: u16| list.get(usize::from(class)).copied().unwrap_or([0.26; 3]);
        let mix = |share: f32, a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|k| share * a[k] + (1.0 - share) * b[k]);
        let of = |v: usize| {
            let pale = mix(COMPONENT_SHARE, of_class(&components, mesh.vertices.labels[v]), [1.0; 3]);
            match mesh.vertices.defects[v] {
                0 => pale,
                defect => mix(DEFECT_SHARE, of_class(&defects, defect), pale),
            }
        };
        Self::new(mesh, (0..mesh.len()).map(of).collect())
    }

    /// The mesh without colours, of which only the shape is looked at.
    pub fn of_shape(mesh: &'a SemanticMesh) -> Self {
        Self::new(mesh, vec![[1.0; 3]; mesh.len()])
    }

    fn new(mesh: &'a SemanticMesh, colors: Vec<[f32; 3]>) -> Self {
        let finite = |v: &u32| mesh.vertices.positions[*v as usize].iter().all(|c| c.is_finite());
        let whole = |t: &&[u32; 3]| mesh.corners(**t).is_some() && t.iter().all(finite);
        let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(whole).copied().collect();
        let mut is_used = vec![false; mesh.len()];
        triangles.iter().flatten().for_each(|v| is_used[*v as usize] = true);
        let used = mesh.vertices.positions.iter().zip(&is_used).filter(|(_, is_used)| **is_used);
        let positions: Vec<[f32; 3]> = used.map(|(position, _)| *position).collect();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in &positions {
            low = [0, 1, 2].map(|k| low[k].min(p[k]));
            high = [0, 1, 2].map(|k| high[k].max(p[k]));
        }
        let diagonal = [0, 1, 2].map(|k| f64::from(high[k] - low[k]).powi(2)).iter().sum::<f64>().sqrt();
        let blocks = (0..triangles.len().div_ceil(BLOCK)).into_par_iter().map(|i| block(mesh, &triangles, i)).collect();
        Self { mesh, triangles, blocks, colors, positions, diagonal: if diagonal.is_finite() { diagonal } else { 0.0 } }
    }

    /// Whether the corners of a triangle have the same colour.
    pub(crate) fn is_of_one_color(&self, number: u32) -> bool {
        self.triangles.get(number as usize).is_some_and(|triangle| {
            let [a, b, c] = triangle.map(|v| self.colors[v as usize]);
            a == b && b == c
        })
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Diagonal of the box around the part, metres.
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// Positions of the vertices of faces, table frame, metres.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }
}

/// The block with the number `i` of `triangles`, whose vertices are there and finite.
fn block(mesh: &SemanticMesh, triangles: &[[u32; 3]], i: usize) -> Block {
    let range = i * BLOCK..((i + 1) * BLOCK).min(triangles.len());
    let (mut low, mut high) = (Vector3::repeat(f32::INFINITY), Vector3::repeat(f32::NEG_INFINITY));
    let mut facing = Vector3::zeros();
    for triangle in &triangles[range.clone()] {
        let [a, b, c] = triangle.map(|v| Vector3::from(mesh.vertices.positions[v as usize]));
        (low, high) = (low.inf(&a.inf(&b).inf(&c)), high.sup(&a.sup(&b).sup(&c)));
        facing += (b - a).cross(&(c - a));
    }
    let (low, high) = (low.cast::<f64>(), high.cast::<f64>());
    Block {
        triangles: range.start as u32..range.end as u32,
        centre: Point3::from((low + high) / 2.0),
        radius: (high - low).norm() / 2.0,
        facing: facing.cast(),
    }
}

/// Linear light of an sRGB value (IEC 61966-2-1).
pub(crate) fn linear(value: u8) -> f32 {
    let v = f32::from(value) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// sRGB value of linear light.
pub(crate) fn srgb(light: f32) -> u8 {
    let v = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_and_values_are_inverse() {
        assert!((0..=255).all(|v| srgb(linear(v)) == v));
    }
}
