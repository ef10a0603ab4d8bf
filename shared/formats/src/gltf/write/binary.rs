//! The shared buffer: all positions, then all normals, all colours, all feature ids and all indices, a buffer view each,
//! and the columns of the property tables.

use super::features::Features;
use gltf_json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Stride, Target, View};
use gltf_json::mesh::Semantic;
use gltf_json::validation::{Checked, Checked::Valid, USize64};
use gltf_json::{Index, Root};
use semascan_model::{Color, SemanticCloud};
use std::collections::BTreeMap;

/// Accessors of a primitive.
pub(super) type Attributes = BTreeMap<Checked<Semantic>, Index<Accessor>>;

/// Columns that fill up bin by bin.
#[derive(Debug)]
pub(super) struct Binary {
    positions: Column,
    normals: Column,
    colors: Column,
    texture_places: Column,
    /// Those of a vertex together, each in four bytes: attributes lie on such boundaries.
    features: Column,
    indices: Column,
    /// Columns of property tables, and pictures.
    tables: Vec<(Index<View>, Vec<u8>)>,
}

impl Binary {
    /// For vertices with so many feature ids.
    pub(super) fn new(feature_ids: usize) -> Self {
        // glTF's colours are linear: eight linear bits would merge dark sRGB levels, sixteen keep all 256 apart.
        Self {
            positions: Column::new("positions", 12, ComponentType::F32, Type::Vec3),
            normals: Column::new("normals", 12, ComponentType::F32, Type::Vec3),
            colors: Column { normalized: true, ..Column::new("colors", 8, ComponentType::U16, Type::Vec4) },
            texture_places: Column::new("texture coordinates", 8, ComponentType::F32, Type::Vec2),
            features: Column::new("feature ids", 4 * feature_ids, ComponentType::U16, Type::Scalar),
            indices: Column { is_attribute: false, ..Column::new("indices", 4, ComponentType::U32, Type::Scalar) },
            tables: Vec::new(),
        }
    }

    /// Adds the positions of some points, at least one, and their normals if they have such.
    pub(super) fn geometry(
        &mut self,
        root: &mut Root,
        cloud: &SemanticCloud,
        points: &[usize],
        with_normals: bool,
    ) -> Attributes {
        let start = self.positions.bytes.len();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for &i in points {
            let position = cloud.positions[i];
            for a in 0..3 {
                low[a] = low[a].min(position[a]);
                high[a] = high[a].max(position[a]);
            }
            self.positions.bytes.extend(position.iter().flat_map(|c| c.to_le_bytes()));
        }
        let bounds = Some((low, high));
        let positions = self.positions.accessor(root, start, points.len(), bounds);
        let mut attributes = Attributes::from([(Valid(Semantic::Positions), positions)]);
        if with_normals {
            let start = self.normals.bytes.len();
            for &i in points {
                let normal = cloud.normals[i];
                let length = normal.iter().map(|c| c * c).sum::<f32>().sqrt();
                self.normals.bytes.extend(normal.iter().flat_map(|c| (c / length).to_le_bytes()));
            }
            let normals = self.normals.accessor(root, start, points.len(), None);
            attributes.insert(Valid(Semantic::Normals), normals);
        }
        attributes
    }

    /// Adds the colours of some points, at least one.
    pub(super) fn colors(&mut self, root: &mut Root, cloud: &SemanticCloud, points: &[usize]) -> Index<Accessor> {
        let start = self.colors.bytes.len();
        for &i in points {
            let [r, g, b] = linear(cloud.colors[i]);
            self.colors.bytes.extend([r, g, b, u16::MAX].iter().flat_map(|c| c.to_le_bytes()));
        }
        self.colors.accessor(root, start, points.len(), None)
    }

    /// Adds the places of some points, at least one, in a picture.
    pub(super) fn texture_places(&mut self, root: &mut Root, places: &[[f32; 2]]) -> Index<Accessor> {
        let start = self.texture_places.bytes.len();
        self.texture_places.bytes.extend(places.iter().flatten().flat_map(|c| c.to_le_bytes()));
        self.texture_places.accessor(root, start, places.len(), None)
    }

    /// Adds an encoded picture.
    pub(super) fn picture(&mut self, root: &mut Root, bytes: &[u8]) -> Index<View> {
        let view = root.push(view("picture", None, None));
        self.tables.push((view, bytes.to_vec()));
        view
    }

    /// Adds the feature ids of some points, at least one.
    pub(super) fn features(
        &mut self,
        root: &mut Root,
        cloud: &SemanticCloud,
        points: &[usize],
        features: &Features,
    ) -> Attributes {
        let start = self.features.bytes.len();
        for &i in points {
            self.features.bytes.extend(features.ids(cloud, i).flat_map(|id| u32::from(id).to_le_bytes()));
        }
        let attribute = |k| {
            let accessor = self.features.accessor(root, start + 4 * k, points.len(), None);
            (Valid(Semantic::Extras(format!("FEATURE_ID_{k}"))), accessor)
        };
        (0..features.len()).map(attribute).collect()
    }

    /// Adds a column of a property table; the index of its buffer view.
    pub(super) fn table(&mut self, root: &mut Root, bytes: &[u8]) -> usize {
        let view = root.push(view("property table", None, None));
        // glTF allows no empty view.
        let bytes = if bytes.is_empty() { vec![0] } else { bytes.to_vec() };
        self.tables.push((view, bytes));
        view.value()
    }

    /// Adds some triangles, at least one.
    pub(super) fn indices(&mut self, root: &mut Root, triangles: &[[u32; 3]]) -> Index<Accessor> {
        let start = self.indices.bytes.len();
        self.indices.bytes.extend(triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
        self.indices.accessor(root, start, 3 * triangles.len(), None)
    }

    /// Joins the columns and enters the buffer in `root`.
    pub(super) fn finish(self, root: &mut Root) -> Vec<u8> {
        let mut buffer = Vec::new();
        let vertices = [self.positions, self.normals, self.colors, self.texture_places];
        let columns = vertices.into_iter().chain([self.features, self.indices]);
        let columns = columns.filter_map(|column| Some((column.view?, column.bytes)));
        for (view, bytes) in columns.chain(self.tables) {
            // Columns of property tables begin on eight bytes.
            buffer.resize(buffer.len().next_multiple_of(8), 0);
            let view = &mut root.buffer_views[view.value()];
            view.byte_offset = Some(USize64::from(buffer.len()));
            view.byte_length = USize64::from(bytes.len());
            buffer.extend_from_slice(&bytes);
        }
        if !buffer.is_empty() {
            let byte_length = USize64::from(buffer.len());
            root.push(Buffer { byte_length, name: None, uri: None, extensions: None, extras: None });
        }
        buffer
    }
}

/// One attribute of all points.
#[derive(Debug)]
struct Column {
    name: &'static str,
    stride: usize,
    component: ComponentType,
    shape: Type,
    /// Whether whole numbers stand for shares of their largest.
    normalized: bool,
    /// Whether it is a vertex attribute: indices are none.
    is_attribute: bool,
    /// Made with the first accessor: glTF allows no empty view.
    view: Option<Index<View>>,
    bytes: Vec<u8>,
}

impl Column {
    fn new(name: &'static str, stride: usize, component: ComponentType, shape: Type) -> Self {
        Self { name, stride, component, shape, normalized: false, is_attribute: true, view: None, bytes: Vec::new() }
    }

    fn accessor(
        &mut self,
        root: &mut Root,
        start: usize,
        count: usize,
        bounds: Option<([f32; 3], [f32; 3])>,
    ) -> Index<Accessor> {
        let target = if self.is_attribute { Target::ArrayBuffer } else { Target::ElementArrayBuffer };
        // Indices lie close.
        let stride = self.is_attribute.then_some(Stride(self.stride));
        let view = *self.view.get_or_insert_with(|| root.push(view(self.name, stride, Some(target))));
        let (min, max) = bounds.unzip();
        root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64::from(start)),
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(self.component)),
            type_: Valid(self.shape),
            min: min.map(|m| m.to_vec().into()),
            max: max.map(|m| m.to_vec().into()),
            normalized: self.normalized,
            name: None,
            sparse: None,
            extensions: None,
            extras: None,
        })
    }
}

/// A view of the only buffer. Offset and length are known in the end.
fn view(name: &str, byte_stride: Option<Stride>, target: Option<Target>) -> View {
    View {
        buffer: Index::new(0),
        byte_length: USize64(0),
        byte_offset: None,
        byte_stride,
        name: Some(name.into()),
        target: target.map(Valid),
        extensions: None,
        extras: None,
    }
}

/// Linear light of an sRGB colour (IEC 61966-2-1), in 1/65535.
pub(super) fn linear(color: Color) -> [u16; 3] {
    color.map(|c| {
        let c = f32::from(c) / 255.0;
        let light = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        (light * f32::from(u16::MAX)).round() as u16
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn no_two_srgb_levels_merge() {
        let levels: Vec<u16> = (0..=255).map(|c| super::linear([c; 3])[0]).collect();
        assert!(levels.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((levels[0], levels[255]), (0, u16::MAX));
    }
}
