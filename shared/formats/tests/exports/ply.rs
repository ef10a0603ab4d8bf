//! The bytes of `cloud.ply` and `truth.ply`: other programs read these, so they are checked one by one and not by our reader.

use super::taxonomy;
use semascan_formats::WriteError;
use semascan_formats::ply::{LabelledMesh, read, write_cloud, write_mesh};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};

fn cloud_ply(cloud: &SemanticCloud, comments: &[(String, String)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_cloud(&mut bytes, cloud, &taxonomy(), comments).expect("a Vec takes everything");
    bytes
}

/// The lines up to `end_header`, and the bytes after it.
fn parts(bytes: &[u8]) -> (Vec<&str>, &[u8]) {
    const END: &[u8] = b"end_header\n";
    let end = bytes.windows(END.len()).position(|w| w == END).expect("an end");
    (std::str::from_utf8(&bytes[..end]).expect("text").lines().collect(), &bytes[end + END.len()..])
}

#[test]
fn a_point_is_these_bytes() {
    let point = SemanticPoint {
        position: [1.5, -2.0, 0.25],
        normal: [0.0, 0.6, -0.8],
        color: [1, 2, 255],
        label: 0x0102,
        confidence: 0.75,
        defect: 3,
        defect_confidence: 0.5,
        sigma: 0.125,
        defect_sigma: 0.0625,
        instance: 4,
        views: 65535,
        flags: PointFlags(0x8001),
    };
    let bytes = cloud_ply(&[point].into_iter().collect(), &[("voxel".into(), "0.0005".into())]);
    let (header, row) = parts(&bytes);
    assert_eq!(header[..3], ["ply", "format binary_little_endian 1.0", "comment voxel 0.0005"]);
    let properties: Vec<&str> = header.iter().filter_map(|line| line.strip_prefix("property ")).collect();
    assert_eq!(
        properties.join(", "),
        "float32 x, float32 y, float32 z, float32 nx, float32 ny, float32 nz, uint8 red, uint8 green, uint8 blue, \
         uint16 label, float32 confidence, uint16 defect, float32 defect_confidence, float32 sigma, \
         float32 defect_sigma, uint16 instance, uint16 views, uint16 flags"
    );
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let expected = [
        &floats(&[1.5, -2.0, 0.25, 0.0, 0.6, -0.8])[..],
        &[1, 2, 255, 2, 1],
        &floats(&[0.75]),
        &[3, 0],
        &floats(&[0.5, 0.125, 0.0625]),
        &[4, 0, 255, 255, 1, 0x80],
    ];
    assert_eq!(row, expected.concat());
}

#[test]
fn an_empty_cloud_is_a_valid_file() {
    let bytes = cloud_ply(&SemanticCloud::default(), &[]);
    assert!(read("a.ply", &bytes).expect("valid").mesh.is_empty() && parts(&bytes).1.is_empty());
}

#[test]
fn comments_name_the_classes_and_cannot_break_the_header() {
    let hostile = ("voxel".to_owned(), "0.001\nelement vertex 99\r".to_owned());
    let bytes = cloud_ply(&SemanticCloud::default(), &[hostile]);
    let (header, taxonomy) = (parts(&bytes).0, taxonomy());
    let named = |kind: &str, id: u16, name: &str, c: [u8; 3]| {
        format!("comment {kind} {id} {name} #{:02x}{:02x}{:02x}", c[0], c[1], c[2])
    };
    for line in [
        named("label", 2, "electrical connection", taxonomy.components[2].color),
        named("defect", 1, "corrosion", taxonomy.defects[1].color),
        "comment voxel 0.001 element vertex 99 ".into(),
        "element vertex 0".into(),
    ] {
        assert!(header.contains(&line.as_str()), "{line} is not in {header:?}");
    }
}

#[test]
fn a_mesh_comes_back_and_a_broken_one_is_refused() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [1.0, 1.0, 0.5]];
    let triangles = [[0, 1, 2], [2, 1, 3]];
    let (labels, defects) = ([1, 1, 2, 2], [0, 0, 0, 1]);
    let mesh = LabelledMesh { vertices: &vertices, triangles: &triangles, labels: &labels, defects: &defects };
    let mut bytes = Vec::new();
    write_mesh(&mut bytes, &mesh, &taxonomy(), &[]).expect("a valid mesh");
    let (header, body) = parts(&bytes);
    assert_eq!(header.last(), Some(&"property list uint8 int32 vertex_indices"));
    let vertex = |v: usize| {
        let place = vertices[v].iter().flat_map(|c: &f32| c.to_le_bytes());
        place.chain([labels[v], defects[v]].iter().flat_map(|c: &u16| c.to_le_bytes()).collect::<Vec<_>>())
    };
    let face = |t: [u32; 3]| std::iter::once(3).chain(t.into_iter().flat_map(u32::to_le_bytes));
    let expected: Vec<u8> = (0..4).flat_map(vertex).chain(triangles.into_iter().flat_map(face)).collect();
    assert_eq!(body, expected);
    let back = read("a.ply", &bytes).expect("own file");
    assert_eq!((back.has("label"), back.has("confidence")), (true, false));
    assert_eq!((back.mesh.vertices.labels.as_slice(), back.mesh.triangles.as_slice()), (&labels[..], &triangles[..]));
    let short_column = LabelledMesh { labels: &labels[..3], ..mesh };
    let refused = write_mesh(Vec::new(), &short_column, &taxonomy(), &[]);
    assert!(matches!(refused, Err(WriteError::Length { column: "labels", .. })));
    let wrong_vertex = LabelledMesh { triangles: &[[0, 1, 4]], ..mesh };
    let refused = write_mesh(Vec::new(), &wrong_vertex, &taxonomy(), &[]);
    assert!(matches!(refused, Err(WriteError::Vertex { triangle: 0, vertex: 4, .. })));
}

#[test]
fn a_model_on_a_map_keeps_its_shift() {
    let positions =
        [[500_000.25, 5_400_000.5, 200.125], [500_000.75, 5_400_000.25, 200.0], [500_000.5, 5_400_000.0, 200.5]];
    let rows: String = positions.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n"
    );
    let model = read("a.ply", text.as_bytes()).expect("valid");
    assert_eq!((model.shift, model.mesh.vertices.positions[0]), ([500_001.0, 5_400_000.0, 200.0], [-0.75, 0.5, 0.125]));
    let (mut cloud, mut mesh, mut obj) = (Vec::new(), Vec::new(), Vec::new());
    semascan_formats::ply::write_cloud_at(&mut cloud, &model.mesh.vertices, model.shift, &model.taxonomy, &[])
        .expect("written");
    semascan_formats::ply::write_semantic_mesh_at(&mut mesh, &model.mesh, model.shift, &model.taxonomy, &[])
        .expect("written");
    semascan_formats::obj::write_mesh_at(
        &mut obj,
        &model.mesh,
        model.shift,
        &model.taxonomy,
        "a.mtl",
        semascan_formats::FileFrame::TABLE,
    )
    .expect("written");
    for (name, bytes) in [("cloud.ply", cloud), ("mesh.ply", mesh), ("mesh.obj", obj)] {
        let found = semascan_formats::Geometry::read(name, &bytes, &semascan_formats::no_files).expect("valid");
        assert_eq!(found.positions, positions, "{name}");
    }
}
