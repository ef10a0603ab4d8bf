//! A mesh's triangles by component, for the formats that keep components apart.

use super::WriteError;
use semascan_model::{ClassDef, Color, SemanticMesh, Taxonomy};
use std::collections::BTreeMap;

/// The triangles of one component.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Component class.
    pub label: u16,
    /// Its name.
    pub name: String,
    /// Its colour.
    pub color: Color,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// The components of a mesh in order of their class, each with at least one triangle.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there.
pub fn components(mesh: &SemanticMesh, taxonomy: &Taxonomy) -> Result<Vec<Component>, WriteError> {
    check(mesh)?;
    let mut by_label: BTreeMap<u16, Vec<[u32; 3]>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        by_label.entry(mesh.triangle_label(*triangle)).or_default().push(*triangle);
    }
    let component = |(label, triangles)| {
        let (name, color) = class(&taxonomy.components, label);
        Component { label, name, color, triangles }
    };
    Ok(by_label.into_iter().map(component).collect())
}

/// Name and colour of a class, whether `classes` has it or not.
pub(crate) fn class(classes: &[ClassDef], label: u16) -> (String, Color) {
    match classes.get(usize::from(label)) {
        Some(class) => (class.name.clone(), class.color),
        None => (format!("class {label}"), [128; 3]),
    }
}

/// Refuses a mesh with a triangle that names a vertex it does not have.
pub(crate) fn check(mesh: &SemanticMesh) -> Result<(), WriteError> {
    let vertices = mesh.len();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(WriteError::Vertex { triangle, vertex, vertices });
        }
    }
    Ok(())
}

/// A name as a part of a file name: letters, digits, `-` and `_`.
pub fn file_part(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}
