//! Meshes of every format, whole and broken.

use super::*;
use proptest::prelude::*;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    o bottom\nf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\no top\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n";

fn written(name: &str, content: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("written");
    (folder, path)
}

fn volume(mesh: &SceneMesh) -> f32 {
    let corner = |i: u32| Vec3::from_array(mesh.vertices[i as usize]);
    mesh.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0).sum()
}

#[test]
fn obj_objects_become_classes() {
    let (_folder, path) = written("cube.obj", CUBE.as_bytes());
    let imported = read(&path, Some(1.0)).expect("a cube");
    assert_eq!(imported.names, ["bottom", "top"]);
    assert_eq!(imported.mesh.triangles.len(), 12);
    assert!((volume(&imported.mesh) - 1.0).abs() < 1e-5);
    // A cube's corners are sharp: every corner normal is its face's.
    for (t, n) in imported.mesh.triangles.iter().zip(&imported.mesh.normals) {
        let [a, b, c] = t.map(|i| Vec3::from_array(imported.mesh.vertices[i as usize]));
        let face = (b - a).cross(c - a).normalize();
        assert!(n.iter().all(|n| n.dot(face) > 0.999));
    }
}

#[test]
fn ply_reads_text_with_colours() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n4 0 1 2 3\n";
    let (_folder, path) = written("quad.ply", text.as_bytes());
    let imported = read(&path, Some(1.0)).expect("a quad");
    assert_eq!(imported.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(imported.mesh.tints[0][0], Vec3::X);
    let (_folder, path) = written("far.ply", text.replace("4 0 1 2 3", "4 0 1 2 9").as_bytes());
    let message = read(&path, Some(1.0)).expect_err("vertex 9 of 4").to_string();
    assert!(message.contains("far.ply") && message.contains('9'), "{message}");
}

#[test]
fn stl_reads_what_its_crate_writes() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(stl_io::Vertex::new);
    let triangle = stl_io::Triangle { normal: stl_io::Normal::new([0.0, 0.0, 1.0]), vertices };
    let mut content = Vec::new();
    stl_io::write_stl(&mut content, [triangle].iter()).expect("written");
    let (_folder, path) = written("one.stl", &content);
    assert_eq!(read(&path, Some(1.0)).expect("a triangle").mesh.triangles.len(), 1);
    let (_folder, path) = written("cut.stl", &content[..content.len() - 20]);
    assert!(read(&path, Some(1.0)).expect_err("truncated").to_string().contains("cut.stl"));
}

/// A right-handed tetrahedron as glTF, its buffer inside; `change` spoils the text.
fn tetrahedron(change: impl Fn(String) -> String) -> Vec<u8> {
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"name":"tip","mesh":0,"scale":[2,2,2]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
                     {"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
        "buffers":[{"byteLength":60}]}"#;
    let mut json = change(json.to_owned()).into_bytes();
    json.resize(json.len().div_ceil(4) * 4, b' ');
    let corners: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
    let mut binary: Vec<u8> = corners.iter().flat_map(|f| f.to_le_bytes()).collect();
    binary.extend([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + json.len() + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(*b"JSON", &json), (*b"BIN\0", &binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

#[test]
fn gltf_is_read_upright_and_placed() {
    let (_folder, path) = written("t.glb", &tetrahedron(|j| j));
    let mesh = read(&path, Some(1.0)).expect("a tetrahedron").mesh;
    assert!((volume(&mesh) - 8.0 / 6.0).abs() < 1e-5);
    assert!(mesh.vertices.contains(&[0.0, 0.0, 2.0]), "glTF's y is up: {:?}", mesh.vertices);
}

#[test]
fn broken_gltf_is_refused_with_a_reason() {
    type Spoil = fn(String) -> String;
    let cases: [(&str, Spoil); 6] = [
        ("accessor 0", |j| j.replace("\"count\":4", "\"count\":400")),
        ("mesh 0 primitive 0", |j| j.replace("\"count\":12", "\"count\":18446744073709551615")),
        ("buffer view 1", |j| j.replace("\"byteOffset\":48", "\"byteOffset\":49")),
        ("POSITION", |j| j.replace("POSITION", "NORMAL")),
        ("nest without end", |j| j.replace("\"mesh\":0,", "\"children\":[0],")),
        ("buffer 0", |j| j.replace("{\"byteLength\":60}", "{\"byteLength\":60,\"uri\":\"%ff%\"}")),
    ];
    for (word, spoil) in cases {
        let (_folder, path) = written("bad.glb", &tetrahedron(spoil));
        let message = read(&path, Some(1.0)).expect_err(word).to_string();
        assert!(message.contains(word) && message.contains("bad.glb"), "{word}: {message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn damaged_files_never_panic(at in 0_usize..700, byte in any::<u8>(), cut in 0_usize..900) {
        for (name, content) in [("a.glb", tetrahedron(|j| j)), ("a.obj", CUBE.as_bytes().to_vec())] {
            let mut content = content;
            if let Some(b) = content.get_mut(at) {
                *b = byte;
            }
            content.truncate(cut.max(1));
            let (_folder, path) = written(name, &content);
            let _ = read(&path, Some(1.0));
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(content in proptest::collection::vec(any::<u8>(), 0..300), kind in 0_usize..5) {
        let head: &[u8] = [b"ply\nformat ascii 1.0\n".as_slice(), b"glTF\x02\0\0\0", b"solid x\n", b"v 1 2 3\n", b""][kind];
        for name in ["a.obj", "a.ply", "a.stl", "a.gltf", "a.glb"] {
            let (_folder, path) = written(name, &[head, content.as_slice()].concat());
            let _ = read(&path, Some(1.0));
        }
    }
}
