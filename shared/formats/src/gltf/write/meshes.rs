//! Meshes by component: triangles with normals and a material for each class.

use super::{Builder, Extras, Features, GlbOptions, Light, is_direction};
use crate::{Component, WriteError, component, components};
use gltf_json::mesh;
use semascan_model::{SemanticMesh, Taxonomy};
use std::io::Write;

/// Writes `mesh` as GLB: a node by component, as [`super::write_points`] does. Triangles with a corner whose
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
    let mut nodes = Vec::new();
    for Component { label, name, color, triangles } in &components {
        let part = mesh.compacted(triangles);
        let all: Vec<usize> = (0..part.len()).collect();
        let material = builder.material(name, *color, options.colors, Light::Lit);
        let oriented = part.vertices.normals.iter().all(|n| is_direction(*n));
        let vertices = builder.vertices(&part.vertices, &all, oriented, options.colors);
        let indices = Some(builder.binary.indices(&mut builder.root, &part.triangles));
        let primitive = vertices.of(mesh::Mode::Triangles, indices, material);
        let figures = Extras::of(*label, Some(triangles.len()), options, taxonomy);
        nodes.push(builder.node(name, vec![primitive], &figures)?);
    }
    builder.finish(out, options, nodes)
}
