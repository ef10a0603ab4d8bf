//! The reader: points and triangles of the default scene with base colour and its picture.
//!
//! glTF is y up, the table z up: `(x, y, z)` becomes `(x, -z, y)`. Lines are no surface and are left out; compressed and
//! sparse accessors are refused with their name.

use super::accessor::Buffers;
use super::container;
use super::document::{Document, Node, Primitive};
use crate::geometry::{Geometry, MAX_TRIANGLES, Piece, PieceTexture, Texture};
use crate::{ReadError, Resolver, percent};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DQuat, DVec3};
use std::borrow::Cow;
use std::collections::HashMap;

/// Deepest nesting of nodes; deeper files are cyclic or hostile.
const MAX_DEPTH: usize = 64;
/// Most nodes visited; a directed graph can repeat nodes without end.
const MAX_NODES: usize = 100_000;
/// Beginnings of the names of extensions that do not change the shape, and those that are read.
const HARMLESS_EXTENSIONS: [&str; 7] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "EXT_mesh_features",
    "EXT_structural_metadata",
];

/// Reads the bytes of the file `name`, GLB or JSON; each primitive of a node is a piece with the node's name.
///
/// # Errors
/// [`ReadError::Format`] if it is no glTF, names what is not there, or keeps its shape in a way that is not read.
pub(crate) fn read(name: &str, bytes: &[u8], files: Resolver<'_>) -> Result<Geometry, ReadError> {
    scene(bytes, files).map_err(|reason| ReadError::format(name, "glTF", &reason))
}

fn scene(bytes: &[u8], files: Resolver<'_>) -> Result<Geometry, String> {
    let (json, binary) = container::split(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(|e| e.to_string())?;
    let harmless = |extension: &String| HARMLESS_EXTENSIONS.iter().any(|known| extension.starts_with(known));
    if let Some(extension) = document.extensions_required.iter().find(|e| !harmless(e)) {
        return Err(format!(
            "it needs the extension {extension}, which is not supported: export it without compression"
        ));
    }
    let buffers = buffers(&document, binary, files)?;
    let scene = document.scenes.get(document.scene.unwrap_or(0)).ok_or("it has no scene")?;
    let mut reader = Reader {
        document: &document,
        buffers: Buffers::new(&document, buffers),
        files,
        geometry: Geometry::default(),
        images: HashMap::new(),
        visited: 0,
    };
    for &node in &scene.nodes {
        reader.visit(node, z_up(), 0)?;
    }
    reader.geometry.drop_unused_vertices();
    Ok(reader.geometry)
}

/// The contents of all buffers. The binary chunk is the first buffer that names no file.
fn buffers<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    files: Resolver<'_>,
) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let mut binary = binary;
    let mut contents = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let content = match &buffer.uri {
            Some(uri) => resource(uri, files).map(Cow::Owned),
            None => binary.take().map(Cow::Borrowed).ok_or_else(|| "there is no binary chunk".to_owned()),
        };
        let content = content.map_err(|e| format!("buffer {index}: {e}"))?;
        if content.len() < buffer.byte_length {
            return Err(format!("buffer {index}: {} bytes of {}", content.len(), buffer.byte_length));
        }
        contents.push(content);
    }
    Ok(contents)
}

/// What a URI names: the data within it, or a file.
fn resource(uri: &str, files: Resolver<'_>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data.split_once(";base64,").ok_or("a data URI that is not base64")?.1;
        return STANDARD.decode(encoded).map_err(|e| format!("a data URI: {e}"));
    }
    let name = percent::decode(uri).ok_or_else(|| format!("URI {uri:?} has a bad % sequence"))?;
    files(&name).map_err(|e| e.to_string())
}

/// Table from glTF.
fn z_up() -> DMat4 {
    DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.])
}

/// A node's `parent_from_node`.
fn transform(node: &Node) -> DMat4 {
    if let Some(columns) = &node.matrix {
        return DMat4::from_cols_array(columns);
    }
    // Files hold rotations in single precision, hence not quite of unit length.
    let rotation = node.rotation.map(DQuat::from_array).filter(|q| q.length_squared() > 0.0).map(DQuat::normalize);
    let three = |value: Option<[f64; 3]>, default: DVec3| value.map_or(default, DVec3::from_array);
    DMat4::from_scale_rotation_translation(
        three(node.scale, DVec3::ONE),
        rotation.unwrap_or(DQuat::IDENTITY),
        three(node.translation, DVec3::ZERO),
    )
}

struct Reader<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    files: Resolver<'a>,
    geometry: Geometry,
    /// Index among the geometry's textures of each image that was asked for.
    images: HashMap<usize, Option<usize>>,
    visited: usize,
}

impl Reader<'_> {
    fn visit(&mut self, index: usize, parent: DMat4, depth: usize) -> Result<(), String> {
        self.visited += 1;
        if depth > MAX_DEPTH || self.visited > MAX_NODES {
            return Err(format!("node {index}: nodes nest without end"));
        }
        let document = self.document;
        let node = document.nodes.get(index).ok_or_else(|| format!("node {index} is not there"))?;
        let placed = parent * transform(node);
        if let Some(mesh_index) = node.mesh {
            let mesh = document.meshes.get(mesh_index).ok_or_else(|| format!("mesh {mesh_index} is not there"))?;
            let name = node.name.as_ref().or(mesh.name.as_ref());
            let name = name.map_or_else(|| format!("node {index}"), String::clone);
            // A skinned mesh is placed by its joints, which leave it where it is until they move (section 3.7.3.3).
            let placed = if node.skin.is_some() { z_up() } else { placed };
            for (k, primitive) in mesh.primitives.iter().enumerate() {
                self.primitive(primitive, placed, &name)
                    .map_err(|e| format!("mesh {mesh_index} primitive {k}: {e}"))?;
            }
        }
        node.children.iter().try_for_each(|&child| self.visit(child, placed, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, placed: DMat4, name: &str) -> Result<(), String> {
        let is_points = primitive.mode == 0;
        if !is_points && !(4..=6).contains(&primitive.mode) {
            return Ok(());
        }
        let positions = *primitive.attributes.get("POSITION").ok_or("it has no POSITION")?;
        let positions = self.buffers.numbers(positions, 3)?;
        // Nodes can repeat a mesh more often than memory can hold it.
        if self.geometry.positions.len().max(self.geometry.triangles.len()) > MAX_TRIANGLES {
            return Err(format!("the scene has more than {MAX_TRIANGLES} triangles or vertices"));
        }
        let positions: Vec<[f64; 3]> =
            positions.chunks_exact(3).map(|p| placed.transform_point3(DVec3::from_slice(p)).to_array()).collect();
        let count = positions.len();
        let first = u32::try_from(self.geometry.positions.len()).map_err(|_| "there are too many vertices")?;
        self.colors(primitive, count)?;
        self.geometry.positions.extend(positions);
        if is_points {
            return Ok(());
        }
        let indices = match primitive.indices {
            Some(accessor) => self.buffers.indices(accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(bad) = indices.iter().find(|i| **i as usize >= count) {
            return Err(format!("a triangle names vertex {bad} of {count}"));
        }
        let mut triangles = triangles(&indices, primitive.mode);
        if placed.determinant() < 0.0 {
            // A mirrored node turns its triangles inside out.
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let piece = self.piece(primitive, name, &triangles)?;
        self.geometry.triangles.extend(triangles.into_iter().map(|t| t.map(|v| first + v)));
        self.geometry.pieces.push(piece);
        Ok(())
    }

    /// Adds the vertex colours, which are linear already; white where only other primitives have such.
    fn colors(&mut self, primitive: &Primitive, count: usize) -> Result<(), String> {
        const WHITE: [f32; 3] = [1.0; 3];
        let colors = &mut self.geometry.colors;
        match primitive.attributes.get("COLOR_0") {
            Some(&accessor) => {
                let numbers = self.buffers.numbers(accessor, 3)?;
                colors.resize(self.geometry.positions.len(), WHITE);
                colors.extend(numbers.chunks_exact(3).map(|c| [c[0] as f32, c[1] as f32, c[2] as f32]).take(count));
                colors.resize(self.geometry.positions.len() + count, WHITE);
            }
            None if colors.is_empty() => {}
            None => colors.resize(self.geometry.positions.len() + count, WHITE),
        }
        Ok(())
    }

    /// The piece of the next `triangles`, and their texture coordinates.
    fn piece(&mut self, primitive: &Primitive, name: &str, triangles: &[[u32; 3]]) -> Result<Piece, String> {
        let first = self.geometry.triangles.len();
        let material = primitive.material.and_then(|m| self.document.materials.get(m));
        let appearance = material.map(|m| &m.pbr_metallic_roughness);
        let [r, g, b, _] = appearance.and_then(|a| a.base_color_factor).unwrap_or([1.0; 4]);
        let mut texture = None;
        if let Some(reference) = appearance.and_then(|a| a.base_color_texture.as_ref())
            && let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{}", reference.tex_coord))
        {
            let flat = self.buffers.numbers(accessor, 2)?;
            // glTF's v runs downwards.
            let at = |i: u32| {
                let i = 2 * i as usize;
                flat.get(i..i + 2).map_or([0.0; 2], |c| [c[0] as f32, 1.0 - c[1] as f32])
            };
            self.geometry.texture_coordinates.resize(first, [[0.0; 2]; 3]);
            self.geometry.texture_coordinates.extend(triangles.iter().map(|t| t.map(at)));
            texture = self.texture(reference.index).map(|index| PieceTexture { index, tinted: true });
        } else if !self.geometry.texture_coordinates.is_empty() {
            self.geometry.texture_coordinates.resize(first + triangles.len(), [[0.0; 2]; 3]);
        }
        Ok(Piece {
            name: name.to_owned(),
            triangles: first..first + triangles.len(),
            base_color: Some([r, g, b].map(|c| c.clamp(0.0, 1.0))),
            texture,
        })
    }

    /// Index of a texture's picture among those of the geometry; `None`, with a warning, where it cannot be opened.
    fn texture(&mut self, index: usize) -> Option<usize> {
        let image = self.document.textures.get(index).and_then(|t| t.source);
        let Some(image) = image else {
            self.geometry
                .warnings
                .push(format!("texture {index} is left out: it is not there, or in a form that is not read"));
            return None;
        };
        if let Some(known) = self.images.get(&image) {
            return *known;
        }
        let found = match self.image(image) {
            Ok(bytes) => {
                self.geometry.textures.push(Texture { name: format!("image {image}"), bytes });
                Some(self.geometry.textures.len() - 1)
            }
            Err(error) => {
                self.geometry.warnings.push(format!("image {image} is left out: {error}"));
                None
            }
        };
        self.images.insert(image, found);
        found
    }

    fn image(&self, index: usize) -> Result<Vec<u8>, String> {
        let image = self.document.images.get(index).ok_or("it is not there")?;
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => resource(uri, self.files),
            (None, Some(view)) => self.buffers.view(view).map(<[u8]>::to_vec),
            (None, None) => Err("it names no picture".to_owned()),
        }
    }
}

/// The triangles of a list (mode 4), strip (5) or fan (6) of indices.
fn triangles(indices: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        5 => {
            let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            indices.windows(3).enumerate().map(turned).collect()
        }
        6 => indices.windows(2).skip(1).map(|pair| [indices[0], pair[0], pair[1]]).collect(),
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}
