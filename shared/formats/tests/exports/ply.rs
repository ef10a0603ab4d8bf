//! `cloud.ply` and `truth.ply`, read by `ply-rs`.

use super::{any_cloud, taxonomy};
use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Ply, Property};
use proptest::prelude::*;
use semascan_formats::export::ExportError;
use semascan_formats::export::ply::{LabelledMesh, write_cloud, write_mesh};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};

fn cloud_ply(cloud: &SemanticCloud, comments: &[(String, String)]) -> Ply<DefaultElement> {
    let mut bytes = Vec::new();
    write_cloud(&mut bytes, cloud, &taxonomy(), comments).expect("a Vec takes everything");
    Parser::<DefaultElement>::new().read_ply(&mut bytes.as_slice()).expect("a valid PLY")
}

fn float(element: &DefaultElement, name: &str) -> f32 {
    match element[name] {
        Property::Float(v) => v,
        ref other => panic!("{name}: {other:?}"),
    }
}

fn short(element: &DefaultElement, name: &str) -> u16 {
    match element[name] {
        Property::UShort(v) => v,
        ref other => panic!("{name}: {other:?}"),
    }
}

fn byte(element: &DefaultElement, name: &str) -> u8 {
    match element[name] {
        Property::UChar(v) => v,
        ref other => panic!("{name}: {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_cloud_comes_back_from_ply(cloud in any_cloud()) {
        let ply = cloud_ply(&cloud, &[]);
        let names: Vec<_> = ply.header.elements["vertex"].properties.keys().cloned().collect();
        prop_assert_eq!(
            names.join(" "),
            "x y z nx ny nz red green blue label confidence defect defect_confidence sigma defect_sigma instance views flags"
        );
        let read = &ply.payload["vertex"];
        prop_assert_eq!(read.len(), cloud.len());
        for (e, p) in read.iter().zip(cloud.iter()) {
            let back = SemanticPoint {
                position: ["x", "y", "z"].map(|n| float(e, n)),
                normal: ["nx", "ny", "nz"].map(|n| float(e, n)),
                color: ["red", "green", "blue"].map(|n| byte(e, n)),
                label: short(e, "label"),
                confidence: float(e, "confidence"),
                defect: short(e, "defect"),
                defect_confidence: float(e, "defect_confidence"),
                sigma: float(e, "sigma"),
                defect_sigma: float(e, "defect_sigma"),
                instance: short(e, "instance"),
                views: short(e, "views"),
                flags: PointFlags(short(e, "flags")),
            };
            prop_assert_eq!(back, p);
        }
    }
}

#[test]
fn an_empty_cloud_is_a_valid_file() {
    assert_eq!(cloud_ply(&SemanticCloud::default(), &[]).payload["vertex"].len(), 0);
}

#[test]
fn comments_name_the_classes_and_cannot_break_the_header() {
    let hostile = ("voxel".to_owned(), "0.001\nelement vertex 99\r".to_owned());
    let ply = cloud_ply(&SemanticCloud::default(), &[hostile]);
    let taxonomy = taxonomy();
    let named = |kind: &str, id: u16, name: &str, c: [u8; 3]| {
        format!("{kind} {id} {name} #{:02x}{:02x}{:02x}", c[0], c[1], c[2])
    };
    let comments = ply.header.comments.join("\n");
    for line in [
        named("label", 2, "electrical connection", taxonomy.components[2].color),
        named("defect", 1, "corrosion", taxonomy.defects[1].color),
        "voxel 0.001 element vertex 99".into(),
    ] {
        assert!(comments.contains(&line), "{line} is not in {comments}");
    }
    assert_eq!(ply.header.elements["vertex"].count, 0);
}

#[test]
fn a_mesh_comes_back_and_a_broken_one_is_refused() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [1.0, 1.0, 0.5]];
    let triangles = [[0, 1, 2], [2, 1, 3]];
    let (labels, defects) = ([1, 1, 2, 2], [0, 0, 0, 1]);
    let mesh = LabelledMesh { vertices: &vertices, triangles: &triangles, labels: &labels, defects: &defects };
    let mut bytes = Vec::new();
    write_mesh(&mut bytes, &mesh, &taxonomy(), &[]).expect("a valid mesh");
    let ply = Parser::<DefaultElement>::new().read_ply(&mut bytes.as_slice()).expect("a valid PLY");
    for (e, i) in ply.payload["vertex"].iter().zip(0..) {
        assert_eq!(["x", "y", "z"].map(|n| float(e, n)), vertices[i]);
        assert_eq!((short(e, "label"), short(e, "defect")), (labels[i], defects[i]));
    }
    for (e, triangle) in ply.payload["face"].iter().zip(triangles) {
        let Property::ListInt(corners) = &e["vertex_indices"] else { panic!("{e:?}") };
        assert_eq!(*corners, triangle.map(|v| v as i32));
    }
    let short_column = LabelledMesh { labels: &labels[..3], ..mesh };
    let refused = write_mesh(Vec::new(), &short_column, &taxonomy(), &[]);
    assert!(matches!(refused, Err(ExportError::Length { column: "labels", .. })));
    let wrong_vertex = LabelledMesh { triangles: &[[0, 1, 4]], ..mesh };
    let refused = write_mesh(Vec::new(), &wrong_vertex, &taxonomy(), &[]);
    assert!(matches!(refused, Err(ExportError::Vertex { triangle: 0, vertex: 4, .. })));
}
