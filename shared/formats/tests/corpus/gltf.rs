//! glTF: text and binary; coordinates, indices and colours of every type; lists, strips, fans and points.

use super::numbers::Kind;
use super::{POSITIONS, Variant, levels, triangles};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Number of a type in glTF.
fn component(kind: Kind) -> u32 {
    match kind {
        Kind::I8 => 5120,
        Kind::U8 => 5121,
        Kind::I16 => 5122,
        Kind::U16 => 5123,
        Kind::U32 => 5125,
        _ => 5126,
    }
}

/// The buffer, its views and accessors in the making.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Buffer {
    /// Adds elements, each at a multiple of four bytes, and gives the number of their accessor.
    fn add(&mut self, kind: Kind, shape: &str, normalized: bool, elements: &[Vec<f64>]) -> usize {
        let (start, width) = (self.bytes.len(), elements[0].len() * kind.size());
        // Indices stand close to each other.
        let stride = if shape == "SCALAR" { width } else { width.next_multiple_of(4) };
        for element in elements {
            let end = self.bytes.len() + stride;
            element.iter().for_each(|value| kind.append(*value, &mut self.bytes));
            self.bytes.resize(end, 0);
        }
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let index = self.accessors.len();
        let stride = if shape == "SCALAR" { String::new() } else { format!(",\"byteStride\":{stride}") };
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{length}{stride}}}"));
        let least = |k: usize| elements.iter().map(|e| e[k]).fold(f64::INFINITY, f64::min).to_string();
        let most = |k: usize| elements.iter().map(|e| e[k]).fold(f64::NEG_INFINITY, f64::max).to_string();
        let list = |of: &dyn Fn(usize) -> String| (0..elements[0].len()).map(of).collect::<Vec<_>>().join(",");
        self.accessors.push(format!(
            "{{\"bufferView\":{index},\"componentType\":{},\"normalized\":{normalized},\"count\":{},\"type\":\"{shape}\",\
             \"min\":[{}],\"max\":[{}]}}",
            component(kind),
            elements.len(),
            list(&least),
            list(&most)
        ));
        index
    }

    /// The file: GLB, or JSON with the buffer within it.
    fn file(&self, primitive: &str, quantized: bool, binary: bool) -> Vec<u8> {
        let uri = if binary {
            String::new()
        } else {
            format!(",\"uri\":\"data:application/octet-stream;base64,{}\"", STANDARD.encode(&self.bytes))
        };
        let needed = if quantized {
            "\"extensionsUsed\":[\"KHR_mesh_quantization\"],\"extensionsRequired\":[\"KHR_mesh_quantization\"],"
        } else {
            ""
        };
        let mut json = format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},{needed}\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
             \"meshes\":[{{\"primitives\":[{{{primitive}}}]}}],\"accessors\":[{}],\"bufferViews\":[{}],\
             \"buffers\":[{{\"byteLength\":{}{uri}}}]}}",
            self.accessors.join(","),
            self.views.join(","),
            self.bytes.len()
        )
        .into_bytes();
        if !binary {
            return json;
        }
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = (28 + json.len() + self.bytes.len()) as u32;
        let mut out = [b"glTF\x02\0\0\0".as_slice(), &total.to_le_bytes()].concat();
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }
}

/// How vertices make triangles: its name and mode, the indices for it, and the triangles that come of them.
type Topology = (&'static str, u32, Vec<u32>, Vec<[u32; 3]>);

fn topologies() -> [Topology; 4] {
    let strip = vec![0, 1, 4, 5, 7, 6];
    let fan = vec![0, 1, 2, 3, 7];
    [
        ("points", 0, Vec::new(), Vec::new()),
        ("list", 4, triangles().concat(), triangles()),
        ("strip", 5, strip, vec![[0, 1, 4], [4, 1, 5], [4, 5, 7], [7, 5, 6]]),
        ("fan", 6, fan, vec![[0, 1, 2], [0, 2, 3], [0, 3, 7]]),
    ]
}

/// As the readers turn it: z up.
fn upright(variant: &mut Variant) {
    variant.positions.iter_mut().for_each(|p| *p = [p[0], -p[2], p[1]]);
}

pub(crate) fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    let positions: Vec<Vec<f64>> = POSITIONS.iter().map(|p| p.map(f64::from).to_vec()).collect();
    for binary in [true, false] {
        let ending = if binary { "glb" } else { "gltf" };
        for (name, mode, indices, expected) in topologies() {
            for coordinate in [Kind::F32, Kind::I8, Kind::U8, Kind::I16, Kind::U16] {
                for index in [None, Some(Kind::U8), Some(Kind::U16), Some(Kind::U32)] {
                    if indices.is_empty() && index.is_some() {
                        continue;
                    }
                    let mut buffer = Buffer::default();
                    // Without indices the vertices stand in the order of the triangles.
                    let in_order: Vec<Vec<f64>> = match index {
                        None if mode != 0 => indices.iter().map(|v| positions[*v as usize].clone()).collect(),
                        _ => positions.clone(),
                    };
                    let place = buffer.add(coordinate, "VEC3", false, &in_order);
                    let mut primitive = format!("\"attributes\":{{\"POSITION\":{place}}},\"mode\":{mode}");
                    if let Some(index) = index {
                        let numbers: Vec<Vec<f64>> = indices.iter().map(|v| vec![f64::from(*v)]).collect();
                        let place = buffer.add(index, "SCALAR", false, &numbers);
                        primitive += &format!(",\"indices\":{place}");
                    }
                    let quantized = coordinate != Kind::F32;
                    let file = buffer.file(&primitive, quantized, binary);
                    let index = index.map_or("none".to_owned(), |kind| format!("{kind:?}"));
                    let name = format!("{name}-{coordinate:?}-index-{index}.{ending}");
                    let mut variant = Variant::of_box(name, file, false);
                    variant.triangles.clone_from(&expected);
                    upright(&mut variant);
                    // trimesh knows no fans.
                    variant.foreign = mode != 6;
                    variants.push(variant);
                }
            }
        }
        for (kind, full) in [(Kind::U8, 255.0), (Kind::U16, 65_535.0), (Kind::F32, 1.0)] {
            for shape in ["VEC3", "VEC4"] {
                let mut buffer = Buffer::default();
                let place = buffer.add(Kind::F32, "VEC3", false, &positions);
                // Vertex colours are linear.
                let linear = |level: u8| (f64::from(level) / 255.0).powf(2.2);
                let color = |c: &[u8; 3]| {
                    let share = |level: u8| linear(level) * full;
                    let share = |level: u8| if kind == Kind::F32 { share(level) } else { share(level).round() };
                    let mut color = c.map(share).to_vec();
                    color.resize(if shape == "VEC3" { 3 } else { 4 }, full);
                    color
                };
                let colors: Vec<Vec<f64>> = levels().iter().map(color).collect();
                let colors = buffer.add(kind, shape, kind != Kind::F32, &colors);
                let primitive = format!("\"attributes\":{{\"POSITION\":{place},\"COLOR_0\":{colors}}},\"mode\":0");
                let file = buffer.file(&primitive, false, binary);
                let mut variant = Variant::of_box(format!("colors-{kind:?}-{shape}.{ending}"), file, false);
                upright(&mut variant);
                variant.colors = levels();
                if kind == Kind::U8 {
                    // Eight linear bits do not tell the darkest levels apart.
                    let stored = |level: u8| (linear(level) * 255.0).round() / 255.0;
                    let seen = |level: u8| (stored(level).powf(1.0 / 2.2) * 255.0).round() as u8;
                    variant.colors.iter_mut().for_each(|c| *c = c.map(seen));
                }
                variants.push(variant);
            }
        }
    }
    variants
}
