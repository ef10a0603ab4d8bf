//! A scene of points or of meshes as binary glTF 2.0: a node by component, named, with its figures as extras.
//!
//! Two scenes share one buffer: `appearance` shows the surface's own colours, `semantics` the class colours as materials
//! (unlit for points); two scenes and not material variants, because those cannot switch vertex colours off. The table frame is
//! z up and glTF y up, hence a rotation in each scene's root node.

mod binary;
mod components;
mod container;
mod meshes;

pub use meshes::write_mesh;

use super::ExportError;
use super::by_component::class as class_of;
use crate::model::{Color, SemanticCloud, Taxonomy};
use binary::{Attributes, Binary, linear};
use components::{Component, components, is_direction};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Mesh, Node, Root, Scene, extensions, material, mesh, scene};
use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Write;

/// -90 degrees about x: table z becomes glTF y.
const Y_UP_FROM_Z_UP: [f32; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

/// What a scene says beside its geometry.
#[derive(Clone, Debug)]
pub struct GlbOptions {
    /// Name of the part: that of both scenes' root nodes.
    pub part: String,
    /// Voxel edge in metres: what area a point stands for.
    pub voxel: f32,
}

/// Writes `cloud` as GLB. Points whose position is not finite are left out, because glTF cannot hold them; an empty
/// cloud gives two empty scenes.
///
/// # Errors
/// [`ExportError::TooLarge`] past 4 GiB, [`ExportError::Io`] if `out` fails.
pub fn write_points(
    out: impl Write,
    cloud: &SemanticCloud,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), ExportError> {
    let components = components(cloud);
    let mut builder = Builder::new();
    let (mut appearance, mut semantics) = (Vec::new(), Vec::new());
    if !components.is_empty() {
        builder.root.extensions_used.push("KHR_materials_unlit".into());
        let white = builder.unlit("appearance", [255; 3]);
        for component in &components {
            let (name, color) = class_of(taxonomy, component.label);
            let class = builder.unlit(&name, color);
            let [own, by_class] = builder.primitives(cloud, component, white, class);
            let figures = component.figures(cloud, options.voxel);
            appearance.push(builder.node(&name, own, &figures)?);
            semantics.push(builder.node(&name, by_class, &figures)?);
        }
    }
    builder.finish(out, &options.part, appearance, semantics)
}

/// A scene description while it grows.
struct Builder {
    root: Root,
    binary: Binary,
}

impl Builder {
    fn new() -> Self {
        Self { root: Root::default(), binary: Binary::new() }
    }

    /// Writes the two scenes of these nodes.
    fn finish(
        mut self,
        out: impl Write,
        part: &str,
        appearance: Vec<Index<Node>>,
        semantics: Vec<Index<Node>>,
    ) -> Result<(), ExportError> {
        let first = self.scene("appearance", part, appearance);
        self.scene("semantics", part, semantics);
        let Self { mut root, binary } = self;
        root.scene = Some(first);
        root.asset.generator = Some(concat!("semascan ", env!("CARGO_PKG_VERSION")).into());
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
            extensions: Some(extensions::material::Material { unlit: Some(extensions::material::Unlit {}) }),
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
            let mut attributes = self.binary.geometry(&mut self.root, cloud, bin, oriented);
            primitives[1].push(points(attributes.clone(), class));
            let colors = self.binary.colors(&mut self.root, cloud, bin);
            attributes.insert(Valid(mesh::Semantic::Colors(0)), colors);
            primitives[0].push(points(attributes, white));
        }
        primitives
    }

    fn node(
        &mut self,
        name: &str,
        primitives: Vec<mesh::Primitive>,
        figures: &impl serde::Serialize,
    ) -> Result<Index<Node>, ExportError> {
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

fn points(attributes: Attributes, material: Index<Material>) -> mesh::Primitive {
    mesh::Primitive {
        attributes,
        material: Some(material),
        mode: Valid(mesh::Mode::Points),
        indices: None,
        targets: None,
        extensions: None,
        extras: None,
    }
}
