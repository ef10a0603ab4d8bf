//! Meshes in all formats, read back by this crate's readers, by those of others and by hand.

use super::taxonomy;
use proptest::prelude::*;
use semascan_formats::gltf::{GlbOptions, SceneColors, write_mesh as write_glb};
use semascan_formats::ply::{read, write_cloud, write_semantic_mesh};
use semascan_formats::{FileFrame, Geometry, UpAxis, WriteError, no_files, obj, stl};
use semascan_model::LengthUnit;
use semascan_model::{PointFlags, SemanticMesh, SemanticPoint};

/// A mesh of the points of any cloud, joined at random.
pub(crate) fn any_mesh() -> impl Strategy<Value = SemanticMesh> {
    (super::any_cloud(), prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..40)).prop_map(
        |(mut vertices, triangles)| {
            let n = vertices.len() as u32;
            vertices.flags.iter_mut().for_each(|f| f.0 &= !PointFlags::BOUNDARY);
            let boundary = (0..n).map(|v| v % 3 == 0).collect();
            let triangles = triangles.into_iter().filter(|_| n > 0).map(|t| t.map(|v| v % n)).collect();
            SemanticMesh { vertices, boundary, triangles }
        },
    )
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn mesh_ply_comes_back_whole(mesh in any_mesh()) {
        let comments = [("voxel".to_owned(), "0.0005".to_owned()), ("part".to_owned(), "starter motor 7".to_owned())];
        let mut bytes = Vec::new();
        write_semantic_mesh(&mut bytes, &mesh, &taxonomy(), &comments).expect("a Vec takes everything");
        let back = read("a.ply", &bytes).expect("own file");
        prop_assert_eq!(&back.mesh, &mesh);
        prop_assert_eq!(&back.taxonomy, &taxonomy());
        prop_assert_eq!((back.voxel(), back.comment("part")), (Some(0.0005), Some("starter motor 7")));
    }

    #[test]
    fn cloud_ply_comes_back_whole(cloud in super::any_cloud()) {
        let mut bytes = Vec::new();
        write_cloud(&mut bytes, &cloud, &taxonomy(), &[]).expect("a Vec takes everything");
        let mut back = read("a.ply", &bytes).expect("own file").mesh;
        prop_assert!(back.triangles.is_empty());
        for v in 0..back.len() {
            back.vertices.flags[v] = back.flags(v);
        }
        prop_assert_eq!(back.vertices, cloud);
    }

    #[test]
    fn glb_holds_every_triangle_under_its_component(mesh in any_mesh()) {
        let mut bytes = Vec::new();
        for (colors, colored) in [(SceneColors::Surface, true), (SceneColors::Classes, false)] {
            let options = GlbOptions { part: "motor".into(), colors, ..GlbOptions::default() };
            bytes.clear();
            write_glb(&mut bytes, &mesh, &taxonomy(), &options).expect("a valid mesh");
            let gltf = gltf::Gltf::from_slice(&bytes).expect("a valid GLB");
            // Lit without metal, which is right unlit as well.
            prop_assert!(gltf.extensions_used().all(|e| e != "KHR_materials_unlit"));
            for material in gltf.materials() {
                prop_assert_eq!(material.pbr_metallic_roughness().metallic_factor(), 0.0);
                prop_assert!(taxonomy().components.iter().any(|c| Some(c.name.as_str()) == material.name()) || material.name() == Some("class 3"));
                let white = material.pbr_metallic_roughness().base_color_factor() == [1.0; 4];
                prop_assert_eq!(white, colored);
            }
            prop_assert_eq!(gltf.scenes().len(), 1);
            let scene = gltf.default_scene().expect("one scene");
            let root = scene.nodes().next().expect("a root");
            let mut triangles = 0;
            for node in root.children() {
                let extras: serde_json::Value = serde_json::from_str(node.extras().as_ref().expect("extras").get()).expect("JSON");
                let label = extras["class"].as_u64().expect("a class") as u16;
                let mut sent: Vec<[[f32; 3]; 3]> = mesh.triangles.iter().filter(|t| mesh.triangle_label(**t) == label).filter_map(|t| mesh.corners(*t)).collect();
                let primitive = node.mesh().expect("a mesh").primitives().next().expect("a primitive");
                let reader = primitive.reader(|_| gltf.blob.as_deref());
                let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
                let indices: Vec<usize> = reader.read_indices().expect("indices").into_u32().map(|i| i as usize).collect();
                let mut got: Vec<[[f32; 3]; 3]> = indices.chunks_exact(3).map(|t| [positions[t[0]], positions[t[1]], positions[t[2]]]).collect();
                let order = |a: &[[f32; 3]; 3], b: &[[f32; 3]; 3]| a.partial_cmp(b).expect("numbers");
                sent.sort_by(order);
                got.sort_by(order);
                prop_assert_eq!(&got, &sent);
                prop_assert_eq!(reader.read_colors(0).is_some(), colored);
                triangles += got.len();
            }
            prop_assert_eq!(triangles, mesh.triangles.len());
        }
    }

    #[test]
    fn stl_holds_each_component_apart(mesh in any_mesh()) {
        let mut sum = 0;
        for label in [None, Some(0), Some(1), Some(2), Some(3)] {
            let mut bytes = Vec::new();
            stl::write_mesh(&mut bytes, &mesh, label, "starter motor", FileFrame::TABLE).expect("a valid mesh");
            prop_assert!(!bytes.starts_with(b"solid"));
            let count = u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]) as usize;
            prop_assert_eq!(bytes.len(), 84 + 50 * count);
            let sent = mesh.triangles.iter().filter(|t| label.is_none_or(|l| mesh.triangle_label(**t) == l));
            for (record, t) in bytes[84..].chunks_exact(50).zip(sent.clone()) {
                let corners: Vec<f32> = mesh.corners(*t).expect("there").iter().flatten().copied().collect();
                prop_assert_eq!(&floats(&record[12..48]), &corners);
                prop_assert_eq!(u16::from_le_bytes([record[48], record[49]]), mesh.triangle_label(*t));
            }
            prop_assert_eq!(count, sent.count());
            if label.is_some() { sum += count } else { prop_assert_eq!(count, mesh.triangles.len()) }
        }
        prop_assert_eq!(sum, mesh.triangles.len());
    }

    #[test]
    fn other_readers_take_obj_and_stl(mesh in any_mesh()) {
        let (mut geometry, mut solid) = (Vec::new(), Vec::new());
        obj::write_mesh(&mut geometry, &mesh, &taxonomy(), "mesh.mtl", FileFrame::TABLE).expect("a valid mesh");
        let mut library = Vec::new();
        obj::write_materials(&mut library, &mesh, &taxonomy()).expect("a valid mesh");
        let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
        let materials = |_: &std::path::Path| tobj::load_mtl_buf(&mut library.as_slice());
        let (models, materials) = tobj::load_obj_buf(&mut geometry.as_slice(), &options, materials).expect("a valid OBJ");
        let materials = materials.expect("a valid library");
        let triangles: usize = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
        prop_assert_eq!(triangles, mesh.triangles.len());
        for model in models.iter().filter(|m| !m.mesh.indices.is_empty()) {
            prop_assert_eq!(&materials[model.mesh.material_id.expect("a material")].name, &model.name);
        }
        stl::write_mesh(&mut solid, &mesh, None, "a", FileFrame::TABLE).expect("a valid mesh");
        let read = stl_io::read_stl(&mut std::io::Cursor::new(solid)).expect("a valid STL");
        prop_assert_eq!(read.faces.len(), mesh.triangles.len());
    }

    #[test]
    fn obj_holds_objects_that_name_their_material(mesh in any_mesh()) {
        let (mut geometry, mut library) = (Vec::new(), Vec::new());
        obj::write_mesh(&mut geometry, &mesh, &taxonomy(), "mesh.mtl", FileFrame::TABLE).expect("a valid mesh");
        obj::write_materials(&mut library, &mesh, &taxonomy()).expect("a valid mesh");
        let (geometry, library) = (String::from_utf8(geometry).expect("text"), String::from_utf8(library).expect("text"));
        let (mut positions, mut group, mut faces) = (Vec::new(), String::new(), 0);
        for line in geometry.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["v", x, y, z, ..] => positions.push([x, y, z].map(|c| c.parse::<f32>().expect("a number"))),
                ["o", name] => group = name.to_owned(),
                ["usemtl", name] => {
                    prop_assert_eq!(name, &group);
                    prop_assert!(library.contains(&format!("newmtl {name}\n")), "{} of {}", name, library);
                }
                ["f", a, b, c] => {
                    let t = [a, b, c].map(|v| v.split('/').next().expect("an index").parse::<u32>().expect("a number") - 1);
                    prop_assert!(mesh.triangles.contains(&t));
                    let name = taxonomy().components.get(usize::from(mesh.triangle_label(t))).map_or("class_3".into(), |c| c.name.replace(' ', "_"));
                    prop_assert_eq!(&group, &name);
                    faces += 1;
                }
                _ => {}
            }
        }
        prop_assert_eq!(&positions, &mesh.vertices.positions);
        prop_assert_eq!(faces, mesh.triangles.len());
    }

    #[test]
    fn damaged_files_are_refused_and_never_crash(mesh in any_mesh(), cut in any::<prop::sample::Index>(), at in any::<prop::sample::Index>(), bit in 0..8_u32) {
        let mut bytes = Vec::new();
        write_semantic_mesh(&mut bytes, &mesh, &taxonomy(), &[]).expect("a Vec takes everything");
        let _ = read("a.ply", &bytes[..cut.index(bytes.len())]);
        let at = at.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        let _ = read("a.ply", &bytes);
    }
}

#[test]
fn a_triangle_without_its_vertex_is_refused_everywhere() {
    let mesh = SemanticMesh { triangles: vec![[0, 1, 2]], ..SemanticMesh::default() };
    let options = GlbOptions { part: String::new(), ..GlbOptions::default() };
    let refused = [
        write_semantic_mesh(Vec::new(), &mesh, &taxonomy(), &[]),
        write_glb(Vec::new(), &mesh, &taxonomy(), &options),
        stl::write_mesh(Vec::new(), &mesh, None, "", FileFrame::default()),
        obj::write_mesh(Vec::new(), &mesh, &taxonomy(), "", FileFrame::default()),
    ];
    for result in refused {
        assert!(matches!(result, Err(WriteError::Vertex { triangle: 0, vertices: 0, .. })), "{result:?}");
    }
}

#[test]
fn what_single_precision_cannot_hold_is_noted_as_the_origin() {
    let corners = [[0.25, 0.0, 0.0], [1.0, 0.5, 0.0], [0.0, 1.0, 2.0]];
    let mut mesh = SemanticMesh::default();
    for position in corners {
        mesh.push(SemanticPoint { position, ..SemanticPoint::UNKNOWN }, false);
    }
    mesh.triangles.push([0, 1, 2]);
    let shift = [500_000.0, 4_100_000.0, 0.0];
    let stl_at = |shift, frame| {
        let mut bytes = Vec::new();
        stl::write_mesh_at(&mut bytes, &mesh, shift, None, "housing", frame).expect("a valid mesh");
        (String::from_utf8_lossy(&bytes[..80]).trim_end().to_owned(), floats(&bytes[96..132]))
    };
    let relative: Vec<f32> = corners.as_flattened().to_vec();
    let (header, written) = stl_at(shift, FileFrame::TABLE);
    assert_eq!((header.as_str(), &written), ("semascan: unit m, z up, origin 500000 4100000 0 m, housing", &relative));
    let (header, _) = stl_at(shift, FileFrame { unit: LengthUnit::Millimetres, up: UpAxis::Y });
    assert_eq!(header, "semascan: unit mm, y up, origin 500000 0 -4100000 m, housing");
    assert_eq!(stl_at([0.0; 3], FileFrame::TABLE).0, "semascan: unit m, z up, housing");

    for (shift, generation, extras) in [
        (shift, None, serde_json::json!({ "origin": shift })),
        (shift, Some("7"), serde_json::json!({ "generation": "7", "origin": shift })),
        ([0.0; 3], None, serde_json::Value::Null),
    ] {
        let options = GlbOptions { generation: generation.map(str::to_owned), shift, ..GlbOptions::default() };
        let mut bytes = Vec::new();
        write_glb(&mut bytes, &mesh, &taxonomy(), &options).expect("a valid mesh");
        let scene = gltf::Gltf::from_slice(&bytes).expect("a valid GLB");
        let noted = scene.document.as_json().asset.extras.as_ref().map(|raw| raw.get().to_owned());
        let noted = noted.map_or(serde_json::Value::Null, |text| serde_json::from_str(&text).expect("JSON"));
        assert_eq!(noted, extras);
        let primitive = scene.meshes().flat_map(|mesh| mesh.primitives()).next().expect("a component");
        assert_eq!(primitive.bounding_box().max, [1.0, 1.0, 2.0]);
    }
}

#[test]
fn other_programs_files_are_read() {
    let text = b"ply\nformat ascii 1.0\nobj_info x\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nproperty float quality\nelement face 1\nproperty list uchar uint vertex_index\nproperty int material\nend_header\n0 0 0 1\n1 0 0 1\n1 1 0.5 1\n0 1 0.5 1\n4 0 1 2 3 7\n";
    let model = read("a.ply", text).expect("a valid file");
    assert_eq!(model.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(model.mesh.vertices.positions[2], [1.0, 1.0, 0.5]);
    assert_eq!(model.voxel(), None);
    for bad in [
        &b"plx\n"[..],
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 zero 0\n",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n",
        b"ply\nformat binary_middle_endian 1.0\nend_header\n",
    ] {
        assert!(read("a.ply", bad).is_err(), "{}", String::from_utf8_lossy(bad));
    }
}

/// Corner positions of all triangles, in an order that does not depend on the file.
fn soup(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[[f64; 3]; 3]> {
    let mut all: Vec<_> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
    all.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_format_that_is_written_is_read(mesh in any_mesh(), cut in any::<prop::sample::Index>(), bit in 0..8_u32) {
        let positions: Vec<[f64; 3]> = mesh.vertices.positions.iter().map(|p| p.map(f64::from)).collect();
        let sent = soup(&positions, &mesh.triangles);
        let options = GlbOptions { part: "motor".into(), ..GlbOptions::default() };
        let mut files: Vec<(&str, Vec<u8>)> = ["a.ply", "a.obj", "a.STL", "a.glb"].map(|name| (name, Vec::new())).into();
        write_semantic_mesh(&mut files[0].1, &mesh, &taxonomy(), &[]).expect("a valid mesh");
        obj::write_mesh(&mut files[1].1, &mesh, &taxonomy(), "a.mtl", FileFrame::TABLE).expect("a valid mesh");
        stl::write_mesh(&mut files[2].1, &mesh, None, "a", FileFrame::TABLE).expect("a valid mesh");
        write_glb(&mut files[3].1, &mesh, &taxonomy(), &options).expect("a valid mesh");
        for (name, mut bytes) in files {
            let geometry = Geometry::read(name, &bytes, &no_files).expect("own file");
            let got = soup(&geometry.positions, &geometry.triangles);
            prop_assert_eq!(got.len(), sent.len());
            let near = |a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]| (0..9).all(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs() < 1e-12);
            // A GLB is turned and turned back. Text holds the shortest number that gives the same `f32`.
            let same = match name {
                "a.glb" => sent.iter().all(|t| got.iter().any(|g| near(t, g))),
                "a.obj" => soup(&single_precision(&geometry.positions), &geometry.triangles) == sent,
                _ => got == sent,
            };
            prop_assert!(same, "{}", name);
            if bytes.is_empty() {
                continue;
            }
            let at = cut.index(bytes.len());
            let _ = Geometry::read(name, &bytes[..at], &no_files);
            bytes[at] ^= 1_u8 << bit;
            let _ = Geometry::read(name, &bytes, &no_files);
        }
        prop_assert!(Geometry::read("a.step", b"", &no_files).is_err());
    }

    #[test]
    fn obj_and_stl_are_in_the_unit_and_with_the_axis_that_they_note(mesh in any_mesh(), inches in any::<bool>(), y in any::<bool>()) {
        let frame = FileFrame {
            unit: if inches { LengthUnit::Inches } else { LengthUnit::Millimetres },
            up: if y { UpAxis::Y } else { UpAxis::Z },
        };
        let (mut text, mut solid) = (Vec::new(), Vec::new());
        obj::write_mesh(&mut text, &mesh, &taxonomy(), "a.mtl", frame).expect("a valid mesh");
        stl::write_mesh(&mut solid, &mesh, None, "a", frame).expect("a valid mesh");
        let perimeter = |positions: &[[f64; 3]], triangles: &[[u32; 3]]| -> f64 {
            let length = |a: u32, b: u32| (0..3).map(|k| (positions[a as usize][k] - positions[b as usize][k]).powi(2)).sum::<f64>().sqrt();
            triangles.iter().map(|t| length(t[0], t[1]) + length(t[1], t[2]) + length(t[2], t[0])).sum()
        };
        let sent: Vec<[f64; 3]> = mesh.vertices.positions.iter().map(|p| p.map(f64::from)).collect();
        let heights = |positions: &[[f64; 3]], triangles: &[[u32; 3]], axis: usize| {
            let all = triangles.iter().flatten().map(|v| positions[*v as usize][axis]);
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)))
        };
        let per_metre = if inches { 1.0 / 0.0254 } else { 1000.0 };
        for (name, bytes) in [("a.obj", text), ("a.stl", solid)] {
            let found = Geometry::read(name, &bytes, &no_files).expect("own file");
            prop_assert_eq!(found.unit, Some(frame.unit), "{}", name);
            let (expected, got) = (per_metre * perimeter(&sent, &mesh.triangles), perimeter(&found.positions, &found.triangles));
            prop_assert!((expected - got).abs() <= 1e-4 * expected + 1e-3, "{}: {} {}", name, expected, got);
            let (low, high) = heights(&sent, &mesh.triangles, 2);
            let (found_low, found_high) = heights(&found.positions, &found.triangles, if y { 1 } else { 2 });
            if !mesh.triangles.is_empty() {
                prop_assert!((low * per_metre - found_low).abs() < 0.01 && (high * per_metre - found_high).abs() < 0.01, "{}", name);
            }
        }
    }
}

fn single_precision(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    positions.iter().map(|p| p.map(|c| f64::from(c as f32))).collect()
}
