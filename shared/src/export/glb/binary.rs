//! The shared buffer: all positions, then all normals, all colours and all indices, a buffer view each.

use crate::model::{Color, SemanticCloud};
use gltf_json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Stride, Target, View};
use gltf_json::mesh::Semantic;
use gltf_json::validation::{Checked, Checked::Valid, USize64};
use gltf_json::{Index, Root};
use std::collections::BTreeMap;

/// Accessors of a primitive.
pub(super) type Attributes = BTreeMap<Checked<Semantic>, Index<Accessor>>;

/// Columns that fill up bin by bin.
#[derive(Debug)]
pub(super) struct Binary {
    positions: Column,
    normals: Column,
    colors: Column,
    indices: Column,
}

impl Binary {
    pub(super) fn new() -> Self {
        // glTF's colours are linear: eight linear bits would merge dark sRGB levels, sixteen keep all 256 apart.
        Self {
            positions: Column::new("positions", 12, ComponentType::F32, Type::Vec3),
            normals: Column::new("normals", 12, ComponentType::F32, Type::Vec3),
            colors: Column::new("colors", 8, ComponentType::U16, Type::Vec4),
            indices: Column::new("indices", 4, ComponentType::U32, Type::Scalar),
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

    /// Adds some triangles, at least one.
    pub(super) fn indices(&mut self, root: &mut Root, triangles: &[[u32; 3]]) -> Index<Accessor> {
        let start = self.indices.bytes.len();
        self.indices.bytes.extend(triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
        self.indices.accessor(root, start, 3 * triangles.len(), None)
    }

    /// Joins the columns and enters the buffer in `root`.
    pub(super) fn finish(self, root: &mut Root) -> Vec<u8> {
        let mut buffer = Vec::new();
        for column in [self.positions, self.normals, self.colors, self.indices] {
            if let Some(view) = column.view {
                let view = &mut root.buffer_views[view.value()];
                view.byte_offset = Some(USize64::from(buffer.len()));
                view.byte_length = USize64::from(column.bytes.len());
                buffer.extend_from_slice(&column.bytes);
            }
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
    /// Made with the first accessor: glTF allows no empty view.
    view: Option<Index<View>>,
    bytes: Vec<u8>,
}

impl Column {
    fn new(name: &'static str, stride: usize, component: ComponentType, shape: Type) -> Self {
        Self { name, stride, component, shape, view: None, bytes: Vec::new() }
    }

    fn accessor(
        &mut self,
        root: &mut Root,
        start: usize,
        count: usize,
        bounds: Option<([f32; 3], [f32; 3])>,
    ) -> Index<Accessor> {
        let view = *self.view.get_or_insert_with(|| {
            root.push(View {
                // The only buffer.
                buffer: Index::new(0),
                // Offset and length are known in the end.
                byte_length: USize64(0),
                byte_offset: None,
                // Indices are no vertex attributes, and lie close.
                byte_stride: (self.shape != Type::Scalar).then_some(Stride(self.stride)),
                name: Some(self.name.into()),
                target: Some(Valid(match self.shape {
                    Type::Scalar => Target::ElementArrayBuffer,
                    _ => Target::ArrayBuffer,
                })),
                extensions: None,
                extras: None,
            })
        });
        let (min, max) = bounds.unzip();
        root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64::from(start)),
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(self.component)),
            type_: Valid(self.shape),
            min: min.map(|m| m.to_vec().into()),
            max: max.map(|m| m.to_vec().into()),
            normalized: self.component == ComponentType::U16,
            name: None,
            sparse: None,
            extensions: None,
            extras: None,
        })
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
