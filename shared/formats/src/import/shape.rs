//! The bare geometry of a file, whatever its format: what a reference for comparison needs.

use super::{ImportError, gltf, obj, ply, stl};

/// A cloud, or a mesh where there are triangles. In the file's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// A normal for each position, or none at all; not necessarily of unit length, zero where unknown.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Reads a file by the ending of its name: `ply`, `obj`, `stl` or `glb`.
    ///
    /// # Errors
    /// [`ImportError::Unknown`] for other endings, [`ImportError::Format`] if the file is not what it should be.
    pub fn read(name: &str, bytes: &[u8]) -> Result<Self, ImportError> {
        let ending = name.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase()).unwrap_or_default();
        let shape = match ending.as_str() {
            "ply" => {
                let mesh = ply::read(bytes)?.mesh;
                let normals = mesh.vertices.normals;
                let known = normals.iter().any(|n| *n != [0.0; 3]);
                Self {
                    positions: mesh.vertices.positions,
                    normals: if known { normals } else { Vec::new() },
                    triangles: mesh.triangles,
                }
            }
            "obj" => obj::read(bytes)?,
            "stl" => stl::read(bytes)?,
            "glb" => gltf::read(bytes)?,
            _ => return Err(ImportError::Unknown { name: name.to_owned() }),
        };
        let vertices = shape.positions.len();
        match shape.triangles.iter().flatten().find(|v| **v as usize >= vertices) {
            Some(v) => {
                Err(ImportError::Format { format: "mesh", reason: format!("vertex {v} of {vertices} is named") })
            }
            None => Ok(shape),
        }
    }

    /// Longest edge of the box around all finite positions.
    pub fn extent(&self) -> f32 {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in self.positions.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
        (0..3).map(|a| high[a] - low[a]).fold(0.0, f32::max)
    }

    /// Multiplies every position.
    pub fn scale(&mut self, factor: f32) {
        self.positions.iter_mut().flatten().for_each(|c| *c *= factor);
    }
}
