//! The JSON of a glTF file as far as the reader needs it.
//!
//! Own types, and not those of the `gltf` crate: these keep transforms in single precision, refuse quantized positions, and
//! a broken file can make the crate panic; in the browser its whole schema would be downloaded for a few fields.

use serde::Deserialize;

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub(super) extensions_required: Vec<String>,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<Image>,
    pub(super) skins: Vec<Skin>,
}

/// The version alone, of a file that is no glTF 2.0.
#[derive(Debug, Deserialize)]
pub(super) struct Versioned {
    pub(super) asset: Asset,
}

#[derive(Debug, Deserialize)]
pub(super) struct Asset {
    pub(super) version: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    /// Column-major.
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    /// Quaternion x, y, z, w.
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    /// Of the mesh's morph targets.
    pub(super) weights: Vec<f64>,
    pub(super) extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Instancing>,
}

/// The mesh of a node many times over.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Instancing {
    /// Accessors of `TRANSLATION`, `ROTATION` and `SCALE`.
    pub(super) attributes: std::collections::BTreeMap<String, usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Skin {
    /// Nodes.
    pub(super) joints: Vec<usize>,
    pub(super) inverse_bind_matrices: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
    /// Of morph targets, where the node has none.
    pub(super) weights: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    /// Accessors by the name of the attribute.
    pub(super) attributes: std::collections::BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    /// Morph targets.
    #[serde(default)]
    pub(super) targets: Vec<serde::de::IgnoredAny>,
    /// How vertices make points, lines or triangles.
    #[serde(default = "triangles")]
    pub(super) mode: u32,
}

/// The mode of a primitive that names none.
fn triangles() -> u32 {
    4
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
}

/// Elements that take the place of others.
#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparsePart,
    pub(super) values: SparsePart,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    /// Of indices; values have the type of the accessor.
    pub(super) component_type: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) pbr_metallic_roughness: Appearance,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Appearance {
    /// Linear, with opacity.
    pub(super) base_color_factor: Option<[f32; 4]>,
    pub(super) base_color_texture: Option<TextureReference>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureReference {
    pub(super) index: usize,
    #[serde(default)]
    pub(super) tex_coord: u32,
    #[serde(default)]
    pub(super) extensions: ReferenceExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct ReferenceExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<TextureTransform>,
}

/// Where on the picture texture coordinates lie.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct TextureTransform {
    pub(super) offset: [f32; 2],
    /// Radians.
    pub(super) rotation: f32,
    pub(super) scale: [f32; 2],
    /// Other coordinates than those of the reference.
    pub(super) tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

impl TextureTransform {
    /// The place on the picture.
    pub(super) fn of(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (sine, cosine) = self.rotation.sin_cos();
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        [cosine * u + sine * v + self.offset[0], cosine * v - sine * u + self.offset[1]]
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    /// The image; none where only an extension names one.
    pub(super) source: Option<usize>,
    pub(super) extensions: TextureForms,
}

/// The forms of a picture that only an extension names.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureForms {
    #[serde(rename = "KHR_texture_basisu")]
    pub(super) ktx2: Option<serde::de::IgnoredAny>,
    #[serde(rename = "EXT_texture_webp")]
    pub(super) webp: Option<serde::de::IgnoredAny>,
    #[serde(rename = "EXT_texture_avif")]
    pub(super) avif: Option<serde::de::IgnoredAny>,
}

impl TextureForms {
    /// What is said of the first of them.
    pub(super) fn unread(&self) -> Option<&'static str> {
        let ktx2 = self.ktx2.map(|_| "KTX2 (KHR_texture_basisu) is not read");
        let webp = self.webp.map(|_| "WebP (EXT_texture_webp) is not read");
        ktx2.or(webp).or(self.avif.map(|_| "AVIF (EXT_texture_avif) is not read"))
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) uri: Option<String>,
    pub(super) buffer_view: Option<usize>,
}
