//! Files of other programs: what each says, whatever its writer's habits, and that damaged ones are refused.

use proptest::prelude::*;
use semascan_formats::{Geometry, ReadError, no_files, ply};
use std::io;

fn read(name: &str, bytes: &[u8]) -> Geometry {
    Geometry::read(name, bytes, &no_files).expect("a valid file")
}

fn refused(name: &str, bytes: &[u8]) -> String {
    let error = Geometry::read(name, bytes, &no_files).expect_err("not valid");
    assert!(matches!(&error, ReadError::Format { file, .. } if file == name));
    error.to_string()
}

fn area(geometry: &Geometry) -> f64 {
    let doubled = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| geometry.positions[v as usize]);
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        cross.iter().map(|c| c * c).sum::<f64>().sqrt()
    };
    geometry.triangles.iter().map(doubled).sum::<f64>() / 2.0
}

/// A square as PLY text, whose numbers have these types.
fn square(coordinate: &str, index: &str) -> Vec<u8> {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty {coordinate} x\nproperty {coordinate} y\nproperty {coordinate} z\n\
         element face 1\nproperty list uchar {index} vertex_indices\nend_header\n0 0 0\n40 0 0\n40 40 0\n0 40 0\n4 0 1 2 3\n"
    )
    .into_bytes()
}

#[test]
fn ply_numbers_may_be_of_any_type() {
    for coordinate in ["char", "uchar", "short", "ushort", "int", "uint", "float", "double", "int16", "float64"] {
        for index in ["char", "uchar", "short", "ushort", "int", "uint"] {
            assert_eq!(area(&read("a.ply", &square(coordinate, index))), 1600.0, "{coordinate} {index}");
        }
    }
}

#[test]
fn labels_may_be_of_any_type_and_named_as_cloudcompare_does() {
    for (kind, name) in [("ushort", "label"), ("int", "label"), ("float", "scalar_label"), ("uchar", "label")] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
             property {kind} {name}\nend_header\n0 0 0 1\n1 0 0 7\n"
        );
        assert_eq!(read("a.ply", text.as_bytes()).labels, [1, 7], "{kind} {name}");
    }
    assert!(read("a.ply", &square("float", "int")).labels.is_empty());
}

#[test]
fn colours_are_levels_or_shares() {
    for (kind, half) in [("uchar", "51"), ("ushort", "13107"), ("float", "0.2")] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
             property {kind} red\nproperty {kind} green\nproperty {kind} blue\nend_header\n0 0 0 {half} 0 0\n"
        );
        let model = ply::read("a.ply", text.as_bytes()).expect("valid");
        assert_eq!(model.mesh.vertices.colors, [[51, 0, 0]], "{kind}");
    }
}

#[test]
fn polygons_that_are_not_convex_keep_their_notch() {
    let obj = "v 0 0 0\nv 40 0 0\nv 40 10 0\nv 10 10 0\nv 10 40 0\nv 0 40 0\nf 3 4 5 6 1 2\n";
    assert_eq!(area(&read("l.obj", obj.as_bytes())), 700.0);
    let ply = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 6\n\
        property float x\nproperty float y\nproperty float z\nend_header\n6 2 3 4 5 0 1\n0 0 0\n40 0 0\n40 10 0\n10 10 0\n10 40 0\n0 40 0\n";
    assert_eq!(area(&read("l.ply", ply.as_bytes())), 700.0);
}

#[test]
fn obj_has_groups_materials_and_pictures_as_far_as_they_are_there() {
    let obj = b"mtllib my part.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nvt 1 0.5\nvt 1 1\n\
        o plate\nusemtl red\nf 1/1 2/2 3/3\ng rim\nusemtl missing\nf -5//1 -3//1 -2//1\n";
    let files = |name: &str| match name {
        "my part.mtl" => Ok(b"newmtl red\nKd 1\nmap_Kd -o 1 maps\\red.png\n".to_vec()),
        "maps/red.png" => Ok(vec![1, 2, 3]),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let geometry = Geometry::read("part.obj", obj, &files).expect("valid");
    // The vertex that no face names is left out.
    assert_eq!((geometry.positions.len(), geometry.triangles.as_slice()), (4, &[[0, 1, 2], [0, 2, 3]][..]));
    assert_eq!((geometry.colors[0], geometry.colors[3]), ([1.0, 0.0, 0.0], [1.0; 3]));
    let [plate, rim] = geometry.pieces.as_slice() else { panic!("{:?}", geometry.pieces) };
    assert_eq!((plate.name.as_str(), plate.triangles.clone(), plate.base_color), ("plate", 0..1, Some([1.0; 3])));
    assert_eq!(plate.texture.map(|t| geometry.textures[t.index].bytes.as_slice()), Some(&[1, 2, 3][..]));
    assert_eq!(geometry.texture_coordinates[0], [[0.0, 0.0], [1.0, 0.5], [1.0, 1.0]]);
    assert_eq!((rim.name.as_str(), rim.base_color, rim.texture), ("rim", None, None));
    // Without the other files it is grey, and says so.
    let bare = read("part.obj", obj);
    assert_eq!((bare.triangles.len(), bare.textures.len(), bare.warnings.is_empty()), (2, 0, false));
    assert!(refused("part.obj", b"v 0 0 0\nf 1 2 3\n").contains("vertex 2"));
    assert!(refused("part.obj", b"v 0 0 0\nf 0 1 1\n").contains("line 2"));
}

/// Two tetrahedra as STL, text with two solids, or binary with `count` in the header.
fn stl(count: Option<u32>) -> Vec<u8> {
    let corners = |shift: f32| {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| [x + shift, y, z]);
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t: [usize; 3]| t.map(|k| p[k]))
    };
    let Some(count) = count else {
        let facet = |t: [[f32; 3]; 3]| {
            let vertices = t.map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).concat();
            format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
        };
        let solid =
            |name: &str, shift| format!("solid {name}\n{}endsolid {name}\n", corners(shift).map(facet).concat());
        return (solid("left", 0.0) + &solid("right side", 5.0)).into_bytes();
    };
    let mut bytes = [&b"solid of a careless writer"[..], &[b' '; 54]].concat();
    bytes.extend(count.to_le_bytes());
    for t in corners(0.0).into_iter().chain(corners(5.0)) {
        bytes.extend([0; 12]);
        bytes.extend(t.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_is_read_whole_or_refused() {
    let text = read("a.stl", &stl(None));
    let names: Vec<&str> = text.pieces.iter().map(|p| p.name.as_str()).collect();
    assert_eq!((text.triangles.len(), text.positions.len(), names), (8, 8, vec!["left", "right side"]));
    for (count, warned) in [(8, false), (6, true), (0, true)] {
        let binary = read("a.stl", &stl(Some(count)));
        assert_eq!((binary.triangles.len(), binary.warnings.is_empty()), (8, !warned), "{count}");
    }
    let whole = stl(Some(8));
    for bad in [&stl(Some(9)), &whole[..whole.len() - 1], &stl(None)[..300], b"solid x", b""] {
        refused("a.stl", bad);
    }
}

/// A tetrahedron as GLB: POSITION of the type `component` and its numbers, and `change` made to the JSON.
fn glb(component: u32, numbers: &[u8], change: impl Fn(String) -> String) -> Vec<u8> {
    let size = numbers.len();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"tip","mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":{component},"count":4,"type":"VEC3"}},
                     {{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{size},"byteStride":{}}},{{"buffer":0,"byteOffset":{size},"byteLength":12}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        size / 4,
        size + 12
    );
    let mut json = change(json).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = [numbers, &[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]].concat();
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + json.len() + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(*b"JSON", &json), (*b"BIN\0", &binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

fn tetrahedron() -> Vec<u8> {
    [0_f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.].iter().flat_map(|f| f.to_le_bytes()).collect()
}

#[test]
fn gltf_is_placed_upright_in_double_precision() {
    let moved = |j: String| j.replace("\"mesh\":0", "\"mesh\":0,\"translation\":[500000.0625,0,-5400000.03125]");
    let geometry = read("a.glb", &glb(5126, &tetrahedron(), moved));
    assert_eq!(geometry.positions[0], [500_000.062_5, 5_400_000.031_25, 0.0]);
    assert_eq!(geometry.positions[2], [500_000.062_5, 5_400_000.031_25, 1.0]);
    assert_eq!((geometry.pieces[0].name.as_str(), geometry.triangles.len()), ("tip", 4));
    // Mirrored: the triangles keep their outside.
    let mirrored =
        read("a.glb", &glb(5126, &tetrahedron(), |j| j.replace("\"mesh\":0", "\"mesh\":0,\"scale\":[-1,1,1]")));
    assert_eq!(mirrored.triangles[0], [0, 1, 2]);
    // Placed by its joints, not by its node.
    let skinned = read(
        "a.glb",
        &glb(5126, &tetrahedron(), |j| {
            let skins = j.replace("\"scene\":0", "\"skins\":[{\"joints\":[0]}],\"scene\":0");
            skins.replace("\"mesh\":0", "\"mesh\":0,\"skin\":0,\"scale\":[9,9,9]")
        }),
    );
    assert_eq!(skinned.positions[1], [1.0, 0.0, 0.0]);
}

#[test]
fn gltf_positions_may_be_whole_numbers() {
    let numbers: Vec<u8> =
        [0_i16, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let required =
        |j: String| j.replace("\"scene\":0", "\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"scene\":0");
    assert_eq!(read("a.glb", &glb(5122, &numbers, required)).positions[1], [100.0, 0.0, 0.0]);
    let points = read("a.glb", &glb(5126, &tetrahedron(), |j| j.replace("\"indices\":1", "\"mode\":0")));
    assert_eq!((points.positions.len(), points.triangles.len()), (4, 0));
    let strip = read("a.glb", &glb(5126, &tetrahedron(), |j| j.replace("\"indices\":1", "\"mode\":5")));
    assert_eq!(strip.triangles, [[0, 1, 2], [2, 1, 3]]);
    let compressed =
        |j: String| j.replace("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"scene\":0");
    assert!(refused("a.glb", &glb(5126, &tetrahedron(), compressed)).contains("KHR_draco_mesh_compression"));
}

#[test]
fn gltf_as_text_finds_its_buffer_and_picture() {
    let json = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                     {"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC2"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":1,"byteLength":12,"byteStride":4}],
        "buffers":[{"byteLength":36,"uri":"my%20part.bin"},
                   {"byteLength":12,"uri":"data:application/octet-stream;base64,AAAAAP8AAAAA/wAA"}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1],"baseColorTexture":{"index":0}}}],
        "textures":[{"source":0}],"images":[{"uri":"a.png"}]}"#;
    let bin: Vec<u8> = [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|f| f.to_le_bytes()).collect();
    let with_picture = |name: &str| match name {
        "my part.bin" => Ok(bin.clone()),
        "a.png" => Ok(vec![7]),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let geometry = Geometry::read("a.gltf", json.as_bytes(), &with_picture).expect("valid");
    let piece = &geometry.pieces[0];
    assert_eq!((piece.name.as_str(), piece.base_color), ("node 0", Some([0.5, 0.25, 1.0])));
    assert!(piece.texture.is_some_and(|t| t.tinted) && geometry.textures[0].bytes == [7]);
    assert_eq!(geometry.texture_coordinates, [[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]]);
    // In a quarter of the picture, turned by a right angle.
    let turned = json.replace(
        r#"{"index":0}"#,
        r#"{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":1.5707963267948966,"scale":[0.5,0.5]}}}"#,
    );
    let turned = Geometry::read("a.gltf", turned.as_bytes(), &with_picture).expect("valid").texture_coordinates;
    let expected = [[0.5, 0.75], [0.5, 1.25], [1.0, 0.75]];
    let off = turned[0].iter().zip(expected).flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
    assert!(off.into_iter().all(|d: f32| d.abs() < 1e-6), "{turned:?}");
    let packed = json.replace(r#"{"source":0}"#, r#"{"extensions":{"KHR_texture_basisu":{"source":0}}}"#);
    let packed = Geometry::read("a.gltf", packed.as_bytes(), &with_picture).expect("the shape is there");
    assert!(packed.warnings[0].contains("KTX2 (KHR_texture_basisu) is not read"), "{:?}", packed.warnings);
    let without = |name: &str| if name == "a.png" { no_files(name) } else { with_picture(name) };
    let bare = Geometry::read("a.gltf", json.as_bytes(), &without).expect("the shape is there");
    assert_eq!((bare.pieces[0].texture, bare.warnings.len()), (None, 1));
    assert!(refused("a.gltf", json.as_bytes()).contains("buffer 0"));
}

#[test]
fn what_triangles_are_made_of_is_somewhere() {
    let unplaced = "v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n";
    assert!(refused("a.obj", unplaced.as_bytes()).contains("no usable number"));
    let mixed = read("a.obj", format!("{unplaced}f 2 4 3\n").as_bytes());
    assert_eq!((mixed.triangles.len(), mixed.warnings.len()), (1, 1));
    assert!(read("a.obj", b"v 0 0 nan\nv 1 0 0\n").positions[0][2].is_nan());
    assert!(refused("a.step", b"ISO-10303-21;").contains("none of"));
}

/// A cloud of two points as PLY text with further properties and their values.
fn cloud(properties: &str, first: &str, second: &str) -> Vec<u8> {
    let properties: String = properties.split(", ").map(|p| format!("property {p}\n")).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n{properties}end_header\n\
         0 0 0 {first}\n1 0 0 {second}\n"
    )
    .into_bytes()
}

#[test]
fn ply_colours_have_many_names_and_ranges() {
    let packed = f32::from_bits(0x0033_6699);
    let (whole, float) = (0x0033_6699.to_string(), format!("{packed:e}"));
    for (properties, values) in [
        ("uchar red, uchar green, uchar blue, uchar alpha", "51 102 153 255"),
        ("uchar r, uchar g, uchar b", "51 102 153"),
        ("uchar diffuse_red, uchar diffuse_green, uchar diffuse_blue", "51 102 153"),
        ("uchar Red, uchar Green, uchar Blue", "51 102 153"),
        ("float red, float green, float blue", "0.2 0.4 0.6"),
        ("float red, float green, float blue", "51 102 153"),
        ("double r, double g, double b", "0.2 0.4 0.6"),
        ("ushort red, ushort green, ushort blue", "13107 26214 39321"),
        ("ushort red, ushort green, ushort blue", "51 102 153"),
        ("int red, int green, int blue", "51 102 153"),
        ("char red, char green, char blue", "51 102 -103"),
        ("uint rgb", &whole),
        ("int rgba", &whole),
        ("float rgb", &float),
    ] {
        let model = ply::read("a.ply", &cloud(properties, values, values)).expect("valid");
        assert!(model.has("color") && model.warnings.is_empty(), "{properties}: {:?}", model.warnings);
        assert_eq!(model.mesh.vertices.colors, [[51, 102, 153]; 2], "{properties} {values}");
    }
    // A colour of which a part is missing is none.
    assert!(read("a.ply", &cloud("uchar red, uchar green", "1 2", "3 4")).colors.is_empty());
}

#[test]
fn ply_says_what_it_does_not_read() {
    let said = |properties: &str, first: &str, second: &str| {
        let geometry = read("a.ply", &cloud(properties, first, second));
        (geometry.labels, geometry.warnings.join("; "))
    };
    // The exact name counts, then the first.
    assert_eq!(
        said("float scalar_label, ushort label", "5 1", "6 2"),
        (vec![1, 2], "is not read: vertex scalar_label".into())
    );
    assert_eq!(said("int label, int label", "5 1", "6 2").0, [5, 6]);
    let (labels, warnings) = said("float scalar_Classification, float intensity", "nan 0.5", "3 0.5");
    assert!(
        labels == [0, 3] && warnings.contains("vertex intensity") && warnings.contains("1 values of label"),
        "{warnings}"
    );
    let (labels, warnings) = said("int label", "-1", "70000");
    assert!(labels == [0, 0] && warnings.contains("2 values of label"), "{warnings}");
    assert_eq!(said("uint label", "65535", "0"), (vec![65_535, 0], String::new()));
    // Counts that are too small, and lines of another length.
    let text = String::from_utf8(cloud("int label", "1", "2")).expect("text");
    let fewer = read("a.ply", text.replace("vertex 2", "vertex 1").as_bytes());
    assert!(fewer.positions.len() == 1 && fewer.warnings[0].contains("does not count"), "{:?}", fewer.warnings);
    assert!(refused("a.ply", text.replace("vertex 2", "vertex 3").as_bytes()).contains("vertex 2"));
    assert!(refused("a.ply", text.replace("0 0 0 1", "0 0 0 1 9").as_bytes()).contains("vertex 0: its line has more"));
    assert!(refused("a.ply", text.replace("property float z\n", "").as_bytes()).contains("no x, y and z"));
    let faces = "element edge 1\nproperty int vertex1\nelement face 2\nproperty uchar red\nproperty list uchar int vertex_index\nend_header";
    let mesh = text.replace("vertex 2", "vertex 3").replace("end_header", faces) + "2 0 0 3\n7\n9 2 0 1\n9 3 0 1 2\n";
    let mesh = read("a.ply", mesh.as_bytes());
    let warnings = mesh.warnings.join("; ");
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(["1 elements `edge`", "face red", "1 faces of fewer"].iter().all(|w| warnings.contains(w)), "{warnings}");
}

#[test]
fn ply_strips_are_triangles() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 2\n";
    assert_eq!(read("a.ply", text.as_bytes()).triangles, [[0, 1, 2], [2, 1, 3], [0, 1, 2]]);
}

#[test]
fn text_may_end_its_lines_and_write_its_numbers_as_it_likes() {
    let ply = "ply\nformat ascii 1.0\ncomment Geh\u{e4}use\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
        end_header\n1.5E+01 -1.#IND00 +.5\n-nan(ind) 1D2 1.#INF\n";
    let obj = "# C:\\parts\\\nv 15 0 0\nv 1 \\\n 1 0 # a corner\nv 0 1 0\nvt nan 1\no Geh\u{e4}use#2\nf -3/1 -2/1 \\\n-1/1\np 1\n";
    let stl = "Solid Geh\u{e4}use\nFACET NORMAL nan 0 1\nOUTER LOOP\nVERTEX 1.5E1 0 0 vertex 1 0 0 vertex 0 1 0\nENDLOOP\nENDFACET\nEndSolid x vertex\n";
    let pcd = "# Geh\u{e4}use\nFIELDS x y z\nSIZE 4 4 4\nTYPE f F F\nWIDTH 2\nHEIGHT 1\nDATA ASCII\n15 0 0\n-nan(ind) 1.#QNAN nan\n";
    let latin1 = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    for (name, text) in [("a.ply", ply), ("a.obj", obj), ("a.stl", stl), ("a.pcd", pcd)] {
        for end in ["\n", "\r\n", "\r"] {
            let text = text.replace('\n', end);
            for bytes in [text.as_bytes(), &latin1(&text), format!("\u{feff}{text}").as_bytes()] {
                let geometry = read(name, bytes);
                assert_eq!(geometry.positions[0][0], 15.0, "{name} {end:?}");
                match name {
                    "a.ply" => assert!(geometry.positions[0][1].is_nan() && geometry.positions[1][1] == 100.0),
                    "a.pcd" => assert!(geometry.positions[1].iter().all(|c| c.is_nan())),
                    _ => assert_eq!(geometry.triangles, [[0, 1, 2]], "{name}"),
                }
                if name == "a.obj" {
                    let warnings = geometry.warnings.join("; ");
                    assert_eq!(geometry.pieces[0].name, "Geh\u{e4}use#2");
                    assert!(warnings.contains("1 points, lines") && warnings.contains("1 texture"), "{warnings}");
                }
                if name == "a.stl" {
                    assert_eq!(geometry.pieces[0].name, "Geh\u{e4}use");
                }
            }
        }
    }
    // Where lines end with CR alone, an LF is the first byte of the data.
    let head = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar y\rproperty uchar z\rend_header\r";
    assert_eq!(read("a.ply", &[head.as_bytes(), b"\n\r\n"].concat()).positions, [[10.0, 13.0, 10.0]]);
}

#[test]
fn obj_finds_what_other_computers_named() {
    let obj = b"mtllib C:\\models\\part.mtl\nv 0 0 0 255 0 0\nv 1 0 0 0 255 0\nv 0 1 0 0 0 51\nusemtl steel\nf 1 2 3\nusemtl rubber\nf 3 2 1\nf 1 2\n";
    let files = |name: &str| match name {
        "part.mtl" => Ok(b"newmtl steel\rKd 128 0 0".to_vec()),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let geometry = Geometry::read("part.obj", obj, &files).expect("valid");
    assert_eq!(geometry.pieces[0].base_color.map(|c| c[0] > 0.1 && c[1] == 0.0), Some(true));
    assert!(geometry.colors[0] == [1.0, 0.0, 0.0] && geometry.colors[2][2] < 0.1, "levels of 0..=255");
    let warnings = geometry.warnings.join("; ");
    assert!(warnings.contains("rubber") && warnings.contains("1 faces of fewer"), "{warnings}");
}

#[test]
fn pcd_keeps_labels_and_colours_and_counts_the_rest() {
    let file = |fields: &str, kinds: &str, sizes: &str, rows: &str| {
        format!("FIELDS x y z {fields}\nSIZE 4 4 4 {sizes}\nTYPE F F F {kinds}\nWIDTH 2\nHEIGHT 1\nDATA ascii\n{rows}")
            .into_bytes()
    };
    let float = format!("{:e}", f32::from_bits(0xff33_6699_u32 & 0x00ff_ffff));
    for (fields, kinds, sizes, values) in [
        ("rgb", "U", "4", "3368601".to_owned()),
        ("rgba", "U", "4", "4281558681".to_owned()),
        ("rgb", "F", "4", float),
        // The whole number as a float, as early versions of PCL have it.
        ("rgb", "F", "4", "3368601".to_owned()),
        ("r g b", "U U U", "1 1 1", "51 102 153".to_owned()),
        ("red green blue", "F F F", "4 4 4", "0.2 0.4 0.6".to_owned()),
        ("red green blue", "U U U", "2 2 2", "13107 26214 39321".to_owned()),
    ] {
        let rows = format!("0 0 0 {values}\n1 0 0 {values}\n");
        let colors = read("a.pcd", &file(fields, kinds, sizes, &rows)).colors;
        let levels = colors.iter().map(|c| c.map(|l| (l.powf(1.0 / 2.2) * 255.0).round() as u8));
        assert_eq!(levels.collect::<Vec<_>>(), [[51, 102, 153]; 2], "{fields} {kinds} {values}");
    }
    for (kind, size) in [("U", 1), ("I", 2), ("U", 4), ("F", 4), ("F", 8)] {
        let geometry = read("a.pcd", &file("label", kind, &size.to_string(), "0 0 0 1\n1 0 0 7\n"));
        assert_eq!(geometry.labels, [1, 7], "{kind}{size}");
    }
    let odd = read("a.pcd", &file("scalar_Label intensity", "F F", "4 4", "0 0 0 nan 1\n1 0 0 70000 1\n2 0 0 3 1\n"));
    let warnings = odd.warnings.join("; ");
    assert_eq!(odd.labels, [0, 0]);
    assert!(
        ["not read: intensity", "1 points follow", "1 labels are no", "1 labels are over"]
            .iter()
            .all(|w| warnings.contains(w)),
        "{warnings}"
    );
    assert!(refused("a.pcd", &file("label", "U", "1", "0 0 0 1 9\n1 0 0 7\n")).contains("more numbers"));
}

#[test]
fn stl_without_a_count_is_read_by_its_length() {
    let placeholder = read("a.stl", &stl(Some(u32::MAX)));
    assert_eq!((placeholder.triangles.len(), placeholder.warnings.len()), (8, 1));
    let quad = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 2 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    assert_eq!(area(&read("a.stl", quad.as_bytes())), 2.0);
    assert!(refused("a.stl", quad.replace("vertex 2 1 0\nvertex 0 1 0\n", "").as_bytes()).contains("2 vertices"));
}

#[test]
fn gltf_instances_stand_where_they_are_put() {
    // The accessor of the translations is the tetrahedron's own positions.
    let instanced = |j: String| {
        let extension = "\"mesh\":0,\"scale\":[2,2,2],\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":0}}}";
        let required = "\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"],\"scene\":0";
        j.replace("\"mesh\":0", extension).replace("\"scene\":0", required)
    };
    let geometry = read("a.glb", &glb(5126, &tetrahedron(), instanced));
    assert_eq!((geometry.triangles.len(), geometry.positions.len()), (16, 16));
    // y up becomes z up; the node's scale takes the places of the instances along.
    assert_eq!((geometry.positions[5], geometry.positions[8]), ([4.0, 0.0, 0.0], [0.0, 0.0, 2.0]));
    let none = |j: String| instanced(j).replace("{\"TRANSLATION\":0}", "{}");
    assert!(refused("a.glb", &glb(5126, &tetrahedron(), none)).contains("instances"));
}

#[test]
fn gltf_skins_hold_the_vertices() {
    // Joint 1 is 3 to the right, and holds every vertex (joint 0 of the skin, whose accessor is zeros).
    let skinned = |j: String| {
        j.replace("\"nodes\":[{", "\"skins\":[{\"joints\":[1]}],\"nodes\":[{\"skin\":0,\"scale\":[100,100,100],")
            .replace("\"mesh\":0}]", "\"mesh\":0},{\"translation\":[3,0,0]}]")
            .replace("\"POSITION\":0", "\"POSITION\":0,\"JOINTS_0\":2,\"WEIGHTS_0\":3")
            .replace(
                "\"type\":\"SCALAR\"}],",
                "\"type\":\"SCALAR\"},{\"bufferView\":2,\"componentType\":5121,\"count\":4,\"type\":\"VEC4\"},\
                 {\"bufferView\":3,\"componentType\":5121,\"normalized\":true,\"count\":4,\"type\":\"VEC4\"}],",
            )
            // Within the numbers of the positions: zeros, and the end of 1.0 in single precision.
            .replace("\"byteLength\":12}],", "\"byteLength\":12},{\"buffer\":0,\"byteLength\":12,\"byteStride\":1},{\"buffer\":0,\"byteOffset\":12,\"byteLength\":16}],")
    };
    let geometry = read("a.glb", &glb(5126, &tetrahedron(), skinned));
    assert_eq!(geometry.positions[0], [3.0, 0.0, 0.0]);
    let missing = |j: String| skinned(j).replace("\"joints\":[1]", "\"joints\":[9]");
    assert!(refused("a.glb", &glb(5126, &tetrahedron(), missing)).contains("node 9"));
}

#[test]
fn gltf_sparse_numbers_take_the_place_of_others() {
    let sparse = |j: String| {
        j.replace(
            "\"count\":4,\"type\":\"VEC3\"}",
            "\"count\":4,\"type\":\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"byteOffset\":1,\"componentType\":5121},\
             \"values\":{\"bufferView\":0,\"byteOffset\":12}}}",
        )
    };
    // Vertex 2 gets the place of vertex 1.
    assert_eq!(read("a.glb", &glb(5126, &tetrahedron(), sparse)).positions[2], [1.0, 0.0, 0.0]);
    let alone = |j: String| sparse(j).replace("{\"bufferView\":0,\"componentType\":5126,", "{\"componentType\":5126,");
    let positions = read("a.glb", &glb(5126, &tetrahedron(), alone)).positions;
    assert_eq!((positions[1], positions[2]), ([0.0; 3], [1.0, 0.0, 0.0]));
    let past = |j: String| sparse(j).replace("\"count\":4,\"type\":\"VEC3\"", "\"count\":2,\"type\":\"VEC3\"");
    assert!(refused("a.glb", &glb(5126, &tetrahedron(), past)).contains("sparse"));
}

#[test]
fn gltf_points_have_normals_and_what_is_left_out_is_said() {
    let points = |j: String| {
        j.replace("\"indices\":1", "\"mode\":0").replace("\"POSITION\":0", "\"POSITION\":0,\"NORMAL\":0,\"COLOR_0\":0")
    };
    let geometry = read("a.glb", &glb(5126, &tetrahedron(), points));
    assert_eq!((geometry.normals[2], geometry.colors[2]), ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]));
    let lines = read("a.glb", &glb(5126, &tetrahedron(), |j| j.replace("\"indices\":1", "\"mode\":1")));
    assert!(lines.warnings[0].contains("1 primitives of lines"), "{:?}", lines.warnings);
    let both =
        |j: String| j.replace("\"primitives\":[{", "\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":0},{");
    let both = read("a.glb", &glb(5126, &tetrahedron(), both));
    assert!(both.positions.len() == 4 && both.warnings[0].contains("4 points beside"), "{:?}", both.warnings);
    let bare = |j: String| j.replace("\"scene\":0,\"scenes\":[{\"nodes\":[0]}],", "");
    assert_eq!(read("a.glb", &glb(5126, &tetrahedron(), bare)).triangles.len(), 4);
    let old = br#"{"asset":{"version":"1.0"},"scenes":{"a":{"nodes":["n"]}}}"#;
    assert!(refused("a.gltf", old).contains("glTF 1.0"));
}

/// `count` copies of `item` with commas.
fn repeated(item: &str, count: usize) -> String {
    vec![item; count].join(",")
}

#[test]
fn what_few_bytes_stand_for_is_bounded_and_the_limit_named() {
    let primitive = "{\"attributes\":{\"POSITION\":0},\"indices\":1}";
    // As many primitives as instances: 9 000 000 pieces of a file of 155 kB.
    let squared = |j: String| {
        j.replace(primitive, &repeated(primitive, 3000))
            .replace("\"mesh\":0", "\"mesh\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":2}}}")
            .replace("\"type\":\"SCALAR\"}],", "\"type\":\"SCALAR\"},{\"componentType\":5126,\"count\":3000,\"type\":\"VEC3\",\
                \"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5121},\"values\":{\"bufferView\":0}}}],")
    };
    // Nodes, each with all of one large mesh, most of which the file does not hold.
    let absent = |count: usize| {
        move |j: String| {
            j.replace(
                "\"count\":4,\"type\":\"VEC3\"}",
                &format!(
                    "\"count\":{count},\"type\":\"VEC3\",\"sparse\":{{\"count\":1,\
                    \"indices\":{{\"bufferView\":1,\"componentType\":5121}},\"values\":{{\"bufferView\":0}}}}}}"
                ),
            )
            .replace("{\"bufferView\":0,\"componentType\":5126,", "{\"componentType\":5126,")
        }
    };
    let nodes = |j: String| {
        absent(1_000_000)(j)
            .replace(
                "[{\"name\":\"tip\",\"mesh\":0}]",
                &format!("[{}]", repeated("{\"name\":\"tip\",\"mesh\":0}", 1000)),
            )
            .replace(
                "\"nodes\":[0]",
                &format!("\"nodes\":[{}]", (0..1000).map(|n| n.to_string()).collect::<Vec<_>>().join(",")),
            )
    };
    for (change, limit) in [
        (&squared as &dyn Fn(String) -> String, "100000 primitives"),
        (&nodes, "4000060 triangles or vertices"),
        (&absent(2_000_000), "1048576 are the most"),
    ] {
        let error = refused("part.glb", &glb(5126, &tetrahedron(), change));
        assert!(error.starts_with("part.glb") && error.contains(limit), "{error}");
    }
    // A name is kept with each piece.
    let named = |j: String| j.replace("tip", &"x".repeat(100_000)).replace(primitive, &repeated(primitive, 1000));
    let geometry = read("a.glb", &glb(5126, &tetrahedron(), named));
    assert_eq!((geometry.pieces.len(), geometry.pieces[999].name.len()), (1000, 256));
    let mut obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\no {}\n", "x".repeat(100_000));
    (0..1000).for_each(|k| obj.push_str(&format!("usemtl {}\nf 1 2 3\n", k % 2)));
    assert!(read("a.obj", obj.as_bytes()).pieces.iter().all(|p| p.name.len() == 256));
    // Packed data of a ratio that the packing allows, past what is unpacked.
    let length = 1_100_000_000_u32;
    let mut pcd = format!(
        "FIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4084\nWIDTH {}\nHEIGHT 1\nDATA binary_compressed\n",
        length / 4096
    )
    .into_bytes();
    let stated = length / 4096 * 4096;
    pcd.extend([(stated / 88).to_le_bytes(), stated.to_le_bytes()].concat());
    assert!(refused("a.pcd", &pcd).contains("1073741824 are the most"));
}

#[test]
fn named_files_stay_in_the_folder() {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("part");
    std::fs::create_dir(&folder).expect("made");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("written");
    std::fs::write(root.path().join("secret.bin"), [7; 48]).expect("written");
    std::fs::write(root.path().join("secret.mtl"), "newmtl a\nKd 1 0 0\n").expect("written");
    let gltf = |uri: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{uri}"}}]}}"#
        )
    };
    let absolute = root.path().join("secret.bin").display().to_string();
    for uri in [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "..%2fsecret.bin",
        "file:///etc/passwd",
        "http://127.0.0.1/a.bin",
        &absolute,
    ] {
        write("a.gltf", gltf(uri).as_bytes());
        let error = semascan_formats::read_file(&folder.join("a.gltf")).expect_err(uri).to_string();
        assert!(error.contains("a.gltf") && error.contains("folder of the file that names it"), "{uri}: {error}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", folder.join("link.bin")).expect("links");
        std::os::unix::fs::symlink("/dev/zero", folder.join("zero.bin")).expect("links");
        for uri in ["link.bin", "zero.bin"] {
            write("a.gltf", gltf(uri).as_bytes());
            let error = semascan_formats::read_file(&folder.join("a.gltf")).expect_err(uri).to_string();
            assert!(error.contains(uri) && error.contains("does not lie in the folder"), "{error}");
        }
    }
    // A library costs the colours, and that is said.
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    for library in ["../secret.mtl", &root.path().join("secret.mtl").display().to_string(), "http://127.0.0.1/a.mtl"] {
        write("a.obj", format!("mtllib {library}\n{faces}").as_bytes());
        let geometry = semascan_formats::read_file(&folder.join("a.obj")).expect("a mesh");
        assert_eq!(geometry.pieces[0].base_color, None, "{library}");
        assert!(
            geometry.warnings.iter().any(|w| w.contains("material library is left out")),
            "{:?}",
            geometry.warnings
        );
    }
    write("a.mtl", b"newmtl a\nKd 1 0 0\nmap_Kd ../secret.bin\n");
    write("a.obj", format!("mtllib a.mtl\nvt 0 0\n{}", faces.replace("f 1 2 3", "f 1/1 2/1 3/1")).as_bytes());
    let geometry = semascan_formats::read_file(&folder.join("a.obj")).expect("a mesh");
    assert_eq!((geometry.pieces[0].base_color, geometry.textures.len()), (Some([1.0, 0.0, 0.0]), 0));
    assert!(geometry.warnings.iter().any(|w| w.contains("a picture is left out")), "{:?}", geometry.warnings);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn damaged_files_never_panic(
        which in 0_usize..7,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        whole in any::<bool>(),
    ) {
        let obj = b"mtllib a.mtl\nv 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nvt 0 1\no a\nusemtl b\nf 1/1 2/1 3/1 4/1\nf -1 -2 -3\n";
        let pcd = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n1 2 3\n4 5 6\n";
        let (name, mut bytes) = match which {
            0 => ("a.ply", square("float", "int")),
            1 => ("a.obj", obj.to_vec()),
            2 => ("a.stl", stl(None)),
            3 => ("a.stl", stl(Some(8))),
            4 => ("a.glb", glb(5126, &tetrahedron(), |j| j)),
            5 => ("a.gltf", glb(5126, &tetrahedron(), |j| j)),
            _ => ("a.pcd", pcd.to_vec()),
        };
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let end = if whole { bytes.len() } else { cut.index(bytes.len()) };
        if let Ok(geometry) = Geometry::read(name, &bytes[..end], &no_files) {
            prop_assert!(geometry.triangles.iter().flatten().all(|v| (*v as usize) < geometry.positions.len()));
            prop_assert_eq!(geometry.pieces.last().map_or(0, |p| p.triangles.end), geometry.triangles.len());
        }
    }
}
