//! glTF 2.0 and GLB by the `gltf` crate: the default scene's triangles with base colour and its texture.
//!
//! Accessors are decoded here with every bound checked, because the crate's own iterators trust the file. glTF is
//! y-up, the table is z-up: `(x, y, z)` becomes `(x, -z, y)`.

use std::path::Path;

use glam::{Mat4, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use image::RgbImage;

use super::{Piece, bytes, glb};
use crate::percent;
use semascan_inspection::source::SourceError;

/// Deepest nesting of nodes; deeper files are cyclic or hostile.
const MAX_DEPTH: usize = 64;
/// Most nodes visited; a directed graph can repeat nodes without end.
const MAX_NODES: usize = 100_000;

struct File<'a> {
    folder: &'a Path,
    buffers: Vec<Vec<u8>>,
    pieces: Vec<Piece>,
    visited: usize,
}

/// Each node with a mesh, by its name.
pub(super) fn read(path: &Path) -> Result<Vec<Piece>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let data = bytes(path)?;
    let unusable = |e: String| refuse(format!("is no usable glTF: {e}"));
    let (json, mut blob) = glb::split(&data).map_err(unusable)?;
    glb::check_attributes(json).map_err(unusable)?;
    let gltf = gltf::Gltf::from_slice(json).map_err(|e| unusable(e.to_string()))?;
    let mut file =
        File { folder: path.parent().unwrap_or(Path::new(".")), buffers: Vec::new(), pieces: Vec::new(), visited: 0 };
    for buffer in gltf.document.buffers() {
        let content = match buffer.source() {
            gltf::buffer::Source::Bin => {
                let chunk = blob.take().ok_or_else(|| "has no binary chunk".to_owned());
                chunk.map(<[u8]>::to_vec)
            }
            gltf::buffer::Source::Uri(uri) => file.resource(uri),
        };
        let content = content.map_err(|e| refuse(format!("buffer {}: {e}", buffer.index())))?;
        if content.len() < buffer.length() {
            return Err(refuse(format!("buffer {}: {} bytes of {}", buffer.index(), content.len(), buffer.length())));
        }
        file.buffers.push(content);
    }
    let scene = gltf.document.default_scene().or_else(|| gltf.document.scenes().next());
    let scene = scene.ok_or_else(|| refuse("has no scene".into()))?;
    let upright = Mat4::from_cols_array_2d(&[[1., 0., 0., 0.], [0., 0., 1., 0.], [0., -1., 0., 0.], [0., 0., 0., 1.]]);
    for node in scene.nodes() {
        file.visit(&node, upright, 0).map_err(refuse)?;
    }
    Ok(file.pieces)
}

impl File<'_> {
    fn resource(&self, uri: &str) -> Result<Vec<u8>, String> {
        // The crate takes percent sequences on trust.
        percent::decode(uri).ok_or_else(|| format!("URI {uri:?} has a bad % sequence"))?;
        let data = gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), Some(self.folder));
        data.map(|d| d.0).map_err(|e| e.to_string())
    }

    fn visit(&mut self, node: &gltf::Node<'_>, parent: Mat4, depth: usize) -> Result<(), String> {
        self.visited += 1;
        if depth > MAX_DEPTH || self.visited > MAX_NODES {
            return Err(format!("node {}: nodes nest without end", node.index()));
        }
        let placed = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            let name = node.name().or(mesh.name()).map_or_else(|| format!("node {}", node.index()), str::to_owned);
            for primitive in mesh.primitives() {
                let piece = self.primitive(&primitive, placed, &name);
                let place = || format!("mesh {} primitive {}", mesh.index(), primitive.index());
                self.pieces.extend(piece.map_err(|e| format!("{}: {e}", place()))?);
            }
        }
        node.children().try_for_each(|child| self.visit(&child, placed, depth + 1))
    }

    fn primitive(&self, primitive: &gltf::Primitive<'_>, placed: Mat4, name: &str) -> Result<Option<Piece>, String> {
        if primitive.mode() != Mode::Triangles {
            return Ok(None);
        }
        let positions = primitive.get(&gltf::Semantic::Positions).ok_or("has no positions")?;
        let positions: Vec<Vec3> = self.floats(&positions, 3)?.chunks_exact(3).map(Vec3::from_slice).collect();
        let indices = match primitive.indices() {
            Some(accessor) => self.indices(&accessor)?,
            None => (0..positions.len() as u32).collect(),
        };
        // A mirrored node turns its triangles inside out.
        let mirrored = placed.determinant() < 0.0;
        let turn = |t: [u32; 3]| if mirrored { [t[0], t[2], t[1]] } else { t };
        let triangles: Vec<[u32; 3]> = indices.chunks_exact(3).map(|t| turn([t[0], t[1], t[2]])).collect();
        let material = primitive.material().pbr_metallic_roughness();
        let [r, g, b, _] = material.base_color_factor();
        let mut uvs = Vec::new();
        let mut texture = None;
        if let Some(info) = material.base_color_texture()
            && let Some(accessor) = primitive.get(&gltf::Semantic::TexCoords(info.tex_coord()))
        {
            // glTF's v runs downwards.
            let flat = self.floats(&accessor, 2)?;
            let at = |i: u32| {
                let i = 2 * i as usize;
                flat.get(i..i + 2).map_or(Vec2::ZERO, |c| Vec2::new(c[0], 1.0 - c[1]))
            };
            uvs = triangles.iter().map(|t| t.map(at)).collect();
            texture = Some(self.image(&info.texture().source())?);
        }
        Ok(Some(Piece {
            name: name.to_owned(),
            positions: positions.into_iter().map(|p| placed.transform_point3(p).to_array()).collect(),
            triangles,
            uvs,
            colours: match primitive.get(&gltf::Semantic::Colors(0)) {
                Some(accessor) => self.colours(&accessor)?,
                None => Vec::new(),
            },
            base: Some(Vec3::new(r, g, b).clamp(Vec3::ZERO, Vec3::ONE)),
            texture,
            semantics: Vec::new(),
        }))
    }

    fn image(&self, image: &gltf::Image<'_>) -> Result<RgbImage, String> {
        let encoded = match image.source() {
            gltf::image::Source::Uri { uri, .. } => self.resource(uri),
            gltf::image::Source::View { view, .. } => self.view(&view).map(<[u8]>::to_vec),
        };
        let decoded = encoded.and_then(|e| image::load_from_memory(&e).map_err(|e| e.to_string()));
        decoded.map(|i| i.to_rgb8()).map_err(|e| format!("image {}: {e}", image.index()))
    }

    fn colours(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<Vec3>, String> {
        let channels = accessor.dimensions().multiplicity();
        let flat = self.floats(accessor, channels)?;
        // glTF's vertex colours are linear already.
        Ok(flat.chunks_exact(channels).filter_map(|c| Some(Vec3::from_slice(c.get(..3)?))).collect())
    }

    fn view(&self, view: &gltf::buffer::View<'_>) -> Result<&[u8], String> {
        let buffer = self.buffers.get(view.buffer().index()).ok_or("names a buffer that is not there")?;
        let end = view.offset().checked_add(view.length()).ok_or("has an impossible length")?;
        buffer.get(view.offset()..end).ok_or_else(|| format!("buffer view {} leaves its buffer", view.index()))
    }

    /// Bytes of each element of an accessor.
    fn elements(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<&[u8]>, String> {
        let fail = |what: &str| format!("accessor {} {what}", accessor.index());
        if accessor.sparse().is_some() {
            return Err(fail("is sparse, which is not supported"));
        }
        let view = accessor.view().ok_or_else(|| fail("has no buffer view"))?;
        let data = self.view(&view)?;
        let size = accessor.size();
        let stride = view.stride().unwrap_or(size).max(1);
        let element = |i: usize| {
            let start = i.checked_mul(stride)?.checked_add(accessor.offset())?;
            data.get(start..start.checked_add(size)?)
        };
        if accessor.count() > data.len() {
            return Err(fail("leaves its buffer view"));
        }
        (0..accessor.count()).map(element).collect::<Option<_>>().ok_or_else(|| fail("leaves its buffer view"))
    }

    /// All numbers of a vector accessor as floats, normalized integers included.
    fn floats(&self, accessor: &gltf::Accessor<'_>, width: usize) -> Result<Vec<f32>, String> {
        if accessor.dimensions().multiplicity() != width || accessor.dimensions() == Dimensions::Mat2 {
            return Err(format!("accessor {} is not a vector of {width}", accessor.index()));
        }
        let elements = self.elements(accessor)?.into_iter().flat_map(|e| e.chunks_exact(accessor.data_type().size()));
        let number: fn(&[u8]) -> f32 = match accessor.data_type() {
            DataType::F32 => |b| b.try_into().map_or(f32::NAN, f32::from_le_bytes),
            DataType::U8 => |b| f32::from(b[0]) / 255.0,
            DataType::U16 => |b| b.try_into().map_or(f32::NAN, |b| f32::from(u16::from_le_bytes(b)) / 65535.0),
            other => {
                return Err(format!("accessor {} holds {other:?}, not floats", accessor.index()));
            }
        };
        Ok(elements.map(number).collect())
    }

    fn indices(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, String> {
        if accessor.dimensions() != Dimensions::Scalar {
            return Err(format!("accessor {} is no list of indices", accessor.index()));
        }
        let number: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |b| u32::from(b[0]),
            DataType::U16 => |b| b.try_into().map_or(u32::MAX, |b| u32::from(u16::from_le_bytes(b))),
            DataType::U32 => |b| b.try_into().map_or(u32::MAX, u32::from_le_bytes),
            other => {
                return Err(format!("accessor {} holds {other:?}, not indices", accessor.index()));
            }
        };
        Ok(self.elements(accessor)?.into_iter().map(number).collect())
    }
}
