//! The messages between page and mesh worker, each one block of bytes that is transferred.
//!
//! Layout, little endian: one byte of kind, three of padding, then the body. Both ends are the same build: the layout is no
//! public contract, but lengths are checked all the same.

use super::placement::Mismatch;
use crate::columns;
use crate::opened::{Beside, OpenedModel};
use semascan_model::LengthUnit;
use semascan_model::{SemanticCloud, SemanticMesh, Taxonomy};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What the page asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// The model is empty.
    Clear,
    /// A chunk of the model has this content.
    Chunk {
        /// Chunk coordinates.
        id: [i32; 3],
        /// Voxel edge in metres.
        voxel: f32,
        /// The points, metres, table frame.
        cloud: Box<SemanticCloud>,
    },
    /// A chunk of the model is gone.
    Gone([i32; 3]),
    /// Make the mesh.
    Mesh,
    /// Stop making the mesh.
    Cancel,
    /// Compare with this file from now on.
    Reference {
        /// Name of the file.
        name: String,
        /// Unit of its numbers, if a person says it.
        unit: Option<LengthUnit>,
        /// Its content.
        bytes: Arc<[u8]>,
    },
    /// Compare with nothing.
    Forget,
    /// Read this file: its content is the model from now on.
    Open {
        /// Name of the file.
        name: String,
        /// Its content.
        bytes: Arc<[u8]>,
        /// What was opened with it.
        beside: Vec<Beside>,
    },
}

/// What is said of an opened model before its mesh.
#[derive(Serialize, Deserialize)]
struct OpenedHead {
    name: String,
    taxonomy: Taxonomy,
    voxel: f32,
    remarks: Vec<String>,
}

/// A reference as the panels show it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReferenceInfo {
    /// Name of its file.
    pub name: String,
    /// Triangles; 0 for a cloud.
    pub triangles: u32,
    /// Vertices or points.
    pub points: u32,
    /// What its numbers were taken for.
    pub unit: LengthUnit,
    /// Whether that was guessed from its size.
    pub is_guess: bool,
    /// What the reader of the file had to say, a sentence each.
    pub warnings: Vec<String>,
}

/// How far a mesh deviates from a reference. Lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviationFigures {
    /// Mean of the signed deviations.
    pub mean: f32,
    /// Root of their mean square.
    pub rms: f32,
    /// 95th percentile of their sizes.
    pub p95: f32,
    /// Least and greatest.
    pub range: [f32; 2],
    /// Why they mean nothing, if that is so.
    pub mismatch: Option<Mismatch>,
}

/// What the worker answers.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// So much of the meshing is done.
    Progress {
        /// Tiles done.
        done: u32,
        /// Tiles in all.
        total: u32,
    },
    /// The mesh is made.
    Mesh(Arc<SemanticMesh>),
    /// Meshing was stopped.
    Cancelled,
    /// There will be no mesh.
    Failed(String),
    /// A file was read and is compared with.
    Reference(ReferenceInfo),
    /// A file could not be compared with.
    NoReference(String),
    /// A file was read; where it has triangles, they follow as a mesh, too.
    Opened(Box<OpenedModel>),
    /// A file could not be read.
    NotOpened(String),
    /// The mesh was compared: a signed deviation for each vertex, metres.
    Deviation {
        /// One value a vertex; NaN where there is none.
        of_vertices: Vec<f32>,
        /// All of them in figures.
        figures: DeviationFigures,
    },
}

/// A block that is not what the other side makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message between page and mesh worker is broken")]
pub struct Broken;

impl Request {
    /// The request as bytes.
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Self::Clear => block(0, &[]),
            Self::Chunk { id, voxel, cloud } => {
                let mut bytes = Vec::with_capacity(24 + columns::cloud_bytes(cloud));
                bytes.extend_from_slice(&[1, 0, 0, 0]);
                bytes.extend_from_slice(bytemuck::cast_slice(id));
                bytes.extend_from_slice(&voxel.to_le_bytes());
                bytes.extend_from_slice(&(cloud.len() as u32).to_le_bytes());
                columns::put_cloud(&mut bytes, cloud);
                bytes
            }
            Self::Gone(id) => block(2, &[bytemuck::cast_slice(id)]),
            Self::Mesh => block(3, &[]),
            Self::Cancel => block(4, &[]),
            Self::Reference { name, unit, bytes } => {
                let unit = unit.map_or(u32::MAX, unit_number);
                let lengths = [unit, name.len() as u32];
                block(5, &[bytemuck::cast_slice(&lengths), name.as_bytes(), bytes.as_ref()])
            }
            Self::Forget => block(6, &[]),
            Self::Open { name, bytes, beside } => {
                let mut block = block(7, &[]);
                put(&mut block, name.as_bytes());
                block.extend_from_slice(&(beside.len() as u32).to_le_bytes());
                for (name, bytes) in beside {
                    put(&mut block, name.as_bytes());
                    put(&mut block, bytes);
                }
                block.extend_from_slice(bytes);
                block
            }
        }
    }

    /// The request that `bytes` hold.
    ///
    /// # Errors
    /// [`Broken`] if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Result<Self, Broken> {
        let mut reader = Reader(bytes);
        Ok(match reader.kind()? {
            0 => Self::Clear,
            1 => {
                let (id, voxel, points) = (reader.id()?, reader.column::<f32>(1)?[0], reader.number()?);
                let cloud = reader.cloud(points)?;
                if !reader.0.is_empty() {
                    return Err(Broken);
                }
                Self::Chunk { id, voxel, cloud: cloud.into() }
            }
            2 => Self::Gone(reader.id()?),
            3 => Self::Mesh,
            4 => Self::Cancel,
            5 => {
                let unit = match reader.number()? {
                    none if none == u32::MAX as usize => None,
                    number => Some(unit_of(number)?),
                };
                let name = reader.string()?;
                Self::Reference { name, unit, bytes: reader.0.into() }
            }
            6 => Self::Forget,
            7 => {
                let (name, count) = (reader.string()?, reader.number()?);
                let mut beside = Vec::new();
                for _ in 0..count {
                    let (name, length) = (reader.string()?, reader.number()?);
                    beside.push((name, reader.column::<u8>(length)?.into()));
                }
                Self::Open { name, bytes: reader.0.into(), beside }
            }
            _ => return Err(Broken),
        })
    }
}

impl Reply {
    /// The reply as bytes.
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Self::Progress { done, total } => block(0, &[bytemuck::cast_slice(&[*done, *total])]),
            Self::Mesh(mesh) => {
                let mut bytes = block(1, &[]);
                columns::put_mesh(&mut bytes, mesh);
                bytes
            }
            Self::Cancelled => block(2, &[]),
            Self::Failed(reason) => block(3, &[reason.as_bytes()]),
            Self::Reference(ReferenceInfo { name, triangles, points, unit, is_guess, warnings }) => {
                let numbers = [*triangles, *points, unit_number(*unit), u32::from(*is_guess)];
                let mut bytes = block(4, &[bytemuck::cast_slice(&numbers)]);
                for text in std::iter::once(name).chain(warnings) {
                    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
                    bytes.extend_from_slice(text.as_bytes());
                }
                bytes
            }
            Self::NoReference(reason) => block(5, &[reason.as_bytes()]),
            Self::Opened(model) => {
                let head = OpenedHead {
                    name: model.name.clone(),
                    taxonomy: model.taxonomy.clone(),
                    voxel: model.voxel,
                    remarks: model.remarks.clone(),
                };
                // What is plain data always serialises.
                let head = serde_json::to_vec(&head).unwrap_or_default();
                let mut bytes = block(7, &[&(head.len() as u32).to_le_bytes(), &head]);
                columns::put_mesh(&mut bytes, &model.mesh);
                bytes
            }
            Self::NotOpened(reason) => block(8, &[reason.as_bytes()]),
            Self::Deviation { of_vertices, figures: f } => {
                let (kind, unit, size) = match f.mismatch {
                    None => (0.0, 0.0, 0.0),
                    Some(Mismatch::Unit { ratio, fits }) => (1.0, unit_number(fits) as f32, ratio),
                    Some(Mismatch::Size { ratio }) => (2.0, 0.0, ratio),
                    Some(Mismatch::Place { distance }) => (3.0, 0.0, distance),
                    Some(Mismatch::Surface { median }) => (4.0, 0.0, median),
                };
                let numbers = [f.mean, f.rms, f.p95, f.range[0], f.range[1], kind, unit, size as f32];
                block(6, &[bytemuck::cast_slice(&numbers), bytemuck::cast_slice(of_vertices)])
            }
        }
    }

    /// The reply that `bytes` hold.
    ///
    /// # Errors
    /// [`Broken`] if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Result<Self, Broken> {
        let mut reader = Reader(bytes);
        Ok(match reader.kind()? {
            0 => Self::Progress { done: reader.number()? as u32, total: reader.number()? as u32 },
            1 => Self::Mesh(Arc::new(reader.mesh()?)),
            2 => Self::Cancelled,
            3 => Self::Failed(reader.text()),
            4 => {
                let n = reader.column::<u32>(4)?;
                let (unit, name) = (unit_of(n[2] as usize)?, reader.string()?);
                let mut warnings = Vec::new();
                while !reader.0.is_empty() {
                    warnings.push(reader.string()?);
                }
                let (triangles, points, is_guess) = (n[0], n[1], n[3] != 0);
                Self::Reference(ReferenceInfo { name, triangles, points, unit, is_guess, warnings })
            }
            5 => Self::NoReference(reader.text()),
            7 => {
                let head = reader.string()?;
                let OpenedHead { name, taxonomy, voxel, remarks } = serde_json::from_str(&head).map_err(|_| Broken)?;
                let mesh = reader.mesh()?;
                Self::Opened(Box::new(OpenedModel { name, taxonomy, voxel, remarks, mesh }))
            }
            8 => Self::NotOpened(reader.text()),
            6 => {
                let f = reader.column::<f32>(8)?;
                let size = f64::from(f[7]);
                let mismatch = match f[5] as u32 {
                    0 => None,
                    1 => Some(Mismatch::Unit { ratio: size, fits: unit_of(f[6] as usize)? }),
                    2 => Some(Mismatch::Size { ratio: size }),
                    3 => Some(Mismatch::Place { distance: size }),
                    4 => Some(Mismatch::Surface { median: size }),
                    _ => return Err(Broken),
                };
                let figures = DeviationFigures { mean: f[0], rms: f[1], p95: f[2], range: [f[3], f[4]], mismatch };
                Self::Deviation { of_vertices: reader.column(reader.0.len() / 4)?, figures }
            }
            _ => return Err(Broken),
        })
    }
}

fn unit_number(unit: LengthUnit) -> u32 {
    LengthUnit::ALL.iter().position(|other| *other == unit).unwrap_or(0) as u32
}

fn unit_of(number: usize) -> Result<LengthUnit, Broken> {
    LengthUnit::ALL.get(number).copied().ok_or(Broken)
}

fn block(kind: u8, body: &[&[u8]]) -> Vec<u8> {
    let mut bytes = vec![kind, 0, 0, 0];
    body.iter().for_each(|part| bytes.extend_from_slice(part));
    bytes
}

/// Adds bytes with their length before them.
fn put(block: &mut Vec<u8>, bytes: &[u8]) {
    block.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
    block.extend_from_slice(bytes);
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn kind(&mut self) -> Result<u8, Broken> {
        Ok(self.column::<u8>(4)?[0])
    }

    fn number(&mut self) -> Result<usize, Broken> {
        Ok(self.column::<u32>(1)?[0] as usize)
    }

    fn id(&mut self) -> Result<[i32; 3], Broken> {
        self.column::<i32>(3)?.try_into().map_err(|_| Broken)
    }

    fn column<T: bytemuck::Pod>(&mut self, n: usize) -> Result<Vec<T>, Broken> {
        columns::take(&mut self.0, n).ok_or(Broken)
    }

    fn cloud(&mut self, n: usize) -> Result<SemanticCloud, Broken> {
        columns::take_cloud(&mut self.0, n).ok_or(Broken)
    }

    /// The rest, as a mesh.
    fn mesh(&mut self) -> Result<SemanticMesh, Broken> {
        columns::take_mesh(&mut self.0).filter(|_| self.0.is_empty()).ok_or(Broken)
    }

    /// A text with its length before it.
    fn string(&mut self) -> Result<String, Broken> {
        let length = self.number()?;
        Ok(String::from_utf8_lossy(&self.column::<u8>(length)?).into_owned())
    }

    /// The rest, as text.
    fn text(&self) -> String {
        String::from_utf8_lossy(self.0).into_owned()
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests;
