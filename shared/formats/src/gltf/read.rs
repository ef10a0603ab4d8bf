//! The reader: points and triangles of the default scene with base colour and its picture.
//!
//! glTF is y up, the table z up: `(x, y, z)` becomes `(x, -z, y)`. Lines are no surface and are left out, which is said;
//! compressed meshes are refused with the way out.

use super::accessor::Buffers;
use super::container;
use super::document::{Document, Node, Primitive, TextureReference, Versioned};
use super::placement::{Placement, instances, joints};
use crate::files::Allowance;
use crate::geometry::{Geometry, MAX_PIECES, MAX_TRIANGLES, Piece, PieceTexture, Texture};
use crate::{ReadError, Resolver, percent, text};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat3, DMat4, DQuat, DVec3};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// Deepest nesting of nodes; deeper files are cyclic or hostile.
const MAX_DEPTH: usize = 64;
/// Most nodes visited; a directed graph can repeat nodes without end.
const MAX_NODES: usize = 100_000;
/// Most vertices, and most triangles, that a scene may have beyond one for each byte of its buffers, because nodes, primitives
/// and instances repeat what these hold.
const MAX_REPEATED: usize = 4_000_000;
/// Beginnings of the names of extensions that do not change the shape, and those that are read.
const KNOWN_EXTENSIONS: [&str; 11] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_animation_pointer",
    "KHR_xmp",
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
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
    let document: Document = serde_json::from_slice(json).map_err(|e| match serde_json::from_slice(json) {
        Ok(Versioned { asset }) if asset.version.starts_with("1.") => {
            format!("it is glTF {}: export it as glTF 2.0", asset.version)
        }
        _ => e.to_string(),
    })?;
    let known = |extension: &String| KNOWN_EXTENSIONS.iter().any(|known| extension.starts_with(known));
    if let Some(extension) = document.extensions_required.iter().find(|e| !known(e)) {
        let way_out = if extension.contains("compression") {
            "export it without mesh compression (in Blender: glTF export, Data, Compression off)"
        } else {
            "export it without this extension, or as PLY or OBJ"
        };
        return Err(format!("it needs the extension {extension}, which is not supported: {way_out}"));
    }
    let allowance = Allowance::new();
    let buffers = buffers(&document, binary, files, &allowance)?;
    let roots = match document.scenes.get(document.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.clone(),
        // A library of meshes: all that stands in no other.
        None if document.scenes.is_empty() => {
            let children: HashSet<usize> = document.nodes.iter().flat_map(|n| n.children.iter().copied()).collect();
            (0..document.nodes.len()).filter(|n| !children.contains(n)).collect()
        }
        None => return Err("its scene is not there".into()),
    };
    let mut reader = Reader {
        document: &document,
        buffers: Buffers::new(&document, buffers),
        files,
        allowance,
        geometry: Geometry::default(),
        images: HashMap::new(),
        skins: HashMap::new(),
        visited: 0,
        points: 0,
        lines: 0,
    };
    for node in roots {
        reader.visit(node, z_up(), 0)?;
    }
    Ok(reader.finish())
}

/// The contents of all buffers. The binary chunk is the first buffer that names no file.
fn buffers<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    files: Resolver<'_>,
    allowance: &Allowance,
) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let mut binary = binary;
    let mut contents = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let content = match &buffer.uri {
            Some(uri) => resource(uri, files, allowance).map(Cow::Owned),
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
fn resource(uri: &str, files: Resolver<'_>, allowance: &Allowance) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data.split_once(";base64,").ok_or("a data URI that is not base64")?.1;
        return STANDARD.decode(encoded).map_err(|e| format!("a data URI: {e}"));
    }
    let name = percent::decode(uri).ok_or_else(|| format!("URI {uri:?} has a bad % sequence"))?;
    let content = files(&name).map_err(|e| e.to_string())?;
    allowance.take(content.len()).map_err(|e| e.to_string())?;
    Ok(content)
}

/// Table from glTF.
pub(super) fn z_up() -> DMat4 {
    DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.])
}

/// A node's `parent_from_node`.
pub(super) fn transform(node: &Node) -> DMat4 {
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
    allowance: Allowance,
    geometry: Geometry,
    /// Index among the geometry's textures of each image that was asked for.
    images: HashMap<usize, Option<usize>>,
    skins: HashMap<usize, Rc<Vec<DMat4>>>,
    visited: usize,
    /// Points of their own.
    points: usize,
    /// Primitives of lines.
    lines: usize,
}

impl Reader<'_> {
    /// What was read; what of it is left out is said.
    fn finish(mut self) -> Geometry {
        let geometry = &mut self.geometry;
        if self.lines > 0 {
            geometry.warnings.push(format!("{} primitives of lines are left out", self.lines));
        }
        if !geometry.triangles.is_empty() {
            if self.points > 0 {
                geometry.warnings.push(format!("{} points beside the triangles are left out", self.points));
            }
            // Those of points.
            geometry.normals.clear();
        }
        geometry.drop_unused_vertices();
        self.geometry
    }

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
            let name = name.map_or_else(|| format!("node {index}"), |name| text::name(name));
            if mesh.weights.iter().chain(&node.weights).any(|w| *w != 0.0)
                && mesh.primitives.iter().any(|p| !p.targets.is_empty())
            {
                self.geometry.warnings.push(format!("{name}: its morph targets are not applied"));
            }
            let instances = match &node.extensions.instancing {
                Some(instancing) => instances(&self.buffers, instancing).map_err(|e| format!("node {index}: {e}"))?,
                None => vec![DMat4::IDENTITY],
            };
            for instance in instances {
                for (k, primitive) in mesh.primitives.iter().enumerate() {
                    let placement = match node.skin {
                        Some(skin) => {
                            self.joints(skin).and_then(|joints| Placement::of_skin(&joints, &self.buffers, primitive))
                        }
                        None => Ok(Placement::Rigid(placed * instance)),
                    };
                    placement
                        .and_then(|placement| self.primitive(primitive, &placement, &name))
                        .map_err(|e| format!("mesh {mesh_index} primitive {k}: {e}"))?;
                }
            }
        }
        node.children.iter().try_for_each(|&child| self.visit(child, placed, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, placement: &Placement, name: &str) -> Result<(), String> {
        let is_points = primitive.mode == 0;
        if !is_points && !(4..=6).contains(&primitive.mode) {
            self.lines += 1;
            return Ok(());
        }
        let positions = *primitive.attributes.get("POSITION").ok_or("it has no POSITION")?;
        let positions = self.buffers.numbers(positions, 3)?;
        let vertices = positions.len() / 3;
        let indices = match primitive.indices {
            _ if is_points => Vec::new(),
            Some(accessor) => self.buffers.indices(accessor)?,
            None => (0..vertices as u32).collect(),
        };
        self.check_size(vertices, if primitive.mode == 4 { indices.len() / 3 } else { indices.len() })?;
        let positions: Vec<[f64; 3]> = positions
            .chunks_exact(3)
            .enumerate()
            .map(|(i, p)| placement.of_vertex(i).transform_point3(DVec3::from_slice(p)).to_array())
            .collect();
        let count = positions.len();
        let first = u32::try_from(self.geometry.positions.len()).map_err(|_| "there are too many vertices")?;
        self.colors(primitive, count)?;
        if is_points {
            self.normals(primitive, placement, count)?;
        }
        self.geometry.positions.extend(positions);
        if is_points {
            self.points += count;
            return Ok(());
        }
        if let Some(bad) = indices.iter().find(|i| **i as usize >= count) {
            return Err(format!("a triangle names vertex {bad} of {count}"));
        }
        let mut triangles = triangles(&indices, primitive.mode);
        if placement.of_vertex(0).determinant() < 0.0 {
            // A mirrored node turns its triangles inside out.
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let piece = self.piece(primitive, name, &triangles)?;
        self.geometry.triangles.extend(triangles.into_iter().map(|t| t.map(|v| first + v)));
        self.geometry.pieces.push(piece);
        Ok(())
    }

    /// The joints of a skin, each skin computed once.
    fn joints(&mut self, skin: usize) -> Result<Rc<Vec<DMat4>>, String> {
        if let Some(known) = self.skins.get(&skin) {
            return Ok(known.clone());
        }
        let joints = Rc::new(joints(self.document, &self.buffers, skin)?);
        self.skins.insert(skin, joints.clone());
        Ok(joints)
    }

    /// Whether a piece of so many vertices and triangles can be held as well: nodes and instances can repeat a mesh more often
    /// than memory can.
    fn check_size(&self, more_vertices: usize, more_triangles: usize) -> Result<(), String> {
        let Geometry { positions, triangles, pieces, .. } = &self.geometry;
        if pieces.len() >= MAX_PIECES {
            return Err(format!(
                "the scene has more than {MAX_PIECES} primitives, counted as often as nodes repeat them"
            ));
        }
        let limit = MAX_TRIANGLES.min(MAX_REPEATED.saturating_add(self.buffers.bytes()));
        if positions.len().saturating_add(more_vertices) > limit
            || triangles.len().saturating_add(more_triangles) > limit
        {
            return Err(format!(
                "the scene has more than {limit} triangles or vertices, counted as often as nodes repeat them"
            ));
        }
        Ok(())
    }

    /// Adds the vertex colours, which are linear already; white where only other primitives have such.
    fn colors(&mut self, primitive: &Primitive, count: usize) -> Result<(), String> {
        const WHITE: [f32; 3] = [1.0; 3];
        let colors = &mut self.geometry.colors;
        match primitive.attributes.get("COLOR_0") {
            Some(&accessor) => {
                let numbers = self.buffers.shares(accessor, 3)?;
                colors.resize(self.geometry.positions.len(), WHITE);
                let color = |c: &[f64]| [c[0], c[1], c[2]].map(|channel| channel.clamp(0.0, 1.0) as f32);
                colors.extend(numbers.chunks_exact(3).map(color).take(count));
                colors.resize(self.geometry.positions.len() + count, WHITE);
            }
            None if colors.is_empty() => {}
            None => colors.resize(self.geometry.positions.len() + count, WHITE),
        }
        Ok(())
    }

    /// Adds the normals of points; zero where only other points have such.
    fn normals(&mut self, primitive: &Primitive, placement: &Placement, count: usize) -> Result<(), String> {
        let normals = &mut self.geometry.normals;
        let first = self.geometry.positions.len();
        if let Some(&accessor) = primitive.attributes.get("NORMAL") {
            let numbers = self.buffers.numbers(accessor, 3)?;
            normals.resize(first, [0.0; 3]);
            normals.extend(numbers.chunks_exact(3).take(count).enumerate().map(|(i, n)| {
                // Normals stay at right angles to the surface, whatever the scale along each axis.
                let placed = DMat3::from_mat4(placement.of_vertex(i)).inverse().transpose() * DVec3::from_slice(n);
                placed.normalize_or_zero().as_vec3().to_array()
            }));
        }
        if !normals.is_empty() {
            normals.resize(first + count, [0.0; 3]);
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
        let reference = appearance.and_then(|a| a.base_color_texture.as_ref());
        let transform = reference.and_then(|reference| reference.extensions.transform.as_ref());
        let set = |of: &TextureReference| transform.and_then(|t| t.tex_coord).unwrap_or(of.tex_coord);
        if let Some(reference) = reference
            && let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{}", set(reference)))
        {
            let flat = self.buffers.numbers(accessor, 2)?;
            // glTF's v runs downwards.
            let at = |i: u32| {
                let i = 2 * i as usize;
                let place = flat.get(i..i + 2).map_or([0.0; 2], |c| [c[0] as f32, c[1] as f32]);
                let [u, v] = transform.map_or(place, |transform| transform.of(place));
                [u, 1.0 - v]
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
        let texture = self.document.textures.get(index);
        let Some(image) = texture.and_then(|t| t.source) else {
            let why =
                texture.and_then(|t| t.extensions.unread()).unwrap_or("it is not there, or in a form that is not read");
            self.geometry.warnings.push(format!("texture {index} is left out: {why}"));
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
            (Some(uri), _) => resource(uri, self.files, &self.allowance),
            (None, Some(view)) => {
                let picture = self.buffers.view(view)?;
                self.allowance.take(picture.len()).map_err(|e| e.to_string())?;
                Ok(picture.to_vec())
            }
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
