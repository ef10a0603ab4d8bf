//! A picture on the meshes of a scene.

use super::{Builder, Vertices};
use crate::MeshTexture;
use gltf_json::texture::{MagFilter, MinFilter, Sampler, Texture, WrappingMode};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Image, Index, image, mesh};
use semascan_model::SemanticCloud;
use serde_json::json;

/// Enters the picture, and what it is.
pub(super) fn enter(builder: &mut Builder, texture: &MeshTexture<'_>) -> Index<Texture> {
    let view = builder.binary.picture(&mut builder.root, texture.png);
    let source = builder.root.push(Image {
        buffer_view: Some(view),
        mime_type: Some(image::MimeType("image/png".into())),
        name: Some("photographs".into()),
        uri: None,
        extensions: None,
        extras: None,
    });
    let sampler = builder.root.push(Sampler {
        mag_filter: Some(Valid(MagFilter::Linear)),
        min_filter: Some(Valid(MinFilter::LinearMipmapLinear)),
        wrap_s: Valid(WrappingMode::ClampToEdge),
        wrap_t: Valid(WrappingMode::ClampToEdge),
        ..Default::default()
    });
    builder.extras.insert(
        "texture".into(),
        json!({
            "width": texture.size.0,
            "height": texture.size.1,
            "texel": texture.texel,
            "unseen": texture.unseen,
            "unseenColor": texture.unseen_color,
            "alpha": "0 where no photograph shows the surface",
        }),
    );
    builder.root.push(Texture { name: None, sampler: Some(sampler), source, extensions: None, extras: None })
}

/// Vertices with their places in the picture, and their colours under a name of their own.
pub(super) fn with_picture(
    builder: &mut Builder,
    mut vertices: Vertices,
    cloud: &SemanticCloud,
    places: &[[f32; 2]],
) -> Vertices {
    let attributes = &mut vertices.attributes;
    let colors = attributes.remove(&Valid(mesh::Semantic::Colors(0)));
    let colors = colors.unwrap_or_else(|| {
        let all: Vec<usize> = (0..cloud.len()).collect();
        builder.binary.colors(&mut builder.root, cloud, &all)
    });
    attributes.insert(Valid(mesh::Semantic::Extras("VERTEX_COLOR".into())), colors);
    let places = builder.binary.texture_places(&mut builder.root, places);
    attributes.insert(Valid(mesh::Semantic::TexCoords(0)), places);
    vertices
}
