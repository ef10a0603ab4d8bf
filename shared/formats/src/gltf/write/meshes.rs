//! Meshes by component: triangles with normals, the surface's own colours, and class materials.

use super::{Builder, Extras, Features, GlbOptions, is_direction, linear};
use crate::{Component, WriteError, component, components};
use gltf_json::{Index, Material, material, mesh};
use semascan_model::{Color, SemanticMesh, Taxonomy};
use std::io::Write;

/// Writes `mesh` as GLB: a node by component in two scenes, as [`super::write_points`] does. Triangles with a corner whose
/// position is not finite are left out, because glTF cannot hold them.
///
/// # Errors
/// [`WriteError::Vertex`] if a triangle names a vertex that is not there, [`WriteError::TooLarge`] past 4 GiB,
/// [`WriteError::Io`] if `out` fails.
pub fn write_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), WriteError> {
    component::check(mesh)?;
    let finite = |v: u32| mesh.vertices.positions[v as usize].iter().all(|c| c.is_finite());
    let mesh = &mesh.select(|t| t.into_iter().all(finite));
    let components = components(mesh, taxonomy)?;
    let all: Vec<usize> = (0..mesh.len()).collect();
    let mut builder = Builder::new(Features::of(&mesh.vertices, &all, &options.figures, taxonomy));
    let (mut appearance, mut semantics) = (Vec::new(), Vec::new());
    if !components.is_empty() {
        let white = builder.unlit("appearance", [255; 3]);
        for Component { label, name, color, triangles } in &components {
            let part = mesh.compacted(triangles);
            let all: Vec<usize> = (0..part.len()).collect();
            let class = builder.lit(name, *color);
            let [own, by_class] = builder.surfaces(&part, &all, white, class);
            let figures = Extras::of(*label, Some(triangles.len()), &options.figures, taxonomy);
            appearance.push(builder.node(name, vec![own], &figures)?);
            semantics.push(builder.node(name, vec![by_class], &figures)?);
        }
    }
    builder.finish(out, options, appearance, semantics)
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

    /// The same triangles in the surface's own colours and in the material of its class; `all` are the vertices.
    fn surfaces(
        &mut self,
        part: &SemanticMesh,
        all: &[usize],
        white: Index<Material>,
        class: Index<Material>,
    ) -> [mesh::Primitive; 2] {
        let oriented = part.vertices.normals.iter().all(|n| is_direction(*n));
        let shared = self.vertices(&part.vertices, all, oriented);
        let indices = Some(self.binary.indices(&mut self.root, &part.triangles));
        let colors = self.binary.colors(&mut self.root, &part.vertices, all);
        let by_class = shared.clone().of(mesh::Mode::Triangles, indices, class);
        [shared.colored(colors).of(mesh::Mode::Triangles, indices, white), by_class]
    }
}
