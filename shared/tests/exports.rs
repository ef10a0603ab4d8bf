//! Exports read back by other people's readers: `ply-rs` and `gltf`.

use proptest::prelude::*;
use semascan_shared::export::glb::{GlbOptions, write_points};
use semascan_shared::export::ply::{LabelledMesh, write_cloud, write_mesh};
use semascan_shared::export::{ExportError, ExportFilter};
use semascan_shared::model::{PointFlags, SemanticCloud, SemanticPoint, Taxonomy};

use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Ply, Property};

fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["housing", "electrical connection"], &["corrosion"])
}

fn any_point() -> impl Strategy<Value = SemanticPoint> {
    let normal = (-1.0_f32..1.0, 0.0_f32..6.3, any::<bool>());
    let shares = [0.0_f32..1.0, 0.0_f32..1.0, 0.0_f32..1.0, 0.0_f32..1.0];
    let numbers = (
        0_u16..4,
        any::<u16>(),
        any::<u16>(),
        any::<u16>(),
        any::<u16>(),
    );
    (
        [-9.0_f32..9.0, -9.0_f32..9.0, -9.0_f32..9.0],
        normal,
        any::<[u8; 3]>(),
        shares,
        numbers,
    )
        .prop_map(
            |(
                position,
                (z, angle, known),
                color,
                shares,
                (label, defect, instance, views, flags),
            )| {
                let r = (1.0 - z * z).sqrt();
                SemanticPoint {
                    position,
                    normal: if known {
                        [r * angle.cos(), r * angle.sin(), z]
                    } else {
                        [0.0; 3]
                    },
                    color,
                    label,
                    confidence: shares[0],
                    defect,
                    defect_confidence: shares[1],
                    sigma: shares[2],
                    defect_sigma: shares[3],
                    instance,
                    views,
                    flags: PointFlags(flags),
                }
            },
        )
}

fn any_cloud() -> impl Strategy<Value = SemanticCloud> {
    prop::collection::vec(any_point(), 0..60).prop_map(|points| points.into_iter().collect())
}

fn cloud_ply(cloud: &SemanticCloud, comments: &[(String, String)]) -> Ply<DefaultElement> {
    let mut bytes = Vec::new();
    write_cloud(&mut bytes, cloud, &taxonomy(), comments).expect("a Vec takes everything");
    Parser::<DefaultElement>::new()
        .read_ply(&mut bytes.as_slice())
        .expect("a valid PLY")
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

fn scene(cloud: &SemanticCloud) -> gltf::Gltf {
    let mut bytes = Vec::new();
    let options = GlbOptions {
        part: "motor".into(),
        voxel: 0.001,
    };
    write_points(&mut bytes, cloud, &taxonomy(), &options).expect("a Vec takes everything");
    gltf::Gltf::from_slice(&bytes).expect("a valid GLB")
}

/// Positions, normals where there are any, and colours of a node's points.
fn vertices(
    scene: &gltf::Gltf,
    node: &gltf::Node<'_>,
) -> Vec<([f32; 3], Option<[f32; 3]>, Option<[u16; 4]>)> {
    let mut all = Vec::new();
    for primitive in node.mesh().expect("a component has a mesh").primitives() {
        assert_eq!(primitive.mode(), gltf::mesh::Mode::Points);
        let reader = primitive.reader(|_| scene.blob.as_deref());
        let mut normals = reader.read_normals();
        let mut colors = reader.read_colors(0).map(|c| c.into_rgba_u16());
        let bounds = primitive.bounding_box();
        for position in reader.read_positions().expect("positions") {
            assert!((0..3).all(|a| (bounds.min[a]..=bounds.max[a]).contains(&position[a])));
            let normal = normals
                .as_mut()
                .map(|n| n.next().expect("a normal a point"));
            let color = colors.as_mut().map(|c| c.next().expect("a colour a point"));
            all.push((position, normal, color));
        }
    }
    all
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

    #[test]
    fn a_cloud_comes_back_from_both_scenes(cloud in any_cloud()) {
        let gltf = scene(&cloud);
        let names: Vec<_> = gltf.scenes().map(|s| s.name().unwrap_or_default().to_owned()).collect();
        prop_assert_eq!(names, ["appearance", "semantics"]);
        for (scene, colored) in gltf.scenes().zip([true, false]) {
            let root = scene.nodes().next().expect("a root");
            let mut points = 0;
            for node in root.children() {
                let extras: serde_json::Value =
                    serde_json::from_str(node.extras().as_ref().expect("extras").get()).expect("JSON");
                let label = extras["class"].as_u64().expect("a class") as u16;
                let mut sent: Vec<_> = cloud.iter().filter(|p| p.label == label).collect();
                // Oriented points come first.
                sent.sort_by_key(|p| p.normal == [0.0; 3]);
                let got = vertices(&gltf, &node);
                prop_assert_eq!(extras["points"].as_u64(), Some(got.len() as u64));
                prop_assert_eq!(got.len(), sent.len());
                for (p, (position, normal, color)) in sent.iter().zip(&got) {
                    prop_assert_eq!(p.position, *position);
                    prop_assert_eq!(normal.is_some(), p.normal != [0.0; 3]);
                    prop_assert_eq!(color.is_some(), colored);
                    if let Some(n) = normal {
                        prop_assert!((n.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-5);
                    }
                }
                points += got.len();
            }
            prop_assert_eq!(points, cloud.len());
        }
    }
}

#[test]
fn the_scene_stands_upright_and_names_its_components() {
    let point = |z: f32, label: u16| SemanticPoint {
        position: [0.0, 0.0, z],
        normal: [0.0, 0.0, 1.0],
        color: [188, 0, 255],
        label,
        confidence: 0.5,
        defect: 0,
        defect_confidence: 1.0,
        sigma: 0.0,
        defect_sigma: 0.0,
        instance: 0,
        views: 1,
        flags: PointFlags::default(),
    };
    let gltf = scene(
        &[point(0.1, 2), point(0.2, 1), point(0.3, 2)]
            .into_iter()
            .collect(),
    );
    let root = gltf
        .default_scene()
        .and_then(|s| s.nodes().next())
        .expect("a root");
    let matrix = root.transform().matrix();
    // Column-major: table z maps to glTF y.
    let up: Vec<i32> = matrix[2].iter().map(|c| c.round() as i32).collect();
    assert_eq!(up, [0, 1, 0, 0]);
    let names: Vec<_> = root
        .children()
        .map(|n| n.name().unwrap_or_default().to_owned())
        .collect();
    assert_eq!(names, ["housing", "electrical connection"]);
    let last = root.children().last().expect("two");
    let extras: serde_json::Value =
        serde_json::from_str(last.extras().as_ref().expect("extras").get()).expect("JSON");
    // Two voxel faces of 1 mm.
    assert!((extras["area"].as_f64().expect("an area") - 2e-6).abs() < 1e-9);
    assert_eq!(extras["confidence"].as_f64(), Some(0.5));
    let color = vertices(&gltf, &last)[0].2.expect("a colour");
    // sRGB 188 is half the light.
    assert!(
        color[0].abs_diff(32_768) < 300 && color[1] == 0 && color[2] == u16::MAX,
        "{color:?}"
    );
}

#[test]
fn what_gltf_cannot_hold_is_left_out() {
    let mut cloud: SemanticCloud = std::iter::repeat_n(
        SemanticPoint {
            position: [1.0; 3],
            normal: [0.0; 3],
            color: [0; 3],
            label: 9,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 0.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags::default(),
        },
        2,
    )
    .collect();
    cloud.positions[0] = [f32::NAN, 0.0, 0.0];
    let gltf = scene(&cloud);
    let node = gltf
        .nodes()
        .find(|n| n.mesh().is_some())
        .expect("a component");
    assert_eq!(node.name(), Some("class 9"));
    assert_eq!(vertices(&gltf, &node).len(), 1);
}

#[test]
fn an_empty_cloud_is_a_valid_file() {
    let empty = SemanticCloud::default();
    assert_eq!(cloud_ply(&empty, &[]).payload["vertex"].len(), 0);
    let gltf = scene(&empty);
    assert_eq!(
        (gltf.scenes().len(), gltf.meshes().len(), gltf.blob),
        (2, 0, None)
    );
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
        named(
            "label",
            2,
            "electrical connection",
            taxonomy.components[2].color,
        ),
        named("defect", 1, "corrosion", taxonomy.defects[1].color),
        "voxel 0.001 element vertex 99".into(),
    ] {
        assert!(comments.contains(&line), "{line} is not in {comments}");
    }
    assert_eq!(ply.header.elements["vertex"].count, 0);
}

#[test]
fn a_mesh_comes_back_and_a_broken_one_is_refused() {
    let vertices = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.5],
        [1.0, 1.0, 0.5],
    ];
    let triangles = [[0, 1, 2], [2, 1, 3]];
    let (labels, defects) = ([1, 1, 2, 2], [0, 0, 0, 1]);
    let mesh = LabelledMesh {
        vertices: &vertices,
        triangles: &triangles,
        labels: &labels,
        defects: &defects,
    };
    let mut bytes = Vec::new();
    write_mesh(&mut bytes, &mesh, &taxonomy(), &[]).expect("a valid mesh");
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut bytes.as_slice())
        .expect("a valid PLY");
    for (e, i) in ply.payload["vertex"].iter().zip(0..) {
        assert_eq!(["x", "y", "z"].map(|n| float(e, n)), vertices[i]);
        assert_eq!(
            (short(e, "label"), short(e, "defect")),
            (labels[i], defects[i])
        );
    }
    for (e, triangle) in ply.payload["face"].iter().zip(triangles) {
        let Property::ListInt(corners) = &e["vertex_indices"] else {
            panic!("{e:?}")
        };
        assert_eq!(*corners, triangle.map(|v| v as i32));
    }
    let short_column = LabelledMesh {
        labels: &labels[..3],
        ..mesh
    };
    let refused = write_mesh(Vec::new(), &short_column, &taxonomy(), &[]);
    assert!(matches!(
        refused,
        Err(ExportError::Length {
            column: "labels",
            ..
        })
    ));
    let wrong_vertex = LabelledMesh {
        triangles: &[[0, 1, 4]],
        ..mesh
    };
    let refused = write_mesh(Vec::new(), &wrong_vertex, &taxonomy(), &[]);
    assert!(matches!(
        refused,
        Err(ExportError::Vertex {
            triangle: 0,
            vertex: 4,
            ..
        })
    ));
}

#[test]
fn the_filter_leaves_out_what_it_says() {
    let flags = [0, PointFlags::RADIUS_OUTLIER, PointFlags::BACKGROUND];
    let labels = [1_u16, 1, 2];
    let mut cloud = SemanticCloud::default();
    for (flags, label) in flags.into_iter().zip(labels) {
        cloud.push(SemanticPoint {
            position: [0.0; 3],
            normal: [0.0; 3],
            color: [0; 3],
            label,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(flags),
        });
    }
    assert_eq!(ExportFilter::default().apply(&cloud), cloud);
    let no_outliers = ExportFilter {
        skip_flags: PointFlags::OUTLIER,
        ..Default::default()
    };
    assert_eq!(no_outliers.apply(&cloud).labels, [1, 2]);
    let no_first = ExportFilter {
        hidden_labels: [1].into(),
        ..Default::default()
    };
    assert_eq!(no_first.apply(&cloud).labels, [2]);
}
