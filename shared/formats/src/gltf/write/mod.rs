//! A scene of points or of meshes as binary glTF 2.0: a node by component, named, with its figures as extras.
//!
//! Each vertex knows its component, defect and instance (`features`), whatever it looks like. There is one scene, because many
//! programs show all that a file holds: in the surface's own colours as vertex colours, or in those of the classes; in either
//! case the material has the name of the class. Materials are rough and not metallic, which looks right with lights and
//! without; points are marked as unlit. A mesh may have a picture in place of the colours, which are an attribute of their own
//! then (`_VERTEX_COLOR`), because glTF multiplies a picture by vertex colours. The table frame is z up and glTF y up, hence a
//! rotation in the scene's root node.

mod binary;
mod components;
mod features;
mod meshes;
mod picture;

pub use meshes::{write_mesh, write_textured_mesh};

use super::container;
use crate::WriteError;
use crate::component::class as class_of;
use binary::{Attributes, Binary, linear};
use components::{Component, Extras, components, is_direction};
use features::Features;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Material, Mesh, Node, Root, Scene, extensions, material, mesh, scene, texture};
use semascan_model::finding::Finding;
use semascan_model::{Color, ModelFigures, SemanticCloud, Taxonomy};
use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Write;

/// -90 degrees about x: table z becomes glTF y.
const Y_UP_FROM_Z_UP: [f32; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

/// Which colours a scene shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SceneColors {
    /// Those of the surface, at each vertex.
    #[default]
    Surface,
    /// Those of the component classes.
    Classes,
}

/// What a scene says beside its geometry.
#[derive(Clone, Debug, Default)]
pub struct GlbOptions {
    /// Name of the part: that of the scene's root node.
    pub part: String,
    /// Figures of the model that the scene shows, for the nodes' extras and the property tables. The scene may hold less of
    /// it, or a simplified surface: the figures are the model's.
    pub figures: ModelFigures,
    /// Findings on the model's components, for the nodes' extras.
    pub findings: Vec<Finding>,
    /// Identifier of the set of files that the scene belongs to, for `asset.extras.generation`.
    pub generation: Option<String>,
    /// The colours that it shows.
    pub colors: SceneColors,
    /// What the positions are relative to: metres, table frame (z up). Single precision cannot hold the sum, so a shift other
    /// than zero is noted as `asset.extras.origin`.
    pub shift: [f64; 3],
}

/// Writes `cloud` as GLB. Points whose position is not finite are left out, because glTF cannot hold them; an empty
/// cloud gives an empty scene.
///
/// # Errors
/// [`WriteError::TooLarge`] past 4 GiB, [`WriteError::Io`] if `out` fails.
pub fn write_points(
    out: impl Write,
    cloud: &SemanticCloud,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), WriteError> {
    let components = components(cloud);
    let all: Vec<usize> = components.iter().flat_map(Component::points).collect();
    let mut builder = Builder::new(Features::of(cloud, &all, &options.figures, taxonomy));
    let mut nodes = Vec::new();
    for component in &components {
        let (name, color) = class_of(&taxonomy.components, component.label);
        let material = builder.material(&name, color, options.colors, Light::Unlit);
        let primitives = builder.primitives(cloud, component, material, options.colors);
        let figures = Extras::of(component.label, None, options, taxonomy);
        nodes.push(builder.node(&name, primitives, &figures)?);
    }
    builder.finish(out, options, nodes)
}

/// Whether a material answers to lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Light {
    Lit,
    Unlit,
}

/// A scene description while it grows.
struct Builder {
    root: Root,
    binary: Binary,
    features: Features,
    /// What the asset says beside its generation and origin.
    extras: serde_json::Map<String, serde_json::Value>,
}

impl Builder {
    fn new(features: Features) -> Self {
        let binary = Binary::new(features.len());
        Self { root: Root::default(), binary, features, extras: serde_json::Map::new() }
    }

    /// Writes the scene of these nodes.
    fn finish(mut self, out: impl Write, options: &GlbOptions, nodes: Vec<Index<Node>>) -> Result<(), WriteError> {
        let scene = self.scene(&options.part, nodes);
        let Self { mut root, mut binary, features, mut extras } = self;
        if root.materials.iter().any(|material| material.extensions.is_some()) {
            root.extensions_used.push("KHR_materials_unlit".into());
        }
        if !root.meshes.is_empty() {
            features.describe(&mut root, &mut binary);
        }
        root.scene = Some(scene);
        root.asset.generator = Some(concat!("semascan ", env!("CARGO_PKG_VERSION")).into());
        if let Some(generation) = &options.generation {
            extras.insert("generation".into(), generation.as_str().into());
        }
        if options.shift != [0.0; 3] {
            extras.insert("origin".into(), options.shift.to_vec().into());
        }
        if !extras.is_empty() {
            root.asset.extras = Some(serde_json::value::to_raw_value(&extras)?);
        }
        let binary = binary.finish(&mut root);
        container::write(out, &serde_json::to_vec(&root)?, &binary)
    }

    /// The material of a class: white under vertex colours, else in the colour of the class. Rough and not metallic, and seen
    /// from both sides: inspected parts are seen from inside as well where their surface is open.
    fn material(&mut self, name: &str, class: Color, colors: SceneColors, light: Light) -> Index<Material> {
        let color = match colors {
            SceneColors::Surface => [255; 3],
            SceneColors::Classes => class,
        };
        self.material_of(name, color, None, light)
    }

    /// The same in one colour, times the picture if there is one.
    fn material_of(
        &mut self,
        name: &str,
        color: Color,
        picture: Option<Index<texture::Texture>>,
        light: Light,
    ) -> Index<Material> {
        let [r, g, b] = linear(color).map(|c| f32::from(c) / f32::from(u16::MAX));
        let unlit =
            extensions::material::Material { unlit: Some(extensions::material::Unlit {}), ..Default::default() };
        self.root.push(Material {
            name: Some(name.into()),
            double_sided: true,
            pbr_metallic_roughness: material::PbrMetallicRoughness {
                base_color_factor: material::PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: material::StrengthFactor(0.0),
                roughness_factor: material::StrengthFactor(0.9),
                base_color_texture: picture.map(|index| texture::Info {
                    index,
                    tex_coord: 0,
                    extensions: None,
                    extras: None,
                }),
                ..Default::default()
            },
            extensions: (light == Light::Unlit).then_some(unlit),
            ..Default::default()
        })
    }

    /// Primitives of points, those with a normal and those without apart.
    fn primitives(
        &mut self,
        cloud: &SemanticCloud,
        component: &Component,
        material: Index<Material>,
        colors: SceneColors,
    ) -> Vec<mesh::Primitive> {
        let mut primitives = Vec::new();
        for (bin, oriented) in [(&component.oriented, true), (&component.bare, false)] {
            if bin.is_empty() {
                continue;
            }
            let vertices = self.vertices(cloud, bin, oriented, colors);
            primitives.push(vertices.of(mesh::Mode::Points, None, material));
        }
        primitives
    }

    /// The vertices of a primitive, with their colours where these are shown.
    fn vertices(&mut self, cloud: &SemanticCloud, points: &[usize], oriented: bool, colors: SceneColors) -> Vertices {
        let mut attributes = self.binary.geometry(&mut self.root, cloud, points, oriented);
        if colors == SceneColors::Surface {
            let colors = self.binary.colors(&mut self.root, cloud, points);
            attributes.insert(Valid(mesh::Semantic::Colors(0)), colors);
        }
        attributes.extend(self.binary.features(&mut self.root, cloud, points, &self.features));
        Vertices { attributes, extensions: self.features.of_primitive(cloud, points) }
    }

    fn node(
        &mut self,
        name: &str,
        primitives: Vec<mesh::Primitive>,
        figures: &impl serde::Serialize,
    ) -> Result<Index<Node>, WriteError> {
        let name = Some(name.to_owned());
        let mesh = Mesh { name: name.clone(), primitives, extensions: None, extras: None, weights: None };
        let mesh = Some(self.root.push(mesh));
        let extras = Some(serde_json::value::to_raw_value(figures)?);
        Ok(self.root.push(Node { name, mesh, extras, ..Default::default() }))
    }

    fn scene(&mut self, part: &str, components: Vec<Index<Node>>) -> Index<Scene> {
        let node = self.root.push(Node {
            name: Some(part.into()),
            rotation: Some(scene::UnitQuaternion(Y_UP_FROM_Z_UP)),
            // glTF allows no empty list.
            children: (!components.is_empty()).then_some(components),
            ..Default::default()
        });
        self.root.push(Scene { name: Some(part.into()), nodes: vec![node], extensions: None, extras: None })
    }
}

/// Vertices of a primitive.
struct Vertices {
    attributes: Attributes,
    extensions: extensions::mesh::Primitive,
}

impl Vertices {
    fn of(self, mode: mesh::Mode, indices: Option<Index<Accessor>>, material: Index<Material>) -> mesh::Primitive {
        mesh::Primitive {
            attributes: self.attributes,
            material: Some(material),
            mode: Valid(mode),
            indices,
            targets: None,
            extensions: Some(self.extensions),
            extras: None,
        }
    }
}
