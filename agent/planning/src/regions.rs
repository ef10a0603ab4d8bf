//! Regions of interest on a mesh: connected pieces of one component with one defect, and whole components.

use semascan_model::{ClassDef, SemanticMesh, Taxonomy};
use std::collections::BTreeMap;

/// A piece of surface that is to be looked at. Metres, table frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionOfInterest {
    /// For people: `corrosion on housing`.
    pub name: String,
    /// Component class.
    pub component: u16,
    /// Defect class; 0 for a component as a whole.
    pub defect: u16,
    /// Points on it.
    pub points: Vec<[f32; 3]>,
    /// Their unit normals.
    pub normals: Vec<[f32; 3]>,
    /// The area that each stands for, square metres.
    pub areas: Vec<f64>,
}

impl RegionOfInterest {
    /// Area in square metres.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// Mean of its points, weighted by area.
    pub fn centre(&self) -> [f64; 3] {
        let all = self.area().max(f64::MIN_POSITIVE);
        [0, 1, 2].map(|k| self.points.iter().zip(&self.areas).map(|(p, a)| f64::from(p[k]) * a).sum::<f64>() / all)
    }

    /// Longest edge of its box along the axes.
    pub fn extent(&self) -> f64 {
        let side = |k: usize| {
            let ends = self
                .points
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| (low.min(p[k]), high.max(p[k])));
            f64::from(ends.1 - ends.0)
        };
        [0, 1, 2].map(side).into_iter().fold(0.0, f64::max)
    }
}

/// Connected regions of one component with one defect that are `least` metres long or more, by component, defect and area.
pub fn defect_regions(mesh: &SemanticMesh, taxonomy: &Taxonomy, least: f64) -> Vec<RegionOfInterest> {
    let columns = &mesh.vertices;
    let class = |v: u32| match columns.defects[v as usize] {
        0 => None,
        defect => Some((columns.labels[v as usize], defect)),
    };
    let mut regions: Vec<RegionOfInterest> = connected(mesh, class)
        .into_iter()
        .map(|((component, defect), vertices)| {
            let name = format!("{} on {}", name(&taxonomy.defects, defect), name(&taxonomy.components, component));
            region(mesh, name, (component, defect), &vertices)
        })
        .filter(|region| region.extent() >= least)
        .collect();
    regions.sort_by(|a, b| (a.component, a.defect).cmp(&(b.component, b.defect)).then(b.area().total_cmp(&a.area())));
    regions
}

/// The components of these names, each as one region; a name that the taxonomy does not know is given back.
///
/// # Errors
/// The first name that is no component's.
pub fn named_components(
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    names: &[String],
) -> Result<Vec<RegionOfInterest>, String> {
    let one = |wanted: &String| {
        let class =
            taxonomy.components.iter().find(|c| c.name == *wanted && c.id != 0).ok_or_else(|| wanted.clone())?;
        let vertices: Vec<u32> =
            (0..mesh.len() as u32).filter(|v| mesh.vertices.labels[*v as usize] == class.id).collect();
        Ok(region(mesh, wanted.clone(), (class.id, 0), &vertices))
    };
    names.iter().map(one).collect()
}

fn name(classes: &[ClassDef], class: u16) -> String {
    classes.iter().find(|c| c.id == class).map_or_else(|| format!("class {class}"), |c| c.name.clone())
}

fn region(mesh: &SemanticMesh, name: String, (component, defect): (u16, u16), vertices: &[u32]) -> RegionOfInterest {
    let areas = vertex_areas(mesh);
    let of = |column: &[[f32; 3]]| vertices.iter().map(|v| column[*v as usize]).collect();
    RegionOfInterest {
        name,
        component,
        defect,
        points: of(&mesh.vertices.positions),
        normals: of(&mesh.vertices.normals),
        areas: vertices.iter().map(|v| areas[*v as usize]).collect(),
    }
}

/// A third of the area of the triangles around each vertex.
fn vertex_areas(mesh: &SemanticMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.len()];
    let at = |v: u32| nalgebra::Vector3::from(mesh.vertices.positions[v as usize]).cast::<f64>();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(at);
        let third = (b - a).cross(&(c - a)).norm() / 6.0;
        t.iter().for_each(|v| areas[*v as usize] += third);
    }
    areas
}

/// Connected vertices of the same class, by their first vertex.
fn connected(mesh: &SemanticMesh, class: impl Fn(u32) -> Option<(u16, u16)>) -> Vec<((u16, u16), Vec<u32>)> {
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if class(a).is_some() && class(a) == class(b) {
                beside.entry(a).or_default().push(b);
                beside.entry(b).or_default().push(a);
            }
        }
    }
    let mut pieces = Vec::new();
    while let Some((first, next)) = beside.pop_first() {
        let Some(class) = class(first) else { continue };
        let (mut vertices, mut open) = (vec![first], next);
        while let Some(v) = open.pop() {
            if let Some(next) = beside.remove(&v) {
                vertices.push(v);
                open.extend(next);
            }
        }
        vertices.sort_unstable();
        pieces.push((class, vertices));
    }
    pieces
}
