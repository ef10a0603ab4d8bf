//! What page and mesh worker tell each other, each message as one block of bytes that is transferred.
//!
//! Layout, little endian: one byte of kind, three of padding, then the body. Both ends are the same build: the layout is no
//! public contract, but lengths are checked all the same.

use crate::columns;
use crate::link::{DecodedChunk, LinkEvent, transfer};
use semascan_model::{PointFlags, SemanticCloud, SemanticMesh};

/// What the page wants.
#[derive(Clone, Debug)]
pub enum Order {
    /// The model is empty.
    Clear,
    /// A chunk of the model has this content.
    Chunk(Box<DecodedChunk>),
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
        /// Its content.
        bytes: Vec<u8>,
    },
    /// Compare with nothing.
    Forget,
}

/// How far a mesh deviates from a reference. Lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Mean of the signed deviations.
    pub mean: f32,
    /// Root of their mean square.
    pub rms: f32,
    /// 95th percentile of their sizes.
    pub p95: f32,
    /// Least and greatest.
    pub range: [f32; 2],
}

/// What the worker says.
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
    Mesh(Box<SemanticMesh>),
    /// Meshing was stopped.
    Cancelled,
    /// There will be no mesh.
    Failed(String),
    /// A file was read and is compared with.
    Reference {
        /// Name of the file.
        name: String,
        /// Triangles; 0 for a cloud.
        triangles: u32,
        /// Vertices or points.
        points: u32,
        /// Whether its numbers were taken for millimetres.
        millimetres: bool,
    },
    /// A file could not be compared with.
    NoReference(String),
    /// The mesh was compared: a signed deviation for each vertex, metres.
    Deviation {
        /// One value a vertex; NaN where there is none.
        of_vertices: Vec<f32>,
        /// All of them in figures.
        figures: Deviation,
    },
}

/// A block that is not what the other side makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message between page and mesh worker is broken")]
pub struct Broken;

impl Order {
    /// The order as bytes.
    pub fn encode(self) -> Vec<u8> {
        match self {
            Self::Clear => vec![0, 0, 0, 0],
            Self::Chunk(chunk) => block(1, &transfer::encode(&LinkEvent::Chunk(*chunk))),
            Self::Gone(id) => block(2, bytemuck::cast_slice(&id)),
            Self::Mesh => vec![3, 0, 0, 0],
            Self::Cancel => vec![4, 0, 0, 0],
            Self::Reference { name, bytes } => {
                let mut all = block(5, &(name.len() as u32).to_le_bytes());
                all.extend_from_slice(name.as_bytes());
                all.extend_from_slice(&bytes);
                all
            }
            Self::Forget => vec![6, 0, 0, 0],
        }
    }

    /// The order that `bytes` hold.
    ///
    /// # Errors
    /// [`Broken`] if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Result<Self, Broken> {
        let mut reader = Reader(bytes);
        Ok(match reader.kind()? {
            0 => Self::Clear,
            1 => match transfer::decode(reader.0) {
                Ok(LinkEvent::Chunk(chunk)) => Self::Chunk(chunk.into()),
                _ => return Err(Broken),
            },
            2 => {
                let id = reader.column::<i32>(3)?;
                Self::Gone([id[0], id[1], id[2]])
            }
            3 => Self::Mesh,
            4 => Self::Cancel,
            5 => {
                let n = reader.number()?;
                let name = String::from_utf8_lossy(&reader.column::<u8>(n)?).into_owned();
                Self::Reference { name, bytes: reader.0.to_vec() }
            }
            6 => Self::Forget,
            _ => return Err(Broken),
        })
    }
}

impl Reply {
    /// The reply as bytes.
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Self::Progress { done, total } => block(0, bytemuck::cast_slice(&[*done, *total])),
            Self::Mesh(mesh) => encode_mesh(mesh),
            Self::Cancelled => vec![2, 0, 0, 0],
            Self::Failed(reason) => block(3, reason.as_bytes()),
            Self::Reference { name, triangles, points, millimetres } => {
                let mut all = block(4, bytemuck::cast_slice(&[*triangles, *points, u32::from(*millimetres)]));
                all.extend_from_slice(name.as_bytes());
                all
            }
            Self::NoReference(reason) => block(5, reason.as_bytes()),
            Self::Deviation { of_vertices, figures: f } => {
                let mut all = block(6, bytemuck::cast_slice(&[f.mean, f.rms, f.p95, f.range[0], f.range[1]]));
                all.extend_from_slice(bytemuck::cast_slice(of_vertices));
                all
            }
        }
    }

    /// The reply that `bytes` hold.
    ///
    /// # Errors
    /// [`Broken`] if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Result<Self, Broken> {
        let mut reader = Reader(bytes);
        let text = |reader: &Reader<'_>| String::from_utf8_lossy(reader.0).into_owned();
        Ok(match reader.kind()? {
            0 => {
                let n = reader.column::<u32>(2)?;
                Self::Progress { done: n[0], total: n[1] }
            }
            1 => Self::Mesh(Box::new(decode_mesh(&mut reader)?)),
            2 => Self::Cancelled,
            3 => Self::Failed(text(&reader)),
            4 => {
                let n = reader.column::<u32>(3)?;
                Self::Reference { name: text(&reader), triangles: n[0], points: n[1], millimetres: n[2] != 0 }
            }
            5 => Self::NoReference(text(&reader)),
            6 => {
                let f = reader.column::<f32>(5)?;
                let figures = Deviation { mean: f[0], rms: f[1], p95: f[2], range: [f[3], f[4]] };
                Self::Deviation { of_vertices: reader.column(reader.0.len() / 4)?, figures }
            }
            _ => return Err(Broken),
        })
    }
}

fn block(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![kind, 0, 0, 0];
    bytes.extend_from_slice(body);
    bytes
}

fn encode_mesh(mesh: &SemanticMesh) -> Vec<u8> {
    let v = &mesh.vertices;
    let mut bytes = block(1, bytemuck::cast_slice(&[mesh.len() as u32, mesh.triangles.len() as u32]));
    let columns: [&[u8]; 12] = [
        bytemuck::cast_slice(&mesh.triangles),
        bytemuck::cast_slice(&v.positions),
        bytemuck::cast_slice(&v.normals),
        bytemuck::cast_slice(&v.confidence),
        bytemuck::cast_slice(&v.defect_confidence),
        bytemuck::cast_slice(&v.sigma),
        bytemuck::cast_slice(&v.defect_sigma),
        bytemuck::cast_slice(&v.labels),
        bytemuck::cast_slice(&v.defects),
        bytemuck::cast_slice(&v.instances),
        bytemuck::cast_slice(&v.views),
        bytemuck::cast_slice(&v.colors),
    ];
    columns.iter().for_each(|column| bytes.extend_from_slice(column));
    let flags: Vec<u16> = (0..mesh.len()).map(|i| mesh.flags(i).0).collect();
    bytes.extend_from_slice(bytemuck::cast_slice(&flags));
    bytes
}

fn decode_mesh(reader: &mut Reader<'_>) -> Result<SemanticMesh, Broken> {
    let (n, triangles) = (reader.number()?, reader.number()?);
    let triangles: Vec<[u32; 3]> = reader.column(triangles)?;
    let mut vertices = SemanticCloud {
        positions: reader.column(n)?,
        normals: reader.column(n)?,
        confidence: reader.column(n)?,
        defect_confidence: reader.column(n)?,
        sigma: reader.column(n)?,
        defect_sigma: reader.column(n)?,
        labels: reader.column(n)?,
        defects: reader.column(n)?,
        instances: reader.column(n)?,
        views: reader.column(n)?,
        colors: reader.column(n)?,
        flags: reader.column::<u16>(n)?.into_iter().map(PointFlags).collect(),
    };
    let boundary = vertices.flags.iter().map(|f| f.has(PointFlags::BOUNDARY)).collect();
    vertices.flags.iter_mut().for_each(|f| f.0 &= !PointFlags::BOUNDARY);
    if !reader.0.is_empty() || triangles.iter().flatten().any(|v| *v as usize >= n) {
        return Err(Broken);
    }
    Ok(SemanticMesh { vertices, boundary, triangles })
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn kind(&mut self) -> Result<u8, Broken> {
        Ok(self.column::<u8>(4)?[0])
    }

    fn number(&mut self) -> Result<usize, Broken> {
        Ok(self.column::<u32>(1)?[0] as usize)
    }

    fn column<T: bytemuck::Pod>(&mut self, n: usize) -> Result<Vec<T>, Broken> {
        columns::take(&mut self.0, n).ok_or(Broken)
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests;
