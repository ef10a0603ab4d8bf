//! Meshes with a picture, read back by this crate's readers and by the crates `gltf` and `tobj`.

use super::taxonomy;
use semascan_formats::gltf::{GlbOptions, write_mesh, write_textured_mesh};
use semascan_formats::{FileFrame, Geometry, MeshTexture, WriteError, no_files, obj};
use semascan_model::{SemanticMesh, SemanticPoint};

/// A black picture of 2 x 1 pixels.
const PNG: &[u8] = &[
    0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, b'I', b'H', b'D', b'R', 0, 0, 0, 2, 0, 0, 0, 1, 8, 0,
    0, 0, 0, 0xd1, 0x49, 0x5f, 0x9b, 0, 0, 0, 11, b'I', b'D', b'A', b'T', 0x78, 0x9c, 0x63, 0x60, 0x60, 0, 0, 0, 3, 0,
    1, 0x3a, 0x4b, 0xfc, 0x5f, 0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xae, 0x42, 0x60, 0x82,
];

/// Two triangles of component 1 and one of component 2; vertex 3 is of no triangle.
fn mesh() -> (SemanticMesh, Vec<[f32; 2]>) {
    let mut mesh = SemanticMesh::default();
    let mut places = Vec::new();
    for i in 0..8_u16 {
        let position = [0.01 * f32::from(i), 0.02 * f32::from(i % 3), 0.03 * f32::from(i % 2)];
        let label = if i < 5 { 1 } else { 2 };
        let vertex = SemanticPoint {
            position,
            normal: [0.0, 0.0, 1.0],
            color: [10 * i as u8, 20, 30],
            label,
            ..SemanticPoint::UNKNOWN
        };
        mesh.push(vertex, false);
        places.push([f32::from(i) / 8.0, 1.0 - f32::from(i) / 16.0]);
    }
    mesh.triangles = vec![[0, 1, 2], [2, 1, 4], [5, 6, 7]];
    (mesh, places)
}

fn picture(places: &[[f32; 2]]) -> MeshTexture<'_> {
    MeshTexture { png: PNG, size: (2, 1), places, texel: 0.5e-3, unseen: 0.125, unseen_color: [128; 3] }
}

#[test]
fn a_glb_has_the_picture_and_all_that_it_has_without() {
    let (mut mesh, places) = mesh();
    // What glTF cannot hold is left out, and the places of the others stay theirs.
    mesh.vertices.positions[3] = [f32::NAN; 3];
    mesh.triangles.insert(0, [0, 1, 3]);
    let options = GlbOptions { part: "motor".into(), generation: Some("g".into()), ..GlbOptions::default() };
    let (mut plain, mut bytes) = (Vec::new(), Vec::new());
    write_mesh(&mut plain, &mesh, &taxonomy(), &options).expect("a valid mesh");
    write_textured_mesh(&mut bytes, &mesh, &picture(&places), &taxonomy(), &options).expect("a valid mesh");
    let (plain, textured) =
        (gltf::Gltf::from_slice(&plain).expect("valid"), gltf::Gltf::from_slice(&bytes).expect("valid"));
    let blob = textured.blob.as_deref().expect("a buffer");
    assert_eq!((textured.images().len(), textured.textures().len()), (1, 1));
    let gltf::image::Source::View { view, mime_type } = textured.images().next().expect("one").source() else {
        panic!("the picture is in the file");
    };
    assert_eq!((mime_type, &blob[view.offset()..][..view.length()]), ("image/png", PNG));
    let extras: serde_json::Value =
        serde_json::from_str(textured.document.as_json().asset.extras.as_ref().expect("extras").get()).expect("JSON");
    assert_eq!((&extras["generation"], &extras["texture"]["texel"]), (&"g".into(), &0.5e-3.into()));
    assert_eq!((&extras["texture"]["unseen"], &extras["texture"]["width"]), (&0.125.into(), &2.into()));

    let nodes = |gltf: &gltf::Gltf| -> Vec<(Option<String>, String)> {
        let root = gltf.default_scene().and_then(|scene| scene.nodes().next()).expect("a root");
        root.children()
            .map(|n| (n.name().map(str::to_owned), n.extras().as_ref().expect("figures").get().to_owned()))
            .collect()
    };
    assert_eq!(nodes(&plain), nodes(&textured));
    assert_eq!(plain.extensions_used().collect::<Vec<_>>(), textured.extensions_used().collect::<Vec<_>>());
    let mut seen = 0;
    for mesh_of in textured.meshes() {
        for primitive in mesh_of.primitives() {
            let base = primitive.material().pbr_metallic_roughness();
            assert_eq!(
                (base.base_color_factor(), base.base_color_texture().map(|t| t.tex_coord())),
                ([1.0; 4], Some(0))
            );
            // A picture is multiplied by vertex colours: they stand elsewhere.
            assert!(primitive.get(&gltf::Semantic::Colors(0)).is_none());
            assert!(primitive.get(&gltf::Semantic::Extras("VERTEX_COLOR".into())).is_some());
            assert!(primitive.get(&gltf::Semantic::Extras("FEATURE_ID_0".into())).is_some());
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
            let found: Vec<[f32; 2]> = reader.read_tex_coords(0).expect("places").into_f32().collect();
            assert_eq!(positions.len(), found.len());
            for (position, place) in positions.iter().zip(found) {
                let vertex = mesh.vertices.positions.iter().position(|p| p == position).expect("a vertex");
                assert_eq!(place, places[vertex]);
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 7);
}

#[test]
fn an_obj_names_the_picture_and_every_corner_its_place() {
    let (mesh, places) = mesh();
    let (mut geometry, mut library) = (Vec::new(), Vec::new());
    let texture = picture(&places);
    let frame = FileFrame::TABLE;
    obj::write_textured_mesh_at(&mut geometry, &mesh, &texture, [0.0; 3], &taxonomy(), "mesh.mtl", frame)
        .expect("valid");
    obj::write_textured_materials(&mut library, &mesh, &texture, &taxonomy(), "mesh.png").expect("valid");
    let text = String::from_utf8(geometry.clone()).expect("text");
    assert!(text.contains("texture 2 x 1, texel 0.500 mm, 12.5 % of the surface unseen"), "{text}");

    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let materials = |_: &std::path::Path| tobj::load_mtl_buf(&mut library.as_slice());
    let (models, materials) = tobj::load_obj_buf(&mut geometry.as_slice(), &options, materials).expect("a valid OBJ");
    let materials = materials.expect("a library");
    assert!(materials.iter().all(|m| m.diffuse_texture.as_deref() == Some("mesh.png") && m.diffuse == Some([1.0; 3])));
    assert_eq!((models.len(), materials.len()), (2, 2));
    for model in &models {
        assert!(model.mesh.vertex_color.is_empty(), "readers multiply the picture by them");
        for (position, place) in model.mesh.positions.chunks_exact(3).zip(model.mesh.texcoords.chunks_exact(2)) {
            let vertex = mesh.vertices.positions.iter().position(|p| p == position).expect("a vertex");
            assert!((place[0] - places[vertex][0]).abs() < 1e-6 && (1.0 - place[1] - places[vertex][1]).abs() < 1e-6);
        }
    }

    let files = |name: &str| match name {
        "mesh.mtl" => Ok(library.clone()),
        "mesh.png" => Ok(PNG.to_vec()),
        _ => no_files(name),
    };
    let read = Geometry::read("mesh.obj", &geometry, &files).expect("own file");
    assert_eq!((read.textures.len(), read.texture_coordinates.len(), read.warnings.len()), (1, 3, 0));
    assert!((read.texture_coordinates[1][2][0] - places[4][0]).abs() < 1e-6);
}

#[test]
fn a_picture_has_a_place_for_every_vertex() {
    let (mesh, places) = mesh();
    let texture = picture(&places[1..]);
    let refused = write_textured_mesh(Vec::new(), &mesh, &texture, &taxonomy(), &GlbOptions::default());
    assert!(matches!(refused, Err(WriteError::Length { len: 7, vertices: 8, .. })), "{refused:?}");
    let refused =
        obj::write_textured_mesh_at(Vec::new(), &mesh, &texture, [0.0; 3], &taxonomy(), "a.mtl", FileFrame::TABLE);
    assert!(matches!(refused, Err(WriteError::Length { .. })), "{refused:?}");
}
