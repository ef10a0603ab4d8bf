//! Meshes by component: triangles with normals and a material for each class.

use super::picture::{enter, with_picture};
use super::{Builder, Extras, Features, GlbOptions, Light, is_direction};
use crate::{Component, MeshTexture, WriteError, component, components};
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
    write(out, mesh, None, taxonomy, options)
}

/// Writes `mesh` with a picture as GLB, as [`write_mesh`] does; the colours of the vertices are the attribute `_VERTEX_COLOR`.
/// What the picture is stands in `asset.extras.texture`.
///
/// # Errors
/// As [`write_mesh`], and [`WriteError::Length`] if the picture does not have a place for every vertex.
pub fn write_textured_mesh(
    out: impl Write,
    mesh: &SemanticMesh,
    texture: &MeshTexture<'_>,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), WriteError> {
    texture.check(mesh.len())?;
    write(out, mesh, Some(texture), taxonomy, options)
}

fn write(
    out: impl Write,
    mesh: &SemanticMesh,
    texture: Option<&MeshTexture<'_>>,
    taxonomy: &Taxonomy,
    options: &GlbOptions,
) -> Result<(), WriteError> {
    component::check(mesh)?;
    let finite = |v: u32| mesh.vertices.positions[v as usize].iter().all(|c| c.is_finite());
    let whole: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| t.iter().all(|v| finite(*v))).copied().collect();
    let places = texture.map(|texture| compacted(texture.places, &whole));
    let mesh = &mesh.compacted(&whole);
    let components = components(mesh, taxonomy)?;
    let all: Vec<usize> = (0..mesh.len()).collect();
    let mut builder = Builder::new(Features::of(&mesh.vertices, &all, &options.figures, taxonomy));
    let picture = texture.map(|texture| enter(&mut builder, texture));
    let mut nodes = Vec::new();
    for Component { label, name, color, triangles } in &components {
        let part = mesh.compacted(triangles);
        let all: Vec<usize> = (0..part.len()).collect();
        let material = match picture {
            None => builder.material(name, *color, options.colors, Light::Lit),
            Some(_) => builder.material_of(name, [255; 3], picture, Light::Lit),
        };
        let oriented = part.vertices.normals.iter().all(|n| is_direction(*n));
        let vertices = builder.vertices(&part.vertices, &all, oriented, options.colors);
        let vertices = match &places {
            None => vertices,
            Some(places) => with_picture(&mut builder, vertices, &part.vertices, &compacted(places, triangles)),
        };
        let indices = Some(builder.binary.indices(&mut builder.root, &part.triangles));
        let primitive = vertices.of(mesh::Mode::Triangles, indices, material);
        let figures = Extras::of(*label, Some(triangles.len()), options, taxonomy);
        nodes.push(builder.node(name, vec![primitive], &figures)?);
    }
    builder.finish(out, options, nodes)
}

/// The values of vertices that `triangles` name, as [`SemanticMesh::compacted`] keeps them.
fn compacted<T: Copy>(values: &[T], triangles: &[[u32; 3]]) -> Vec<T> {
    let mut is_named = vec![false; values.len()];
    triangles.iter().flatten().for_each(|v| is_named[*v as usize] = true);
    values.iter().zip(is_named).filter(|(_, is_named)| *is_named).map(|(value, _)| *value).collect()
}
