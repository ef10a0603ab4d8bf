//! Meshes by component: triangles with normals, the surface's own colours, and class materials.

use super::{Binary, Builder, GlbOptions, class_of, is_direction, linear};
use crate::export::{Component, ExportError, components};
use crate::model::{Color, SemanticMesh, Taxonomy};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, material, mesh};
use std::io::Write;

/// Figures of one component, as extras of its nodes.
#[derive(Clone, Copy, Debug, serde::Serialize)]
struct Figures {
    /// Component class.
    class: u16,
    /// Number of triangles.
    triangles: usize,
    /// Area in square metres.
    area: f64,
    /// Mean share of the class over the vertices.
    confidence: f64,
}

/// Writes `mesh` as GLB: a node by component in two scenes, as [`super::write_points`] does. Triangles with a corner whose
/// position is not finite are left out, because glTF cannot hold them.
///
/// # Errors
/// [`ExportError::Vertex`] if a triangle names a vertex that is not there, [`ExportError::TooLarge`] past 4 GiB,
/// [`ExportError::Io`] if `out` fails.
pub fn write_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), ExportError> {
    super::super::by_component::check(mesh)?;
    let finite = |v: u32| mesh.vertices.positions[v as usize].iter().all(|c| c.is_finite());
    let mesh = &mesh.select(|t| t.into_iter().all(finite));
    let mut builder = Builder::new();
    let (mut appearance, mut semantics) = (Vec::new(), Vec::new());
    let components = components(mesh, taxonomy)?;
    if !components.is_empty() {
        builder.root.extensions_used.push("KHR_materials_unlit".into());
        let white = builder.unlit("appearance", [255; 3]);
        for Component { label, triangles, .. } in &components {
            let (name, color) = class_of(taxonomy, *label);
            let part = mesh.compacted(triangles);
            let class = builder.lit(&name, color);
            let [own, by_class] = builder.surfaces(&part, white, class);
            let confidence: f64 = part.vertices.confidence.iter().map(|c| f64::from(*c)).sum();
            let figures = Figures {
                class: *label,
                triangles: part.triangles.len(),
                area: part.area(),
                confidence: confidence / part.len().max(1) as f64,
            };
            appearance.push(builder.node(&name, vec![own], &figures)?);
            semantics.push(builder.node(&name, vec![by_class], &figures)?);
        }
    }
    builder.finish(out, &options.part, appearance, semantics)
}

impl Builder {
    /// A rough, lit material: inspected parts are seen from inside as well where their surface is open.
    fn lit(&mut self, name: &str, color: Color) -> Index<Material> {
        let [r, g, b] = linear(color).map(|c| f32::from(c) / f32::from(u16::MAX));
        self.root.push(Material {
            name: Some(name.into()),
            double_sided: true,
            pbr_metallic_roughness: material::PbrMetallicRoughness {
                base_color_factor: material::PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: material::StrengthFactor(0.0),
                roughness_factor: material::StrengthFactor(0.8),
                ..Default::default()
            },
            ..Default::default()
        })
    }

    /// The same triangles in the surface's own colours and in the material of its class.
    fn surfaces(
        &mut self,
        part: &SemanticMesh,
        white: Index<Material>,
        class: Index<Material>,
    ) -> [mesh::Primitive; 2] {
        let Self { root, binary } = self;
        let all: Vec<usize> = (0..part.len()).collect();
        let oriented = part.vertices.normals.iter().all(|n| is_direction(*n));
        let mut attributes = Binary::geometry(binary, root, &part.vertices, &all, oriented);
        let indices = binary.indices(root, &part.triangles);
        let primitive = |attributes, material| mesh::Primitive {
            attributes,
            material: Some(material),
            mode: Valid(mesh::Mode::Triangles),
            indices: Some(indices),
            targets: None,
            extensions: None,
            extras: None,
        };
        let by_class = primitive(attributes.clone(), class);
        let colors = binary.colors(root, &part.vertices, &all);
        attributes.insert(Valid(mesh::Semantic::Colors(0)), colors);
        [primitive(attributes, white), by_class]
    }
}
