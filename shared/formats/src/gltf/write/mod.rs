//! A scene of points or of meshes as binary glTF 2.0: a node by component, named, with its figures as extras.
//!
//! Each vertex knows its component, defect and instance (`features`), whatever it looks like. Two scenes share one
//! buffer: `appearance` shows the surface's own colours, `semantics` the class colours as materials (unlit for points); two
//! scenes and not material variants, because those cannot switch vertex colours off. The table frame is z up and glTF y up,
//! hence a rotation in each scene's root node.

mod binary;
mod components;
mod features;
mod meshes;

pub use meshes::write_mesh;

use super::container;
use crate::WriteError;
use crate::component::class as class_of;
use binary::{Attributes, Binary, linear};
use components::{Component, Extras, components, is_direction};
use features::Features;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Material, Mesh, Node, Root, Scene, extensions, material, mesh, scene};
use semascan_model::{Color, ModelFigures, SemanticCloud, Taxonomy};
use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Write;

/// -90 degrees about x: table z becomes glTF y.
const Y_UP_FROM_Z_UP: [f32; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

/// What a scene says beside its geometry.
#[derive(Clone, Debug, Default)]
pub struct GlbOptions {
    /// Name of the part: that of both scenes' root nodes.
    pub part: String,
    /// Figures of the model that the scene shows, for the nodes' extras and the property tables. The scene may hold less of
    /// it, or a simplified surface: the figures are the model's.
    pub figures: ModelFigures,
    /// Identifier of the set of files that the scene belongs to, for `asset.extras.generation`.
    pub generation: Option<String>,
}

/// Writes `cloud` as GLB. Points whose position is not finite are left out, because glTF cannot hold them; an empty
/// cloud gives two empty scenes.
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
    let (mut appearance, mut semantics) = (Vec::new(), Vec::new());
    if !components.is_empty() {
        let white = builder.unlit("appearance", [255; 3]);
        for component in &components {
            let (name, color) = class_of(&taxonomy.components, component.label);
            let class = builder.unlit(&name, color);
            let [own, by_class] = builder.primitives(cloud, component, white, class);
            let figures = Extras::of(component.label, None, &options.figures, taxonomy);
            appearance.push(builder.node(&name, own, &figures)?);
            semantics.push(builder.node(&name, by_class, &figures)?);
        }
    }
    builder.finish(out, options, appearance, semantics)
}

/// A scene description while it grows.
struct Builder {
    root: Root,
    binary: Binary,
    features: Features,
}

impl Builder {
    fn new(features: Features) -> Self {
        Self { root: Root::default(), binary: Binary::new(features.len()), features }
    }

    /// Writes the two scenes of these nodes.
    fn finish(
        mut self,
        out: impl Write,
        options: &GlbOptions,
        appearance: Vec<Index<Node>>,
        semantics: Vec<Index<Node>>,
    ) -> Result<(), WriteError> {
        let first = self.scene("appearance", &options.part, appearance);
        self.scene("semantics", &options.part, semantics);
        let Self { mut root, mut binary, features } = self;
        if !root.meshes.is_empty() {
            root.extensions_used.push("KHR_materials_unlit".into());
            features.describe(&mut root, &mut binary);
        }
        root.scene = Some(first);
        root.asset.generator = Some(concat!("semascan ", env!("CARGO_PKG_VERSION")).into());
        if let Some(generation) = &options.generation {
            let extras = serde_json::json!({ "generation": generation });
            root.asset.extras = Some(serde_json::value::to_raw_value(&extras)?);
        }
        let binary = binary.finish(&mut root);
        container::write(out, &serde_json::to_vec(&root)?, &binary)
    }

    fn unlit(&mut self, name: &str, color: Color) -> Index<Material> {
        let [r, g, b] = linear(color).map(|c| f32::from(c) / f32::from(u16::MAX));
        self.root.push(Material {
            name: Some(name.into()),
            pbr_metallic_roughness: material::PbrMetallicRoughness {
                base_color_factor: material::PbrBaseColorFactor([r, g, b, 1.0]),
                ..Default::default()
            },
            extensions: Some(extensions::material::Material {
                unlit: Some(extensions::material::Unlit {}),
                ..Default::default()
            }),
            ..Default::default()
        })
    }

    /// Primitives in the points' own colours and, over the same positions, in that of their class.
    fn primitives(
        &mut self,
        cloud: &SemanticCloud,
        component: &Component,
        white: Index<Material>,
        class: Index<Material>,
    ) -> [Vec<mesh::Primitive>; 2] {
        let mut primitives = [Vec::new(), Vec::new()];
        for (bin, oriented) in [(&component.oriented, true), (&component.bare, false)] {
            if bin.is_empty() {
                continue;
            }
            let shared = self.vertices(cloud, bin, oriented);
            let colors = self.binary.colors(&mut self.root, cloud, bin);
            primitives[1].push(shared.clone().of(mesh::Mode::Points, None, class));
            primitives[0].push(shared.colored(colors).of(mesh::Mode::Points, None, white));
        }
        primitives
    }

    /// What the primitives of both scenes have in common.
    fn vertices(&mut self, cloud: &SemanticCloud, points: &[usize], oriented: bool) -> Vertices {
        let mut attributes = self.binary.geometry(&mut self.root, cloud, points, oriented);
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

    fn scene(&mut self, name: &str, part: &str, components: Vec<Index<Node>>) -> Index<Scene> {
        let node = self.root.push(Node {
            name: Some(part.into()),
            rotation: Some(scene::UnitQuaternion(Y_UP_FROM_Z_UP)),
            // glTF allows no empty list.
            children: (!components.is_empty()).then_some(components),
            ..Default::default()
        });
        self.root.push(Scene { name: Some(name.into()), nodes: vec![node], extensions: None, extras: None })
    }
}

/// Vertices of a primitive.
#[derive(Clone)]
struct Vertices {
    attributes: Attributes,
    extensions: extensions::mesh::Primitive,
}

impl Vertices {
    fn colored(mut self, colors: Index<Accessor>) -> Self {
        self.attributes.insert(Valid(mesh::Semantic::Colors(0)), colors);
        self
    }

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
