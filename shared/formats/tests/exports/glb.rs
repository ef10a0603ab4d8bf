//! The point-cloud scene, read by the `gltf` crate.

use super::{any_cloud, taxonomy};
use proptest::prelude::*;
use semascan_formats::gltf::{GlbOptions, SceneColors, write_points};
use semascan_model::{FeatureFigures, ModelFigures, PointFlags, SemanticCloud, SemanticPoint};

fn scene(cloud: &SemanticCloud, colors: SceneColors) -> gltf::Gltf {
    let mut bytes = Vec::new();
    let options = GlbOptions { part: "motor".into(), colors, ..GlbOptions::default() };
    write_points(&mut bytes, cloud, &taxonomy(), &options).expect("a Vec takes everything");
    gltf::Gltf::from_slice(&bytes).expect("a valid GLB")
}

/// One point of a primitive.
struct Vertex {
    position: [f32; 3],
    normal: Option<[f32; 3]>,
    color: Option<[u16; 4]>,
}

/// Positions, normals where there are any, and colours of a node's points.
fn vertices(scene: &gltf::Gltf, node: &gltf::Node<'_>) -> Vec<Vertex> {
    let mut all = Vec::new();
    for primitive in node.mesh().expect("a component has a mesh").primitives() {
        assert_eq!(primitive.mode(), gltf::mesh::Mode::Points);
        let reader = primitive.reader(|_| scene.blob.as_deref());
        let mut normals = reader.read_normals();
        let mut colors = reader.read_colors(0).map(|c| c.into_rgba_u16());
        let bounds = primitive.bounding_box();
        for position in reader.read_positions().expect("positions") {
            assert!((0..3).all(|a| (bounds.min[a]..=bounds.max[a]).contains(&position[a])));
            let normal = normals.as_mut().map(|n| n.next().expect("a normal a point"));
            let color = colors.as_mut().map(|c| c.next().expect("a colour a point"));
            all.push(Vertex { position, normal, color });
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_cloud_comes_back_in_either_colors(cloud in any_cloud()) {
        for (colors, colored) in [(SceneColors::Surface, true), (SceneColors::Classes, false)] {
            let gltf = scene(&cloud, colors);
            prop_assert_eq!(gltf.scenes().len(), 1);
            let scene = gltf.default_scene().expect("one scene");
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
                prop_assert_eq!(got.len(), sent.len());
                for (p, Vertex { position, normal, color }) in sent.iter().zip(&got) {
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
    let cloud: SemanticCloud = [point(0.1, 2), point(0.2, 1), point(0.3, 2)].into_iter().collect();
    let housing = FeatureFigures { id: 2, component: 2, points: 2, area: Some(2e-6), confidence: 0.5, sigma: 0.25 };
    let figures = ModelFigures { components: vec![housing], ..ModelFigures::default() };
    let mut bytes = Vec::new();
    let options = GlbOptions { part: "motor".into(), figures, ..GlbOptions::default() };
    write_points(&mut bytes, &cloud, &taxonomy(), &options).expect("a Vec takes everything");
    let gltf = gltf::Gltf::from_slice(&bytes).expect("a valid GLB");
    let root = gltf.default_scene().and_then(|s| s.nodes().next()).expect("a root");
    let matrix = root.transform().matrix();
    // Column-major: table z maps to glTF y.
    let up: Vec<i32> = matrix[2].iter().map(|c| c.round() as i32).collect();
    assert_eq!(up, [0, 1, 0, 0]);
    let names: Vec<_> = root.children().map(|n| n.name().unwrap_or_default().to_owned()).collect();
    assert_eq!(names, ["housing", "electrical connection"]);
    let last = root.children().last().expect("two");
    let extras: serde_json::Value = serde_json::from_str(last.extras().as_ref().expect("extras").get()).expect("JSON");
    let figure = |name: &str| extras[name].as_f64();
    assert_eq!(
        [figure("area"), figure("confidence"), figure("sigma"), figure("points")],
        [2e-6, 0.5, 0.25, 2.0].map(Some)
    );
    let color = vertices(&gltf, &last)[0].color.expect("a colour");
    // sRGB 188 is half the light.
    assert!(color[0].abs_diff(32_768) < 300 && color[1] == 0 && color[2] == u16::MAX, "{color:?}");
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
    let gltf = scene(&cloud, SceneColors::Surface);
    let node = gltf.nodes().find(|n| n.mesh().is_some()).expect("a component");
    assert_eq!(node.name(), Some("class 9"));
    assert_eq!(vertices(&gltf, &node).len(), 1);
}

#[test]
fn an_empty_cloud_is_a_valid_file() {
    let gltf = scene(&SemanticCloud::default(), SceneColors::Surface);
    assert_eq!((gltf.scenes().len(), gltf.meshes().len(), gltf.blob), (1, 0, None));
}
