//! What a scene knows beside its looks: to which component, defect and instance each vertex belongs
//! (`EXT_mesh_features`), and what these are (`EXT_structural_metadata`).
//!
//! A feature is one of them that occurs in the scene. Its id is a row of a property table; a vertex's ids stand in the
//! attributes `_FEATURE_ID_0`, `_FEATURE_ID_1` and `_FEATURE_ID_2`. Both extensions: [3D Tiles Next].

use super::binary::Binary;
use super::class_of;
use gltf_json::{Root, extensions};
use semascan_model::{Color, FeatureFigures, ModelFigures, SemanticCloud, Taxonomy};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// A set of features: what a vertex belongs to, of one kind.
#[derive(Debug)]
struct FeatureSet {
    kind: Kind,
    /// Features in the order of their rows.
    features: Vec<Feature>,
    /// Row of each.
    rows: BTreeMap<u16, u16>,
}

/// What features are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Component,
    Defect,
    /// Vertices of instance 0 belong to none.
    Instance,
}

/// A component, a defect or an instance.
#[derive(Debug)]
struct Feature {
    /// Class, or number of the instance.
    id: u16,
    name: String,
    color: Color,
    /// The model's figures of it, if these are known.
    figures: Option<FeatureFigures>,
}

/// All features of a scene.
#[derive(Debug)]
pub(super) struct Features {
    sets: Vec<FeatureSet>,
}

impl Features {
    /// Of the vertices `all` of a cloud that shows a model with these `figures`. Where nothing is defective, or no instances
    /// are told apart, these are left out.
    pub(super) fn of(cloud: &SemanticCloud, all: &[usize], figures: &ModelFigures, taxonomy: &Taxonomy) -> Self {
        let mut sets = vec![FeatureSet::of(Kind::Component, cloud, all, figures, taxonomy)];
        if all.iter().any(|&i| cloud.defects[i] != 0) {
            sets.push(FeatureSet::of(Kind::Defect, cloud, all, figures, taxonomy));
        }
        if all.iter().any(|&i| cloud.instances[i] != 0) {
            sets.push(FeatureSet::of(Kind::Instance, cloud, all, figures, taxonomy));
        }
        Self { sets }
    }

    /// Number of feature ids of a vertex.
    pub(super) fn len(&self) -> usize {
        self.sets.len()
    }

    /// Feature ids of vertex `i`, one of each set.
    pub(super) fn ids(&self, cloud: &SemanticCloud, i: usize) -> impl Iterator<Item = u16> {
        self.sets.iter().map(move |set| set.rows.get(&set.kind.of(cloud, i)).copied().unwrap_or(set.null()))
    }

    /// `EXT_mesh_features` of a primitive of these vertices.
    pub(super) fn of_primitive(&self, cloud: &SemanticCloud, vertices: &[usize]) -> extensions::mesh::Primitive {
        let set = |(k, set): (usize, &FeatureSet)| {
            let occurring: BTreeSet<u16> = vertices.iter().map(|&i| set.kind.of(cloud, i)).collect();
            let count = occurring.iter().filter(|value| set.rows.contains_key(value)).count();
            let mut ids =
                json!({ "featureCount": count, "attribute": k, "label": set.kind.name(), "propertyTable": k });
            if occurring.iter().any(|value| !set.rows.contains_key(value)) {
                ids["nullFeatureId"] = set.null().into();
            }
            // A primitive must have a feature.
            (count > 0).then_some(ids)
        };
        let ids: Vec<Value> = self.sets.iter().enumerate().filter_map(set).collect();
        let others = [("EXT_mesh_features".to_owned(), json!({ "featureIds": ids }))];
        extensions::mesh::Primitive { others: others.into_iter().collect() }
    }

    /// Enters `EXT_structural_metadata` with the property tables in `root`.
    pub(super) fn describe(&self, root: &mut Root, binary: &mut Binary) {
        let (mut classes, mut tables) = (Map::new(), Vec::new());
        for set in &self.sets {
            let (properties, values) = set.columns(root, binary);
            classes.insert(set.kind.name().into(), json!({ "properties": properties }));
            tables.push(json!({
                "name": format!("{}s", set.kind.name()),
                "class": set.kind.name(),
                "count": set.features.len(),
                "properties": values,
            }));
        }
        let schema = json!({ "id": "semascan", "version": env!("CARGO_PKG_VERSION"), "classes": classes });
        let metadata = json!({ "schema": schema, "propertyTables": tables });
        root.extensions_used.extend(["EXT_mesh_features", "EXT_structural_metadata"].map(str::to_owned));
        let others = [("EXT_structural_metadata".to_owned(), metadata)].into_iter().collect();
        root.extensions = Some(extensions::root::Root { others });
    }
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Component => "component",
            Self::Defect => "defect",
            Self::Instance => "instance",
        }
    }

    /// What vertex `i` belongs to.
    fn of(self, cloud: &SemanticCloud, i: usize) -> u16 {
        match self {
            Self::Component => cloud.labels[i],
            Self::Defect => cloud.defects[i],
            Self::Instance => cloud.instances[i],
        }
    }
}

impl FeatureSet {
    fn of(kind: Kind, cloud: &SemanticCloud, all: &[usize], figures: &ModelFigures, taxonomy: &Taxonomy) -> Self {
        let occurring: BTreeSet<u16> = all.iter().map(|&i| kind.of(cloud, i)).collect();
        let absent = figures.absent();
        let feature = |id: u16| {
            let figures = match kind {
                Kind::Component => figures.component(id),
                Kind::Defect => figures.defect(id),
                Kind::Instance => figures.instance(id),
            };
            let figures = figures.or(absent);
            let (name, color) = match kind {
                Kind::Component => class_of(&taxonomy.components, id),
                Kind::Defect => class_of(&taxonomy.defects, id),
                Kind::Instance => class_of(&taxonomy.components, figures.map_or(0, |f| f.component)),
            };
            Feature { id, name, color, figures }
        };
        let features: Vec<Feature> =
            occurring.into_iter().filter(|id| kind != Kind::Instance || *id != 0).map(feature).collect();
        let rows = features.iter().zip(0..).map(|(feature, row)| (feature.id, row)).collect();
        Self { kind, features, rows }
    }

    /// The id of vertices that belong to no feature.
    fn null(&self) -> u16 {
        // There are at most 65535 instances, for 0 is none.
        self.features.len() as u16
    }

    /// The columns of the property table: their types, and where their values are.
    fn columns(&self, root: &mut Root, binary: &mut Binary) -> (Map<String, Value>, Map<String, Value>) {
        let (mut types, mut values) = (Map::new(), Map::new());
        let mut scalars = |name: &str, component_type: &str, about: &str, bytes: Vec<u8>| {
            let column =
                json!({ "type": "SCALAR", "componentType": component_type, "required": true, "description": about });
            types.insert(name.into(), column);
            values.insert(name.into(), json!({ "values": binary.table(root, &bytes) }));
        };
        let ids = self.features.iter().flat_map(|f| f.id.to_le_bytes()).collect();
        scalars("id", "UINT16", "class, or number of the instance", ids);
        // A column says the same of every feature: one that is not known of each is left out.
        let known: Option<Vec<FeatureFigures>> = self.features.iter().map(|f| f.figures).collect();
        if let Some(known) = &known {
            let floats =
                |of: fn(&FeatureFigures) -> f64| known.iter().flat_map(|f| (of(f) as f32).to_le_bytes()).collect();
            let points = known.iter().flat_map(|f| (f.points.min(u32::MAX.into()) as u32).to_le_bytes()).collect();
            scalars("points", "UINT32", "points of the model", points);
            if known.iter().all(|f| f.area.is_some()) {
                let about = "square metres of the surface that was seen";
                scalars("area", "FLOAT32", about, floats(|f| f.area.unwrap_or_default()));
            }
            scalars("confidence", "FLOAT32", "mean share of the class over the points", floats(|f| f.confidence));
            scalars("sigma", "FLOAT32", "mean standard uncertainty of the label", floats(|f| f.sigma));
            if self.kind == Kind::Instance {
                let components = known.iter().flat_map(|f| f.component.to_le_bytes()).collect();
                scalars("component", "UINT16", "class of the most part of it", components);
            }
        }
        let color = json!({ "type": "VEC3", "componentType": "UINT8", "required": true, "description": "sRGB" });
        types.insert("color".into(), color);
        let colors: Vec<u8> = self.features.iter().flat_map(|f| f.color).collect();
        values.insert("color".into(), json!({ "values": binary.table(root, &colors) }));
        types.insert("name".into(), json!({ "type": "STRING", "required": true }));
        let (mut text, mut offsets) = (Vec::new(), 0_u32.to_le_bytes().to_vec());
        for feature in &self.features {
            text.extend(feature.name.bytes());
            offsets.extend((text.len() as u32).to_le_bytes());
        }
        let (text, offsets) = (binary.table(root, &text), binary.table(root, &offsets));
        values.insert("name".into(), json!({ "values": text, "stringOffsets": offsets, "stringOffsetType": "UINT32" }));
        (types, values)
    }
}
