//! What a GLB says its vertices belong to, read back from the extensions as they are specified: nothing here knows how
//! they were written.

use super::{any_cloud, mesh::any_mesh, taxonomy};
use gltf::Gltf;
use proptest::prelude::*;
use semascan_formats::gltf::{GlbOptions, write_mesh, write_points};
use semascan_geometry::measure::model_figures;
use semascan_model::{ClassDef, SemanticCloud, SemanticMesh};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// A row of a property table.
#[derive(Clone, Debug, PartialEq)]
struct Feature {
    id: u16,
    name: String,
    color: [u8; 3],
    points: Option<u32>,
    area: Option<f32>,
    confidence: Option<f32>,
    sigma: Option<f32>,
    component: Option<u16>,
}

/// A file with its metadata.
struct Scene {
    gltf: Gltf,
    metadata: Value,
}

impl Scene {
    fn read(bytes: &[u8]) -> Self {
        let gltf = Gltf::from_slice(bytes).expect("a valid GLB");
        let metadata = gltf.extension_value("EXT_structural_metadata").cloned().unwrap_or_default();
        Self { gltf, metadata }
    }

    /// The bytes of a buffer view.
    fn view(&self, index: &Value) -> &[u8] {
        let view = self.gltf.views().nth(index.as_u64().expect("an index") as usize).expect("a buffer view");
        assert_eq!((view.offset() % 8, view.stride(), view.target()), (0, None, None), "a column of a table");
        &self.gltf.blob.as_ref().expect("a buffer")[view.offset()..view.offset() + view.length()]
    }

    /// The rows of property table `index`.
    fn table(&self, index: &Value) -> Vec<Feature> {
        let table = &self.metadata["propertyTables"][index.as_u64().expect("an index") as usize];
        let class = &self.metadata["schema"]["classes"][table["class"].as_str().expect("a class")]["properties"];
        let count = table["count"].as_u64().expect("a count") as usize;
        let column = |name: &str, kind: &str, component: &str| -> Option<&[u8]> {
            let values = table["properties"].get(name)?;
            assert_eq!(class[name]["type"], kind);
            assert_eq!(class[name]["componentType"].as_str().unwrap_or_default(), component);
            Some(self.view(&values["values"]))
        };
        let short = |bytes: &[u8], i: usize| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]);
        let word = |bytes: &[u8], i: usize| -> [u8; 4] { bytes[4 * i..4 * i + 4].try_into().expect("four") };
        let [ids, colors, names] = [("id", "SCALAR", "UINT16"), ("color", "VEC3", "UINT8"), ("name", "STRING", "")]
            .map(|(name, kind, component)| column(name, kind, component).expect("a required column"));
        let components = column("component", "SCALAR", "UINT16");
        let points = column("points", "SCALAR", "UINT32");
        let [area, confidence, sigma] = ["area", "confidence", "sigma"].map(|name| column(name, "SCALAR", "FLOAT32"));
        let float = |bytes: Option<&[u8]>, i: usize| bytes.map(|bytes| f32::from_le_bytes(word(bytes, i)));
        let offsets = self.view(&table["properties"]["name"]["stringOffsets"]);
        assert_eq!((ids.len(), offsets.len()), (2 * count, 4 * (count + 1)));
        assert!([points, area, confidence].iter().flatten().all(|bytes| bytes.len() == 4 * count));
        let text = |i: usize| {
            let at = |i| u32::from_le_bytes(word(offsets, i)) as usize;
            String::from_utf8(names[at(i)..at(i + 1)].to_vec()).expect("UTF-8")
        };
        let feature = |i: usize| Feature {
            id: short(ids, i),
            name: text(i),
            color: [0, 1, 2].map(|c| colors[3 * i + c]),
            points: points.map(|bytes| u32::from_le_bytes(word(bytes, i))),
            area: float(area, i),
            confidence: float(confidence, i),
            sigma: float(sigma, i),
            component: components.map(|c| short(c, i)),
        };
        (0..count).map(feature).collect()
    }

    /// For each vertex of a primitive what it belongs to, by the name of the feature set; nothing where that has no value.
    fn vertices(&self, primitive: &gltf::Primitive<'_>) -> BTreeMap<String, Vec<Option<Feature>>> {
        let extension = primitive.extension_value("EXT_mesh_features").expect("feature ids");
        let mut all = BTreeMap::new();
        for set in extension["featureIds"].as_array().expect("a list") {
            let rows = self.table(&set["propertyTable"]);
            let attribute = gltf::Semantic::Extras(format!("FEATURE_ID_{}", set["attribute"]));
            let accessor = primitive.get(&attribute).expect("the attribute");
            let view = accessor.view().expect("a view");
            assert_eq!((accessor.data_type(), accessor.normalized()), (gltf::accessor::DataType::U16, false));
            let stride = view.stride().unwrap_or(2);
            assert_eq!((stride % 4, accessor.offset() % 4), (0, 0), "attributes lie on four bytes");
            let bytes = &self.gltf.blob.as_ref().expect("a buffer")[view.offset() + accessor.offset()..];
            let ids: Vec<u16> =
                (0..accessor.count()).map(|i| u16::from_le_bytes([bytes[i * stride], bytes[i * stride + 1]])).collect();
            let null = set["nullFeatureId"].as_u64();
            let given: BTreeSet<u16> = ids.iter().copied().filter(|id| Some(u64::from(*id)) != null).collect();
            assert_eq!(set["featureCount"].as_u64(), Some(given.len() as u64));
            let feature = |id: &u16| (Some(u64::from(*id)) != null).then(|| rows[usize::from(*id)].clone());
            all.insert(set["label"].as_str().expect("a label").to_owned(), ids.iter().map(feature).collect());
        }
        all
    }
}

/// Checks what primitives of the vertices `sent`, in order, say of them.
fn check(
    scene: &Scene,
    primitives: &[gltf::Primitive<'_>],
    cloud: &SemanticCloud,
    sent: &[usize],
) -> Result<(), TestCaseError> {
    let taxonomy = taxonomy();
    let class = |list: &[ClassDef], id: u16| {
        list.get(usize::from(id)).map_or((format!("class {id}"), [128; 3]), |c| (c.name.clone(), c.color))
    };
    let mut next = sent.iter();
    for primitive in primitives {
        let found = scene.vertices(primitive);
        let count = primitive.get(&gltf::Semantic::Positions).expect("positions").count();
        for k in 0..count {
            let &i = next.next().expect("no more vertices than were sent");
            let of = |set: &str| found.get(set).and_then(|all| all[k].clone());
            let component = of("component").expect("every vertex has a component");
            prop_assert_eq!(
                (component.id, (component.name, component.color)),
                (cloud.labels[i], class(&taxonomy.components, cloud.labels[i]))
            );
            prop_assert_eq!(of("instance").map_or(0, |f| f.id), cloud.instances[i]);
            let defect = of("defect");
            prop_assert_eq!(defect.as_ref().map_or(0, |f| f.id), cloud.defects[i]);
            if let Some(defect) = defect {
                prop_assert_eq!((defect.name, defect.color), class(&taxonomy.defects, cloud.defects[i]));
            }
        }
    }
    prop_assert!(next.next().is_none(), "no fewer vertices than were sent");
    Ok(())
}

fn label_of(node: &gltf::Node<'_>) -> u16 {
    let extras: Value = serde_json::from_str(node.extras().as_ref().expect("extras").get()).expect("JSON");
    extras["class"].as_u64().expect("a class") as u16
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_vertex_of_a_mesh_brings_back_what_it_belongs_to(mesh in any_mesh()) {
        let mut bytes = Vec::new();
        let figures = model_figures(&mesh.vertices, &mesh, 0.001);
        let options = GlbOptions { part: "motor".into(), figures: figures.clone(), ..GlbOptions::default() };
        write_mesh(&mut bytes, &mesh, &taxonomy(), &options).expect("a valid mesh");
        let scene = Scene::read(&bytes);
        for shown in scene.gltf.scenes() {
            for node in shown.nodes().next().expect("a root").children() {
                let label = label_of(&node);
                let used: BTreeSet<usize> = mesh.triangles.iter().filter(|t| mesh.triangle_label(**t) == label).flatten().map(|v| *v as usize).collect();
                let primitives: Vec<_> = node.mesh().expect("a mesh").primitives().collect();
                check(&scene, &primitives, &mesh.vertices, &used.into_iter().collect::<Vec<_>>())?;
            }
        }
        if !mesh.triangles.is_empty() {
            for (index, kind) in ["component", "defect", "instance"].into_iter().enumerate() {
                let Some(class) = scene.metadata["propertyTables"][index]["class"].as_str() else { continue };
                for feature in scene.table(&index.into()) {
                    let expected = match class {
                        "component" => figures.component(feature.id),
                        "defect" => figures.defect(feature.id),
                        _ => figures.instance(feature.id),
                    };
                    let expected = expected.unwrap_or_else(|| panic!("figures of {kind} {}", feature.id));
                    prop_assert_eq!(feature.points, Some(expected.points as u32));
                    prop_assert_eq!(feature.area, expected.area.map(|a| a as f32));
                    prop_assert_eq!(feature.confidence, Some(expected.confidence as f32));
                    prop_assert_eq!(feature.sigma, Some(expected.sigma as f32));
                    prop_assert_eq!(feature.component, (class == "instance").then_some(expected.component));
                }
            }
            for node in scene.gltf.scenes().flat_map(|s| s.nodes()).flat_map(|root| root.children().collect::<Vec<_>>()) {
                let extras: Value = serde_json::from_str(node.extras().as_ref().expect("extras").get()).expect("JSON");
                let label = label_of(&node);
                let expected = figures.component(label).expect("a component of the mesh");
                prop_assert_eq!(extras["area"].as_f64(), expected.area);
                prop_assert_eq!(extras["points"].as_u64(), Some(expected.points));
                let findings: Vec<_> = extras["findings"].as_array().expect("a list").iter().map(|f| (f["defect"].as_u64(), f["area"].as_f64())).collect();
                let expected: Vec<_> = figures.findings_on(label).map(|f| (Some(u64::from(f.id)), f.area)).collect();
                prop_assert_eq!(findings, expected);
            }
        }
    }

    #[test]
    fn every_point_of_a_cloud_brings_back_what_it_belongs_to(cloud in any_cloud()) {
        let mut bytes = Vec::new();
        write_points(&mut bytes, &cloud, &taxonomy(), &GlbOptions { part: "motor".into(), ..GlbOptions::default() }).expect("a Vec takes everything");
        let scene = Scene::read(&bytes);
        for shown in scene.gltf.scenes() {
            for node in shown.nodes().next().expect("a root").children() {
                let label = label_of(&node);
                let mut sent: Vec<usize> = (0..cloud.len()).filter(|i| cloud.labels[*i] == label).collect();
                // Oriented points come first.
                sent.sort_by_key(|i| cloud.normals[*i] == [0.0; 3]);
                let primitives: Vec<_> = node.mesh().expect("a mesh").primitives().collect();
                check(&scene, &primitives, &cloud, &sent)?;
            }
        }
    }
}

#[test]
fn a_defect_is_a_finding_of_its_component() {
    let mut cloud: SemanticCloud = std::iter::repeat_n(
        semascan_model::SemanticPoint {
            position: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            color: [9; 3],
            label: 2,
            confidence: 1.0,
            defect: 1,
            defect_confidence: 0.75,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 5,
            views: 1,
            flags: Default::default(),
        },
        3,
    )
    .collect();
    cloud.defects[2] = 0;
    let mut bytes = Vec::new();
    let figures = model_figures(&cloud, &SemanticMesh::default(), 0.001);
    let options = GlbOptions { part: "motor".into(), figures, ..GlbOptions::default() };
    write_points(&mut bytes, &cloud, &taxonomy(), &options).expect("a Vec takes everything");
    let scene = Scene::read(&bytes);
    let node = scene.gltf.nodes().find(|n| n.mesh().is_some()).expect("a component");
    let extras: Value = serde_json::from_str(node.extras().as_ref().expect("extras").get()).expect("JSON");
    let finding = &extras["findings"][0];
    assert_eq!((&finding["defect"], &finding["name"]), (&1.into(), &"corrosion".into()));
    assert_eq!((finding["points"].as_u64(), finding.get("area")), (Some(2), None), "without a mesh no area is known");
    assert_eq!((finding["confidence"].as_f64(), extras["findings"].as_array().map(Vec::len)), (Some(0.75), Some(1)));
    let instance = scene.table(&2.into());
    assert_eq!((instance.len(), instance[0].id, instance[0].component), (1, 5, Some(2)));
    assert_eq!((instance[0].points, instance[0].area), (Some(3), None));
}
