//! The faces of a PLY file, and the triangle strips of scanned models.

use super::header::{Element, Property};
use super::values::Values;
use crate::polygon::Triangulation;

/// Faces as they are in the file, which may name vertices before it has them.
#[derive(Default)]
pub(super) struct Polygons {
    /// Vertex indices of all faces, one after the other.
    corners: Vec<u32>,
    /// End of each face in `corners`.
    ends: Vec<usize>,
}

impl Polygons {
    /// The triangles; what makes none is said.
    pub(super) fn triangles(
        &self,
        positions: &[[f64; 3]],
        warnings: &mut Vec<String>,
    ) -> Result<Vec<[u32; 3]>, String> {
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut triangulation = Triangulation::default();
        let (mut start, mut places, mut flat) = (0, Vec::new(), 0_usize);
        for &end in &self.ends {
            let face = &self.corners[start..end];
            start = end;
            flat += usize::from(face.len() < 3);
            places.clear();
            for &vertex in face {
                let place = positions.get(vertex as usize);
                places.push(*place.ok_or_else(|| format!("a face names vertex {vertex} of {}", positions.len()))?);
            }
            triangles.extend(triangulation.split(&places).iter().map(|t| t.map(|k| face[k as usize])));
        }
        if flat > 0 {
            warnings.push(format!("{flat} faces of fewer than three corners are left out"));
        }
        Ok(triangles)
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }
}

/// Whether a property is the list of a face's corners.
fn is_corners(property: &Property) -> bool {
    property.list.is_some() && ["vertex_indices", "vertex_index"].contains(&property.name.as_str())
}

/// A vertex's number; one past every vertex where there is none such.
fn index(value: f64) -> u32 {
    if value >= 0.0 { value as u32 } else { u32::MAX }
}

/// Reads the faces; the names of properties that are not read go to `unread`.
pub(super) fn faces(
    values: &mut Values<'_>,
    element: &Element,
    polygons: &mut Polygons,
    unread: &mut Vec<String>,
) -> Result<(), String> {
    if element.properties.is_empty() || element.count == 0 {
        return Ok(());
    }
    if !element.properties.iter().any(is_corners) {
        return Err("faces have no vertex_indices".into());
    }
    unread.extend(element.properties.iter().filter(|p| !is_corners(p)).map(|p| format!("face {}", p.name)));
    for number in 0..element.count {
        values.record(&element.name, number, |values| {
            for property in &element.properties {
                match property.list {
                    Some(length) if is_corners(property) => {
                        for _ in 0..values.length(length)? {
                            polygons.corners.push(index(values.next(property.kind)?));
                        }
                        polygons.ends.push(polygons.corners.len());
                    }
                    _ => values.pass(property)?,
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Reads triangle strips: every vertex after the second closes a triangle with the two before it, and -1 begins anew.
pub(super) fn strips(values: &mut Values<'_>, element: &Element, polygons: &mut Polygons) -> Result<(), String> {
    for number in 0..element.count {
        values.record(&element.name, number, |values| {
            for property in &element.properties {
                let Some(length) = property.list.filter(|_| is_corners(property)) else {
                    values.pass(property)?;
                    continue;
                };
                let mut strip: Vec<u32> = Vec::new();
                for _ in 0..values.length(length)? {
                    let value = values.next(property.kind)?;
                    if value < 0.0 {
                        strip.clear();
                        continue;
                    }
                    strip.push(index(value));
                    if let [.., a, b, c] = strip[..]
                        && a != b
                        && b != c
                        && a != c
                    {
                        // Every other triangle of a strip is turned.
                        polygons.triangle(if strip.len() % 2 == 1 { [a, b, c] } else { [b, a, c] });
                    }
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}
